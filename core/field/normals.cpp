#include "core/field/normals.h"

namespace relit {
namespace {

// Difference quotient between the neighbours at a and b, in texels of height 1, around the centre.
double slope_between(const HeightField& field, const Image& heights, int i, int j, int di, int dj) {
    const auto counts = [&](int x, int y) {
        return x >= 0 && y >= 0 && x < field.width() && y < field.height() && field.is_solid(x, y);
    };
    const bool ahead = counts(i + di, j + dj);
    const bool behind = counts(i - di, j - dj);
    const double h_ahead = ahead ? heights.at(i + di, j + dj) : heights.at(i, j);
    const double h_behind = behind ? heights.at(i - di, j - dj) : heights.at(i, j);
    const int texels = int(ahead) + int(behind);
    return texels == 0 ? 0 : (h_ahead - h_behind) / texels;
}

}  // namespace

Slopes slopes_at_edge(const HeightField& field, const Image& heights, double relief, int i, int j) {
    const double scale = relief * field.width();
    return {scale * slope_between(field, heights, i, j, 1, 0),
            scale * slope_between(field, heights, i, j, 0, -1)};
}

}  // namespace relit
