#include "core/visibility/inside_lengths.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <limits>

#include "core/visibility/inside_length.h"

namespace relit {
namespace {

using kernels::Bounds;

static_assert(GridHeights::margin == kernels::grid_margin &&
              GridHeights::window == kernels::grid_window);
constexpr int block = Solid::block_size;

// A height with the mask in its lowest bit.
float marked(float z, bool is_material) {
    return std::bit_cast<float>((std::bit_cast<std::uint32_t>(z) & ~1u) | unsigned(is_material));
}

bool is_material(const Solid& solid, int u, int v) {
    const int i = std::min(u, solid.width), j = std::min(v, solid.height);
    const unsigned cover = solid.cover[std::size_t(j) * (solid.width + 1) + i];
    return cover >> ((u - i) + 2 * (v - j)) & 1;
}

void merge(Bounds& a, const Bounds& b) {
    a.top = std::max(a.top, b.top);
    a.bottom = std::min(a.bottom, b.bottom);
    a.bend = std::max(a.bend, b.bend);
}

constexpr Bounds nothing{-std::numeric_limits<float>::infinity(),
                         std::numeric_limits<float>::infinity()};

// Raises `most`, per column of cells, to what the surface can bend by on a way through the cells of row
// v: by its parabola in one cell, and by the kink where the next column's begins.
void raise_to_bends(const GridHeights& heights, int v, std::vector<float>& most) {
    const float *upper = heights.row(v), *lower = heights.row(v + 1);
    const auto rise = [](const float* z, int u) { return z[u + 1] - z[u]; };
    for (int u = 0; u < heights.width - 1; ++u) {
        const float above = rise(upper, u), above_next = rise(upper, u + 1);
        const float below = rise(lower, u), below_next = rise(lower, u + 1);
        const float parabola = std::max(std::abs(below - above), std::abs(below_next - above_next));
        const float kink = std::max(std::abs(above_next - above), std::abs(below_next - below));
        most[u] = std::max(most[u], parabola + kink);
    }
}

// Bounds::bend of each block: for t in [0, 1] from row to row, the surface leaves its chord by t (1 - t)
// at most times what it bends by.
std::vector<float> bends_of_blocks(const GridHeights& heights, const Executor& executor) {
    const int columns = heights.width - 1, rows = heights.height - 1;
    const int across = (columns + block - 1) / block, down = (rows + block - 1) / block;
    std::vector<float> bends(std::size_t(across) * down);
    parallel_rows(executor, down, {}, [&](RowRange range) {
        std::vector<float> most(std::size_t(across) * block);
        for (int q = range.begin; q < range.end; ++q) {
            std::ranges::fill(most, 0.0f);
            for (int v = q * block; v < std::min((q + 1) * block, rows); ++v)
                raise_to_bends(heights, v, most);
            for (int p = 0; p < across; ++p) {
                const float* first = &most[std::size_t(p) * block];
                bends[std::size_t(q) * across + p] =
                    0.25f * *std::max_element(first, first + block);
            }
        }
    });
    return bends;
}

struct Marches {
    kernels::March* rays;
    kernels::TileMarch* tile;
};

Marches marches_of(Simd simd) {
    switch (simd) {
#if defined(__x86_64__)
        case Simd::avx512:
            return {kernels::march_avx512, kernels::march_tile_avx512};
        case Simd::avx2:
            return {kernels::march_avx2, kernels::march_tile_avx2};
#endif
        default:
            return {kernels::march_portable, kernels::march_tile_portable};
    }
}

// Where a ray of a tile starts, in scene units.
Vec3 start_of(const Solid& solid, const RayTile& tile, int k) {
    return {(tile.column + 0.5 + tile.right[k]) / solid.width,
            (solid.height - 0.5 - tile.row - tile.down[k]) / solid.width, tile.z[k]};
}

}  // namespace

struct PacketSolid::Copy {
    GridHeights own;  // where it is no other than the solid's: empty
    std::vector<Bounds> near, far;
    kernels::Grid grid;

    Copy(const Solid& solid, bool exchanged, const Executor& executor) {
        if (exchanged || !solid.cover.empty()) {
            own = exchanged ? GridHeights(solid.z.height, solid.z.width)
                            : GridHeights(solid.z.width, solid.z.height);
            fill_heights(solid, exchanged, executor);
        }
        const GridHeights& heights = own.values.empty() ? solid.z : own;
        grid.columns = heights.width - 1;
        grid.rows = heights.height - 1;
        grid.pitch = heights.pitch;
        grid.z = heights.row(0);
        grid.rounding = 1e-6f * (std::abs(float(solid.top_z)) + std::abs(float(solid.floor_z)));
        fill_bounds(solid, exchanged, bends_of_blocks(heights, executor));
        grid.near = near.data();
        grid.far = far.data();
    }

    void fill_heights(const Solid& solid, bool exchanged, const Executor& executor) {
        constexpr int band = 16;  // rows at a time, in squares: columns are read in runs
        const int points_down = own.height, points_across = own.width;
        parallel_rows(executor, (points_down + band - 1) / band, {}, [&](RowRange bands) {
            const int first = bands.begin * band, last = std::min(bands.end * band, points_down);
            for (int u0 = 0; exchanged && u0 < points_across; u0 += band)
                for (int v = first; v < last; ++v)
                    for (int u = u0; u < std::min(u0 + band, points_across); ++u)
                        own.at(u, v) = solid.z.at(v, u);
            for (int v = first; v < last; ++v) {
                if (!exchanged) std::copy_n(solid.z.row(v), points_across, own.row(v));
                if (!solid.cover.empty())
                    for (int u = 0; u < points_across; ++u)
                        own.at(u, v) = marked(own.at(u, v), exchanged ? is_material(solid, v, u)
                                                                      : is_material(solid, u, v));
                own.repeat_ends(v);
            }
        });
    }

    void fill_bounds(const Solid& solid, bool exchanged, const std::vector<float>& bends) {
        // Crossings are computed in float: what is this near to a bound may lie beyond it.
        const float slack = grid.rounding;
        const int across = grid.columns / block + 1 - (grid.columns % block == 0);
        const int down = grid.rows / block + 1 - (grid.rows % block == 0);
        const auto bounds = [&](int p, int q) {
            const Block& b = exchanged ? solid.blocks[std::size_t(p) * solid.blocks_across + q]
                                       : solid.blocks[std::size_t(q) * solid.blocks_across + p];
            return Bounds{b.top + slack, b.bottom - slack, bends[std::size_t(q) * across + p]};
        };
        const auto wide = [&](int p, int q, int p_size, int q_size) {
            Bounds sum = nothing;
            for (int y = q; y < std::min(q + q_size, down); ++y)
                for (int x = p; x < std::min(p + p_size, across); ++x) merge(sum, bounds(x, y));
            return sum;
        };
        grid.bounds_across = across;
        for (int q = 0; q < down; ++q)
            for (int p = 0; p < across; ++p) near.push_back(wide(p, q, 4, 1));
        for (int q = 0; q < down; q += 4)
            for (int p = 0; p < across; ++p) far.push_back(wide(p, q, 8, 4));
    }

    [[nodiscard]] std::uint64_t bytes() const {
        return own.values.size() * sizeof(float) + (near.size() + far.size()) * sizeof(Bounds);
    }
};

PacketSolid::PacketSolid(const Solid& solid, const Executor& executor, Simd simd)
    : solid_(solid),
      by_rows_(std::make_unique<const Copy>(solid, false, executor)),
      by_columns_(std::make_unique<const Copy>(solid, true, executor)),
      march_(marches_of(simd).rays),
      march_tile_(marches_of(simd).tile) {
    scenery_.by_rows = by_rows_->grid;
    scenery_.by_columns = by_columns_->grid;
    scenery_.masked = !solid.cover.empty();
    scenery_.endless_ground = solid.endless_ground;
    scenery_.floor_z = solid.floor_z;
    scenery_.top_z = solid.top_z;
    scenery_.width = solid.width;
    scenery_.height = solid.height;
}

PacketSolid::~PacketSolid() = default;

std::uint64_t PacketSolid::bytes() const { return by_rows_->bytes() + by_columns_->bytes(); }

kernels::Scenery PacketSolid::lit_by(const RayTarget& target) const {
    kernels::Scenery scenery = scenery_;
    scenery.light[0] = target.at.x;
    scenery.light[1] = target.at.y;
    scenery.light[2] = target.at.z;
    scenery.at_infinity = target.at_infinity;
    return scenery;
}

void PacketSolid::inside_lengths(const RayTarget& target, std::span<const Vec3> from,
                                 std::span<double> r) const noexcept {
    assert(from.size() == r.size());
    const kernels::Scenery scenery = lit_by(target);
    for (std::size_t k = 0; k < from.size(); k += kernels::max_rays) {
        const int count = int(std::min<std::size_t>(kernels::max_rays, from.size() - k));
        march_(scenery, &from[k].x, count, &r[k]);
    }
    for (std::size_t k = 0; k < from.size(); ++k)
        if (std::isnan(r[k])) r[k] = inside_length(solid_, ray_to(target, from[k]));
}

void PacketSolid::inside_lengths(const RayTarget& target, const RayTile& tile,
                                 std::span<float> r) const noexcept {
    assert(tile.count <= RayTile::max_rays && r.size() >= std::size_t(tile.count));
    const kernels::Tile rays{tile.column + 1,   tile.row + 1,     tile.count,
                             tile.right.data(), tile.down.data(), tile.z.data()};
    march_tile_(lit_by(target), rays, r.data());
    int left = 0;
    for (int k = 0; k < tile.count; ++k) left += std::isnan(r[k]) ? 1 : 0;
    if (left > 0) fill_left(target, tile, r);
}

// Rays that are not for tiles: those of `r` that are not a number.
void PacketSolid::fill_left(const RayTarget& target, const RayTile& tile,
                            std::span<float> r) const noexcept {
    std::array<Vec3, RayTile::max_rays> from;
    std::array<double, RayTile::max_rays> lengths;
    std::array<int, RayTile::max_rays> left;
    int count = 0;
    for (int k = 0; k < tile.count; ++k)
        if (std::isnan(r[k])) {
            from[count] = start_of(solid_, tile, k);
            left[count++] = k;
        }
    inside_lengths(target, {from.data(), std::size_t(count)}, {lengths.data(), std::size_t(count)});
    for (int k = 0; k < count; ++k) r[left[k]] = float(lengths[k]);
}

}  // namespace relit
