#include "core/visibility/kernels/wide_avx512.h"
//
#include "core/visibility/kernels/packet.h"

namespace relit::kernels {

void march_avx512(const Scenery& scenery, const double* from, int count, double* r) {
    march(scenery, from, count, r);
}

}  // namespace relit::kernels
