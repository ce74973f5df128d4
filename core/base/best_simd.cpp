// Apart from the rest of simd.h: a program that is to run on one instruction set, as the tests on the
// portable one, defines this function itself, and the linker leaves this file in its library.
#include "core/base/simd.h"

namespace relit {

Simd best_simd() {
    static const Simd best = available_simd().back();
    return best;
}

}  // namespace relit
