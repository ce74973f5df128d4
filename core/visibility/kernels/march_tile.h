// Rays that start near the texels of a small square of the map. Neighbours in a row, or in a column where
// rays go by columns, share a packet, and some rows or columns a bundle.
#pragma once

#include "core/visibility/kernels/march_inner.h"

namespace relit::kernels {
namespace {

// Columns for rows of a square, and back.
RELIT_INLINE void transpose(const float* from, float* to) {
    for (int i = 0; i < tile_side; ++i)
        for (int k = 0; k < tile_side; ++k) to[i * tile_side + k] = from[k * tile_side + i];
}

// Where the packets of a bundle are among the rays: so many from one to the next.
struct Places {
    int first, stride;
    RELIT_INLINE int operator[](int g) const { return first + g * stride; }
};

// The bundle that begins `k` rays after the first. In a square its packets lie under each other, and
// take no more columns than one.
RELIT_INLINE Places places_of(int k, bool is_square) {
    if (!is_square) return {k, lanes};
    constexpr int bundles_across = tile_side / lanes;
    const int bundle = k / bundle_rays, down = bundle / bundles_across;
    return {down * bundle_packets * tile_side + bundle % bundles_across * lanes, tile_side};
}

// r of the rays of a bundle, each to its own end: into their places of `r`.
template <bool masked>
RELIT_INLINE void march_outer(const Scenery& s, const TileWay& way, const TileRays* rays,
                              int packets, Bundle& b, Places at, float* r) {
    for (int g = 0; g < packets; ++g) {
        if (!any(rays[g].taken)) continue;
        const TileEnds ends = end_rays(s, way, rays[g], b.packets[g]);
        march_alone<masked>(b, g);
        const Floats steps = (b.inside(g) + rays[g].ground) + ends.elsewhere;
        const Floats known =
            select(ends.left, broadcast(__builtin_nanf("")), steps * rays[g].step_length);
        store(r + at[g], select(rays[g].taken, known, load(r + at[g])));
    }
}

// r of the rays that go this way, into their places of `r`. Never inlined: one copy of the march stays
// in the processor's cache of instructions.
// @param count  of rays, a multiple of lanes; max_rays: those of the whole square
template <bool masked>
__attribute__((noinline)) void march_way(const Scenery& s, const TileWay& way, int count,
                                         const float* along, const float* across, const float* z,
                                         float* r) {
    Bundle b;
    b.grid = way.grid;
    b.sign = way.backwards ? -1 : 1;
    for (int k = 0; k < count; k += bundle_rays) {
        const int left = (count - k) / lanes;
        const int packets = left < bundle_packets ? left : bundle_packets;
        const Places at = places_of(k, count == max_rays);
        TileRays rays[bundle_packets];
        for (int g = 0; g < packets; ++g)
            rays[g] = tile_rays(way, load(along + at[g]), load(across + at[g]), load(z + at[g]),
                                masked && s.endless_ground, b.packets[g]);
        b.clear();
        const bool is_full = packets == bundle_packets;
        const Hull hull = is_full ? hull_of(s, way, rays, b) : Hull{};
        if (is_full && is_inner(s, way, rays, b, hull)) {
            march_inner<masked>(b, way, hull);
            for (int g = 0; g < bundle_packets; ++g)
                store(r + at[g], (b.inside(g) + rays[g].ground) * rays[g].step_length);
        } else {
            march_outer<masked>(s, way, rays, packets, b, at, r);
        }
    }
}

// The ways that `count` rays of the tile take: bit `kind` of each, rows down, rows up, columns down and
// columns up.
RELIT_INLINE unsigned ways_of(const Scenery& s, const Tile& tile, int count, const float* right,
                              const float* down) {
    const TileLight light = tile_way(s, tile, false, false).light;
    const Floats zero = broadcast(0.0f);
    unsigned ways = 0;
    for (int k = 0; k < count; k += lanes) {
        const auto to_light = [&](float place, const float* from) {
            return light.at_infinity ? broadcast(place) : broadcast(place) - load(from + k);
        };
        const Floats x = to_light(light.across, right), y = to_light(light.along, down);
        const Mask by_columns = magnitude(y) < magnitude(x);
        ways |= any(~by_columns & ~(y < zero)) ? 1u : 0;
        ways |= any(~by_columns & (y < zero)) ? 2u : 0;
        ways |= any(by_columns & ~(x < zero)) ? 4u : 0;
        ways |= any(by_columns & (x < zero)) ? 8u : 0;
        if (light.at_infinity) break;
    }
    return ways;
}

// Asks for the heights under the next square to the right while this one is marched: rays of
// neighbouring squares share most of what they read, but for these.
RELIT_INLINE void prefetch_next(const Grid& grid, int column, int row, bool by_columns) {
    const int first_row = by_columns ? row + tile_side : row;
    const int first_column = by_columns ? column : column + tile_side;
    for (int n = 0; n < tile_side; ++n) {
        const int next = first_row + n < grid.rows ? first_row + n : grid.rows;
        const float* z = grid.z + long(next) * grid.pitch + first_column;
        __builtin_prefetch(z);
        __builtin_prefetch(z + tile_side);
    }
}

// r of a whole square of rays.
template <bool masked>
void march_square(const Scenery& s, const Tile& tile, float* r) {
    const unsigned ways = ways_of(s, tile, max_rays, tile.right, tile.down);
    if (ways & 3) prefetch_next(s.by_rows, tile.column, tile.row, false);
    if (ways >> 2) prefetch_next(s.by_columns, tile.row, tile.column, true);
    for (int kind = 0; kind < 2; ++kind)
        if (ways >> kind & 1)
            march_way<masked>(s, tile_way(s, tile, false, kind == 1), max_rays, tile.down,
                              tile.right, tile.z, r);
    if (ways >> 2 == 0) return;
    alignas(64) float along[max_rays], across[max_rays], z[max_rays], turned[max_rays];
    transpose(tile.right, along);
    transpose(tile.down, across);
    transpose(tile.z, z);
    if (ways & 3) transpose(r, turned);
    for (int kind = 2; kind < 4; ++kind)
        if (ways >> kind & 1)
            march_way<masked>(s, tile_way(s, tile, true, kind == 3), max_rays, along, across, z,
                              turned);
    transpose(turned, r);
}

// r of any rays near the square.
template <bool masked>
void march_some(const Scenery& s, const Tile& tile, float* r) {
    alignas(64) float right[max_rays], down[max_rays], z[max_rays], found[max_rays];
    const int count = (tile.count + lanes - 1) / lanes * lanes;
    for (int k = 0; k < count; ++k) {
        const int at = k < tile.count ? k : tile.count - 1;  // fills the last packet up
        right[k] = tile.right[at];
        down[k] = tile.down[at];
        z[k] = tile.z[at];
    }
    const unsigned ways = ways_of(s, tile, count, right, down);
    for (int kind = 0; kind < 4; ++kind) {
        if ((ways >> kind & 1) == 0) continue;
        const bool by_columns = kind >= 2;
        march_way<masked>(s, tile_way(s, tile, by_columns, kind % 2 == 1), count,
                          by_columns ? right : down, by_columns ? down : right, z, found);
    }
    for (int k = 0; k < tile.count; ++k) r[k] = found[k];
}

template <bool masked>
void march_rays_of(const Scenery& s, const Tile& tile, float* r) {
    if (tile.count == max_rays) march_square<masked>(s, tile, r);
    else march_some<masked>(s, tile, r);
}

void march_tile(const Scenery& s, const Tile& tile, float* r) {
    // Level and from below the way may end in the ground, or at the floor.
    const double bottom = s.endless_ground ? 0 : s.floor_z;
    const bool is_over = s.at_infinity ? s.light[2] > 1e-12 : s.light[2] >= bottom;
    const double far = s.at_infinity ? 0
                                     : __builtin_fabs(s.light[0]) + __builtin_fabs(s.light[1]) +
                                           __builtin_fabs(s.light[2]);
    if (!is_over || !(far < 1e9)) {
        for (int k = 0; k < tile.count; ++k) r[k] = __builtin_nanf("");
        return;
    }
    if (s.masked) march_rays_of<true>(s, tile, r);
    else march_rays_of<false>(s, tile, r);
}

}  // namespace
}  // namespace relit::kernels
