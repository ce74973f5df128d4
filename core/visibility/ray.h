// The way from a point under the surface to a light: what inside_length() measures along. For
// render/, which makes one per texel and light sample.
#pragma once

#include <cmath>
#include <limits>

#include "core/base/vec.h"

namespace relit {

/// Made by ray_to_point() or ray_along(); coordinates in scene units, finite.
struct Ray {
    Vec3 from;
    Vec3 direction;       ///< unit, towards the light
    double distance = 0;  ///< to the light, >= 0; infinity for a light at infinity
    double end_z = 0;     ///< z of the light itself, not rebuilt from the others: whether a light
                          ///< lies in the ground must not hang on rounding
};

/// `v` without what is too small beside 1 to be meant: sines and cosines leave 1e-16 of a right
/// angle, and a ray that crosses a texel in 1e300 steps never ends.
inline Vec3 without_traces(Vec3 v) {
    const auto kept = [](double c) { return std::abs(c) < 1e-12 ? 0 : c; };
    return {kept(v.x), kept(v.y), kept(v.z)};
}

inline Ray ray_to_point(Vec3 from, Vec3 point) {
    const Vec3 way = point - from;
    return {from, without_traces(normalized(way)), length(way), point.z};
}

/// @param direction  unit
inline Ray ray_along(Vec3 from, Vec3 direction) {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    const Vec3 d = without_traces(direction);
    return {from, d, infinity, d.z == 0 ? from.z : std::copysign(infinity, d.z)};
}

}  // namespace relit
