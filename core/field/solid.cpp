#include "core/field/solid.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace relit {
namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();

Image bordered_z(const Image& heights, double relief) {
    Image z(heights.width + 2, heights.height + 2, 1);
    for (int v = 0; v < z.height; ++v)
        for (int u = 0; u < z.width; ++u) {
            const int i = std::clamp(u - 1, 0, heights.width - 1);
            const int j = std::clamp(v - 1, 0, heights.height - 1);
            z.at(u, v) = float(relief * heights.at(i, j));
        }
    return z;
}

std::vector<std::uint8_t> cell_cover(const HeightField& field) {
    if (field.alpha.empty()) return {};
    const auto solid = [&](int u, int v) {
        return field.is_solid(std::clamp(u - 1, 0, field.width() - 1),
                              std::clamp(v - 1, 0, field.height() - 1));
    };
    std::vector<std::uint8_t> cover;
    cover.reserve(std::size_t(field.width() + 1) * (field.height() + 1));
    for (int v = 0; v <= field.height(); ++v)
        for (int u = 0; u <= field.width(); ++u)
            cover.push_back(std::uint8_t(solid(u, v) | solid(u + 1, v) << 1 | solid(u, v + 1) << 2 |
                                         solid(u + 1, v + 1) << 3));
    return cover;
}

// Top and bottom of the cells i0 <= i < i1, j0 <= j < j1.
Block block_of(const Solid& solid, int i0, int i1, int j0, int j1) {
    Block block{-infinity, infinity};
    for (int j = j0; j < j1; ++j)
        for (int i = i0; i < i1; ++i) {
            const unsigned cover =
                solid.cover.empty() ? 15u : solid.cover[std::size_t(j) * (solid.width + 1) + i];
            const float* upper = &solid.z.row(j)[i];
            const float* lower = &solid.z.row(j + 1)[i];
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
    for (int j = 0; j < cells_down; j += size)
        for (int i = 0; i < cells_across; i += size)
            solid.blocks.push_back(block_of(solid, i, std::min(i + size, cells_across), j,
                                            std::min(j + size, cells_down)));
}

}  // namespace

Solid make_solid(const HeightField& field, double relief, Base base, double depth) {
    Solid solid;
    solid.width = field.width();
    solid.height = field.height();
    solid.z = bordered_z(field.heights, relief);
    solid.cover = cell_cover(field);
    fill_blocks(solid);
    solid.endless_ground = base.kind == Base::Kind::none;
    if (base.kind == Base::Kind::automatic) solid.floor_z = -depth;
    if (base.kind == Base::Kind::level) solid.floor_z = base.level;
    solid.top_z = *std::max_element(solid.z.values.begin(), solid.z.values.end());
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

Vec3 surface_point(const Solid& solid, int i, int j) {
    return {(i + 0.5) / solid.width, (solid.height - 0.5 - j) / solid.width,
            solid.z.at(i + 1, j + 1)};
}

}  // namespace relit
