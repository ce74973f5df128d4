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

/// As slopes_at(), beside borders and masks as well.
[[nodiscard]] Slopes slopes_at_edge(const HeightField& field, const Image& heights, double relief,
                                    int i, int j);

/// Central differences over two texels; one-sided at the border and beside masked texels, 0 where
/// neither neighbour counts.
/// @param heights  of `field`, or its bump map
[[nodiscard]] inline Slopes slopes_at(const HeightField& field, const Image& heights, double relief,
                                      int i, int j) {
    const int width = heights.width;
    const bool is_inner = i > 0 && j > 0 && i + 1 < width && j + 1 < heights.height;
    if (!is_inner ||
        (!field.alpha.empty() && !(field.is_solid(i - 1, j) && field.is_solid(i + 1, j) &&
                                   field.is_solid(i, j - 1) && field.is_solid(i, j + 1))))
        return slopes_at_edge(field, heights, relief, i, j);
    const double scale = relief * width;  // a texel is 1/width wide
    const float* h = heights.values.data() + std::size_t(j) * width + i;
    const double above = h[-width], below = h[width];
    return {scale * ((double(h[1]) - h[-1]) / 2), scale * ((above - below) / 2)};
}
[[nodiscard]] inline Slopes slopes_at(const HeightField& field, double relief, int i, int j) {
    return slopes_at(field, field.heights, relief, i, j);
}

/// Unit normal normalize(-scale dz/dx, -scale dz/dy, 1).
/// @param scale  multiplies the slopes: 1 = the true normal, `normalScale` for highlights and the
///               normal layer
[[nodiscard]] inline Vec3 normal_from(Slopes slopes, double scale = 1) {
    return normalized({-scale * slopes.x, -scale * slopes.y, 1});
}

}  // namespace relit
