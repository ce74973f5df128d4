// Surface normals of a height field, for the offset of p', highlights and the normal layer.
// Source: integrated model, section 3; Perumal 2017, 4.3.5.1.
#pragma once

#include "core/base/vec.h"
#include "core/field/height_field.h"

namespace relit {

/// Slopes of z = relief * h at texel (i, j): dz/dx and dz/dy.
struct Slopes {
    double x = 0;
    double y = 0;
};

/// Central differences over two texels; one-sided at the border and beside masked texels, 0 where
/// neither neighbour counts.
[[nodiscard]] Slopes slopes_at(const HeightField& field, double relief, int i, int j);

/// Unit normal normalize(-scale dz/dx, -scale dz/dy, 1).
/// @param scale  multiplies the slopes: 1 = the true normal, `normalScale` for highlights and the
///               normal layer
[[nodiscard]] inline Vec3 normal_from(Slopes slopes, double scale = 1) {
    return normalized({-scale * slopes.x, -scale * slopes.y, 1});
}

}  // namespace relit
