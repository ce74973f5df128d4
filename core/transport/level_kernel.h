// The part of a radial kernel that one level of a sum level by level is made with (level_sum.h).
#pragma once

#include <vector>

#include "core/transport/kernels/levels.h"
#include "core/transport/radial_kernel.h"

namespace relit {

/// Which part. Lengths are in texels.
struct LevelOfKernel {
    int level = 0;          ///< nodes lie 2^level apart
    double softening = 1;   ///< a_l; the next level's is twice that
    bool is_first = false;  ///< not softened
    bool is_last = false;   ///< nothing is left to a next one
    double extent = 0;      ///< no two texels are farther apart, or act on each other
    double relief = 0;      ///< nor higher above each other
};

/// Of nodes at every offset, row by row.
struct LevelKernel {
    std::vector<float> pieces;
    std::vector<kernels::LevelOffset> offsets;  ///< point into the pieces
};

[[nodiscard]] LevelKernel level_kernel(const RadialKernel& kernel, const LevelOfKernel& level);

}  // namespace relit
