#include "core/render/fringe.h"

#include <cstdint>
#include <limits>

namespace relit {

NearestSolid::NearestSolid(const HeightField& field)
    : width_(field.width()), height_(field.height()), in_column_(field.heights.texels(), -1) {
    const auto row_at = [&](int i, int j) -> int& {
        return in_column_[std::size_t(j) * width_ + i];
    };
    for (int i = 0; i < width_; ++i) {
        for (int j = 0, above = -1; j < height_; ++j) {
            if (field.is_solid(i, j)) above = j, any_ = true;
            row_at(i, j) = above;
        }
        for (int j = height_ - 1, below = -1; j >= 0; --j) {
            if (field.is_solid(i, j)) below = j;
            int& nearest = row_at(i, j);
            if (below >= 0 && (nearest < 0 || below - j < j - nearest)) nearest = below;
        }
    }
}

std::optional<TexelIndex> NearestSolid::find(int i, int j) const {
    std::optional<TexelIndex> nearest;
    if (!any_) return nearest;
    std::int64_t best = std::numeric_limits<std::int64_t>::max();
    const auto look_at_column = [&](int x) {
        if (x < 0 || x >= width_) return;
        const int row = in_column_[std::size_t(j) * width_ + x];
        const std::int64_t dx = x - i, dy = row - j;
        if (row < 0 || dx * dx + dy * dy >= best) return;
        best = dx * dx + dy * dy;
        nearest = TexelIndex{x, row};
    };
    for (std::int64_t dx = 0; dx < width_ && dx * dx < best; ++dx) {
        look_at_column(i - int(dx));
        if (dx > 0) look_at_column(i + int(dx));
    }
    return nearest;
}

}  // namespace relit
