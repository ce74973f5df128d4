// Grids of nodes over a height map, each with half as many as the one before along one axis, for sums
// level by level (level_sum.h).
#pragma once

#include <cstddef>
#include <vector>

#include "core/image/large_pages.h"
#include "core/transport/kernels/levels.h"

namespace relit {

/// Nodes (i, j) of a grid, -margin <= i < width + margin, likewise j, with their heights. Around them
/// lies what loops read beyond.
struct LevelGrid {
    int width = 0, height = 0;
    int margin = 0;  ///< nodes around the map that cubics of coarser grids reach
    int pad = 0;     ///< columns and rows around the map, at least the margin
    long pitch = 0;
    Texels z;                       ///< texels; of nodes where nothing is, what is near
    std::vector<unsigned> present;  ///< texels of the map that a node stands for, [height][width]

    LevelGrid(int w, int h, int margin_nodes, int pad_nodes);

    /// Of node (i, j) in a plane.
    [[nodiscard]] long at(int i, int j) const { return (j + pad) * pitch + i + pad; }
    /// Floats of a plane.
    [[nodiscard]] std::size_t plane() const {
        return std::size_t(pitch) * (height + 2 * pad) + kernels::level_overrun;
    }
    /// Repeats the border's heights around the map.
    void extend();
};

/// Half as many columns or rows as `fine`: nodes lie between two of it, at their mean height.
[[nodiscard]] LevelGrid halved(const LevelGrid& fine, bool rows, int margin, int pad);

/// Gives nodes of `fine` where nothing is the height of the one of `coarse` that stands for them.
void fill_gaps(LevelGrid& fine, const LevelGrid& coarse, bool rows);

}  // namespace relit
