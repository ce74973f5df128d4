// Grids of nodes over a height map, each with half as many as the one before along one axis, for sums
// level by level (level_sum.h).
#pragma once

#include <cstddef>
#include <stop_token>
#include <vector>

#include "core/base/parallel.h"
#include "core/image/large_pages.h"
#include "core/transport/kernels/levels.h"
#include "core/transport/transport_surface.h"

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

/// Nodes around the map that cubics of the next level reach, whatever the level.
inline constexpr int level_margin = 4;

/// The grids of a map, or of those of its texels that lie within a range of heights.
struct LevelSheet {
    std::vector<LevelGrid> levels;
    std::vector<LevelGrid> between;  ///< level l with its rows halved already

    /// Columns first to last of row j of level l that hold flux, or sums that are asked for.
    struct Columns {
        int first = 1, last = 0;
    };
    [[nodiscard]] Columns active(int l, int j) const {
        const int row = j + levels[l].margin;
        return active_of_rows[l][row];
    }
    std::vector<std::vector<Columns>> active_of_rows;  ///< [level][row from the margin on]
};

/// @param low, high  scene units: of texels with low <= z < high
/// @throws Error cancelled
[[nodiscard]] LevelSheet level_sheet(const TransportSurface& surface, float low, float high,
                                     int levels, int pad, const std::stop_token& stop);

/// Up to `count` heights that the most cliffs of the map cross, weighted by how high these are, in
/// rising order; none where there are no cliffs.
[[nodiscard]] std::vector<float> cliff_heights(const TransportSurface& surface, int count);

/// How much is carried from a grid to the next one, and how much of it farther in height than `reach`.
struct Carried {
    double all = 0, beyond = 0;
};
[[nodiscard]] Carried carried_between(const LevelGrid& fine, const LevelGrid& coarse, bool rows,
                                      double reach, const Executor& executor,
                                      const std::stop_token& stop);

}  // namespace relit
