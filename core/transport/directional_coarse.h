// A surface and its light on a grid of fewer texels, and what was summed there back on all of them: for
// previews. For directional_sum.cpp.
#pragma once

#include "core/base/parallel.h"
#include "core/image/image.h"
#include "core/transport/directional_grid.h"

namespace relit {

/// Squares of factor x factor texels as one: their area, its mean height and normal. The last of a row
/// or column may stand for fewer.
[[nodiscard]] DirectionalSurface coarse_surface(const DirectionalSurface& surface, int factor,
                                                const Executor& executor);

struct DirectionalLight {
    Image flux;    ///< 3 channels
    Image inward;  ///< 3 channels, the mean weighted by flux
};
[[nodiscard]] DirectionalLight coarse_light(const Image& flux, const Image& inward, int factor,
                                            const Executor& executor, const std::stop_token& stop);

/// Affine sums of a coarse grid, bilinear between its texels, with the normals of `surface`; at least 0.
[[nodiscard]] Image with_fine_normals(const Image& sums, const Image& coarse_area,
                                      const DirectionalSurface& surface, int factor,
                                      const Executor& executor, const std::stop_token& stop);

}  // namespace relit
