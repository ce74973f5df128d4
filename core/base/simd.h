// Which instruction set a march uses. For whoever runs renders: pictures are the same with any.
#pragma once

#include <string_view>
#include <vector>

namespace relit {

enum class Simd {
    portable,  ///< what every processor of the target has
    avx2,
    avx512,  ///< F, BW, DQ and VL
};

/// Those that this processor and this build have, the fastest last; `portable` always.
[[nodiscard]] std::vector<Simd> available_simd();

/// The fastest of them.
[[nodiscard]] Simd best_simd();

[[nodiscard]] std::string_view name_of(Simd simd);

}  // namespace relit
