// The marches that others use, compiled with the same flags in the same program, so that ratios are
// honest: the thesis's fixed number of steps, and one bilinear step per texel with and without an
// early stop. Each gives the thickness-based d of every texel for one point light over endless
// ground, offset along the view.
#pragma once

#include <span>

#include "core/base/parallel.h"
#include "core/field/solid.h"

namespace relit::bench {

/// Perumal 2017, 4.3.1: `steps` nearest samples between the texel and the light.
void march_thesis(const Solid& solid, Vec3 light, double depth, int steps, const Executor& executor,
                  Image& d);

/// One bilinear sample per texel of the way, whole samples counted.
/// @param stop_at_top  end where the ray leaves the highest point of the map below it
void march_per_texel(const Solid& solid, Vec3 light, double depth, bool stop_at_top,
                     const Executor& executor, Image& d);

/// Mean d of texel (i, j) over directions towards the light, above the horizon: each is marched to
/// the border of the map, one bilinear sample per texel of the way, whole samples counted.
[[nodiscard]] float march_sky_per_texel(const Solid& solid, std::span<const Vec3> directions,
                                        double depth, int i, int j);

}  // namespace relit::bench
