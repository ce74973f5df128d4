#include "core/field/solid.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace relit {
namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();

// Row of the map that is repeated at row v of the grid.
int map_row(int v, int height) { return std::clamp(v - 1, 0, height - 1); }

GridHeights bordered_z(const Image& heights, double relief) {
    GridHeights z(heights.width + 2, heights.height + 2);
    for (int v = 0; v < z.height; ++v) {
        const std::span<const float> from = heights.row(map_row(v, heights.height));
        float* const to = z.row(v);
        for (int i = 0; i < heights.width; ++i) to[i + 1] = float(relief * from[i]);
        to[0] = to[1];
        to[heights.width + 1] = to[heights.width];
        z.repeat_ends(v);
    }
    return z;
}

std::vector<std::uint8_t> cell_cover(const HeightField& field) {
    if (field.alpha.empty()) return {};
    const int width = field.width(), height = field.height();
    const auto fill_row = [&](int v, std::vector<std::uint8_t>& solid) {
        for (int i = 0; i < width; ++i) solid[i + 1] = field.is_solid(i, map_row(v, height));
        solid.front() = solid[1];
        solid.back() = solid[width];
    };
    std::vector<std::uint8_t> upper(width + 2), lower(width + 2);
    std::vector<std::uint8_t> cover(std::size_t(width + 1) * (height + 1));
    fill_row(0, upper);
    for (int v = 0; v <= height; ++v) {
        fill_row(v + 1, lower);
        std::uint8_t* cells = &cover[std::size_t(v) * (width + 1)];
        for (int u = 0; u <= width; ++u)
            cells[u] =
                std::uint8_t(upper[u] | upper[u + 1] << 1 | lower[u] << 2 | lower[u + 1] << 3);
        upper.swap(lower);
    }
    return cover;
}

// Lowest and highest grid point of each column between two rows, both counted.
struct ColumnRange {
    std::vector<float> low, high;

    ColumnRange(const GridHeights& z, int first, int last) {
        low.assign(z.row(first), z.row(first) + z.width);
        high = low;
        for (int v = first + 1; v <= last; ++v) {
            const float* row = z.row(v);
            for (int u = 0; u < z.width; ++u) low[u] = row[u] < low[u] ? row[u] : low[u];
            for (int u = 0; u < z.width; ++u) high[u] = row[u] > high[u] ? row[u] : high[u];
        }
    }
};

// Top and bottom of the cells i0 <= i < i1, j0 <= j < j1 under a mask.
Block masked_block(const Solid& solid, int i0, int i1, int j0, int j1) {
    Block block{-infinity, infinity};
    for (int j = j0; j < j1; ++j)
        for (int i = i0; i < i1; ++i) {
            const unsigned cover = solid.cover[std::size_t(j) * (solid.width + 1) + i];
            const float* upper = solid.z.row(j) + i;
            const float* lower = solid.z.row(j + 1) + i;
            const auto [lo, hi] = std::minmax({upper[0], upper[1], lower[0], lower[1]});
            if (cover != 0) block.top = std::max(block.top, hi);
            block.bottom = std::min(block.bottom, cover == 15 ? lo : -infinity);
        }
    return block;
}

void fill_blocks(Solid& solid) {
    constexpr int size = Solid::block_size;
    const int cells_across = solid.width + 1, cells_down = solid.height + 1;
    solid.blocks_across = (cells_across + size - 1) / size;
    for (int j = 0; j < cells_down; j += size) {
        const int j1 = std::min(j + size, cells_down);
        const ColumnRange range(solid.z, j, j1);
        for (int i = 0; i < cells_across; i += size) {
            const int i1 = std::min(i + size, cells_across);
            const float* low = &range.low[i];
            const float* high = &range.high[i];
            solid.blocks.push_back(solid.cover.empty()
                                       ? Block{*std::max_element(high, high + (i1 - i) + 1),
                                               *std::min_element(low, low + (i1 - i) + 1)}
                                       : masked_block(solid, i, i1, j, j1));
        }
        solid.top_z =
            std::max<double>(solid.top_z, *std::max_element(range.high.begin(), range.high.end()));
    }
}

}  // namespace

GridHeights::GridHeights(int points_across, int rows) : width(points_across), height(rows) {
    constexpr int line = 16;  // floats of a line of the cache
    pitch = (margin + width + 2 * window + line - 1) / line * line;
    // An odd number of lines: columns of a power of two would share the same few sets.
    if (pitch / line % 2 == 0) pitch += line;
    values.resize(std::size_t(pitch) * rows);
}

void GridHeights::repeat_ends(int v) {
    float* const points = row(v);
    std::fill(points - margin, points, points[0]);
    std::fill(points + width, points - margin + pitch, points[width - 1]);
}

Solid make_solid(const HeightField& field, double relief, Base base, double depth) {
    Solid solid;
    solid.width = field.width();
    solid.height = field.height();
    solid.z = bordered_z(field.heights, relief);
    solid.top_z = solid.z.at(0, 0);
    solid.cover = cell_cover(field);
    fill_blocks(solid);
    solid.endless_ground = base.kind == Base::Kind::none;
    if (base.kind == Base::Kind::automatic) solid.floor_z = -depth;
    if (base.kind == Base::Kind::level) solid.floor_z = base.level;
    return solid;
}

double surface_z(const Solid& solid, double x, double y) {
    const double u = solid.u_of(x);
    const double v = solid.v_of(y);
    assert(u >= 0 && v >= 0 && u <= solid.width + 1 && v <= solid.height + 1);
    const int i = std::min(int(u), solid.width);
    const int j = std::min(int(v), solid.height);
    const double a = u - i;
    const double b = v - j;
    const float* upper = &solid.z.row(j)[i];
    const float* lower = &solid.z.row(j + 1)[i];
    return (1 - b) * ((1 - a) * upper[0] + a * upper[1]) + b * ((1 - a) * lower[0] + a * lower[1]);
}

bool is_inside(const Solid& solid, Vec3 p) {
    if (solid.endless_ground && p.z < 0) return true;
    if (p.z < solid.floor_z || p.x < 0 || p.x > 1 || p.y < 0 || p.y > solid.y_size()) return false;
    if (p.z >= surface_z(solid, p.x, p.y)) return false;
    if (solid.cover.empty()) return true;
    // Column and row of the nearest texel, via the upper left quarter of the cell to its lower
    // right.
    const int i = std::clamp(int(p.x * solid.width), 0, solid.width - 1);
    const int j = std::clamp(int(solid.height - p.y * solid.width), 0, solid.height - 1);
    return solid.cover[std::size_t(j + 1) * (solid.width + 1) + (i + 1)] & 1;
}

}  // namespace relit
