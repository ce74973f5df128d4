// Rays that start near the texels of a small square of the map, prepared in float: positions count from
// the square, so that floats are as exact as the heights are. Neighbours in a row, or in a column where
// rays go by columns, share a packet, and some rows or columns a bundle.
#pragma once

#include "core/visibility/kernels/steps.h"

namespace relit::kernels {
namespace {

// The light of a tile as one of the grids sees it: texels along its rows' order and across, from the
// tile's grid point.
struct TileLight {
    float along, across, z;  // place, or direction
    bool at_infinity;
    float texel;        // width of one in scene units
    float slide, rise;  // per step, of a light at infinity
};

// Which way a packet's rays go through a grid, and what of it lies around the tile.
struct TileWay {
    const Grid* grid;
    bool by_columns;
    bool backwards;
    TileLight light;
    float first_row, last_row;        // where the map begins and ends along the way, from the tile
    float first_column, last_column;  // and across it
    int row, column;                  // of the grid: the tile's grid point
};

RELIT_INLINE TileWay tile_way(const Scenery& s, const Tile& tile, bool by_columns, bool backwards) {
    const double width = s.width;
    const double right =
        s.at_infinity ? width * s.light[0] : s.light[0] * width + 0.5 - tile.column;
    const double down =
        s.at_infinity ? -width * s.light[1] : (s.height + 0.5) - s.light[1] * width - tile.row;
    TileWay way;
    way.grid = by_columns ? &s.by_columns : &s.by_rows;
    way.by_columns = by_columns;
    way.backwards = backwards;
    way.light = {float(by_columns ? right : down), float(by_columns ? down : right),
                 float(s.light[2]), s.at_infinity, float(1 / width)};
    const float steps = way.light.along < 0 ? -way.light.along : way.light.along;
    const float per_step = 1 / (steps > 1e-6f ? steps : 1e-6f);
    way.light.slide = way.light.across * per_step;
    way.light.rise = way.light.z * per_step;
    way.row = by_columns ? tile.column : tile.row;
    way.column = by_columns ? tile.row : tile.column;
    way.first_row = 0.5f - float(way.row);
    way.last_row = float(way.grid->rows) - 0.5f - float(way.row);
    way.first_column = 0.5f - float(way.column);
    way.last_column = float(way.grid->columns) - 0.5f - float(way.column);
    return way;
}

// What is known of the rays of a packet that go one way besides the packet.
struct TileRays {
    Floats along, across;  // where they start, from the tile's grid point
    Mask taken;            // those that go this way
    Floats distance;       // steps to the light
    Floats ground;         // steps in the ground before they start
    Floats step_length;    // scene units
};

// Fills in `p` what is the same wherever its rays end.
// @param masked_ground  there is a mask over endless ground: rays start where they leave the ground,
//                       since what is masked above it is none of it
RELIT_INLINE TileRays tile_rays(const TileWay& way, Floats along, Floats across, Floats z,
                                bool masked_ground, Packet& p) {
    const Floats one = broadcast(1.0f), zero = broadcast(0.0f);
    const TileLight& light = way.light;
    const auto to_light = [&](float place, Floats from) {
        return light.at_infinity ? broadcast(place) : broadcast(place) - from;
    };
    TileRays rays;
    rays.along = along;
    rays.across = across;
    const Floats way_along = to_light(light.along, along);
    const Floats way_across = to_light(light.across, across), way_z = to_light(light.z, z);
    const Floats longer = magnitude(way.by_columns ? way_across : way_along);
    const Mask is_by_columns =
        way.by_columns ? longer < magnitude(way_along) : longer < magnitude(way_across);
    const Mask is_backwards = way_along < zero;
    rays.taken = (way.backwards ? is_backwards : ~is_backwards) &
                 (way.by_columns ? is_by_columns : ~is_by_columns);

    if (light.at_infinity) {
        rays.distance = broadcast(1e30f);
        p.slide = broadcast(light.slide);
        p.rise = broadcast(light.rise);
    } else {
        // Straight up is all but straight: some row has to be the next.
        rays.distance = max(magnitude(way_along), broadcast(1e-6f));
        const Floats per_step = one / rays.distance;
        p.slide = way_across * per_step;
        p.rise = way_z * per_step;
    }
    const Floats sign = broadcast(way.backwards ? -1.0f : 1.0f);
    rays.ground = zero;
    if (masked_ground && any(z < zero)) {
        rays.ground = select(z < zero, (zero - z) / p.rise, zero);
        rays.along = along + sign * rays.ground;
        rays.across = across + p.slide * rays.ground;
        rays.distance = rays.distance - rays.ground;
        z = max(z, zero);
    }
    const Floats begins = sign * rays.along, row = floor(begins);
    p.begin = begins - row;
    p.row = broadcast(way.row) + to_ints(sign * row);
    p.column = broadcast(way.column);
    p.x = rays.across - p.begin * p.slide;
    p.z = z;
    const Floats texel = broadcast(light.texel);
    rays.step_length = square_root((one + p.slide * p.slide) * (texel * texel) + p.rise * p.rise);
    return rays;
}

// Where the rays of a packet end, one by one: in last and end of the packet.
struct TileEnds {
    Mask left;         // rays that are not for tiles
    Floats elsewhere;  // steps in the ground beside the map
};

RELIT_INLINE TileEnds end_rays(const Scenery& s, const TileWay& way, const TileRays& rays,
                               Packet& p) {
    const Floats zero = broadcast(0.0f), one = broadcast(1.0f), endless = broadcast(1e30f);
    // Steps from row 0 to where the way leaves the map, to the light, and over everything.
    const Floats row = broadcast(way.backwards ? -1.0f : 1.0f) * rays.along - p.begin;
    const Floats border = broadcast(way.backwards ? -way.first_row : way.last_row);
    const Floats inverse_slide = one / p.slide;
    const Floats beside = (broadcast(way.last_column) - p.x) * inverse_slide;
    const Floats before = (broadcast(way.first_column) - p.x) * inverse_slide;
    const Floats leaves = min(border - row, min(max(beside, before), endless));
    const Floats reaches = way.light.at_infinity ? endless : rays.distance + p.begin;
    const Floats inverse_rise = one / p.rise;
    const Floats to_top = (broadcast(float(s.top_z)) - p.z) * inverse_rise + p.begin;
    const Floats over_top = select(zero < p.rise, to_top, endless);
    const Floats end = min(min(leaves, reaches), max(one, ceil(over_top)));
    p.last = max(zero, ceil(end) - one);
    p.end = select(zero < p.last, end - p.last, end - p.begin);

    TileEnds ends;
    ends.elsewhere = zero;
    if (s.endless_ground && any(p.z < zero)) {
        const Floats out_of_ground = (zero - p.z) * inverse_rise + p.begin;
        ends.elsewhere = select(p.z < zero, max(zero, out_of_ground - leaves), zero);
    }
    const auto between = [](float low, Floats a, float high) {
        return (broadcast(low) <= a) & (a <= broadcast(high));
    };
    const Mask starts_on_map = between(way.first_row, rays.along, way.last_row) &
                               between(way.first_column, rays.across, way.last_column);
    const Mask over_floor =
        s.endless_ground ? all_lanes : broadcast(float(s.floor_z) - 1e-7f) <= p.z;
    ends.left = ~(starts_on_map & over_floor);
    p.last = select(rays.taken & ~ends.left, p.last, broadcast(-1.0f));
    return ends;
}

// What bounds all rays of a bundle together, so many rows from its first one: between low and
// high + rows * (slope low and high).
struct Range {
    float low, high, slope_low, slope_high;
    [[nodiscard]] RELIT_INLINE float least(float rows) const { return low + rows * slope_low; }
    [[nodiscard]] RELIT_INLINE float most(float rows) const { return high + rows * slope_high; }
};
struct Hull {
    Range x, z;
    float distance;  // at least, to the light
    float begun;     // rows after which all rays have begun
    float lowest_start;
    int rows;  // until all rays are over everything, or beyond what ints hold
};

// Bounds of (target - a) / b for a and b between bounds, b > 0.
RELIT_INLINE void bound_slope(float target, float low, float high, float nearest, float farthest,
                              Range& range) {
    const float most = target - low, least = target - high;
    range.slope_high = most * (1 / (most > 0 ? nearest : farthest));
    range.slope_low = least * (1 / (least > 0 ? farthest : nearest));
}

template <class Of>
RELIT_INLINE float lowest_of_packets(const Of& of) {
    Floats least = of(0);
    for (int g = 1; g < bundle_packets; ++g) least = min(least, of(g));
    return lowest(least);
}
template <class Of>
RELIT_INLINE float highest_of_packets(const Of& of) {
    Floats most = of(0);
    for (int g = 1; g < bundle_packets; ++g) most = max(most, of(g));
    return highest(most);
}

// Fills in the bundle's first row too, and what its packets lag behind it.
RELIT_INLINE Hull hull_of(const Scenery& s, const TileWay& way, const TileRays* rays, Bundle& b) {
    const auto across = [&](int g) RELIT_INLINE_LAMBDA { return rays[g].across; };
    const auto height = [&](int g) RELIT_INLINE_LAMBDA { return b.packets[g].z; };
    const Floats sign = broadcast(float(b.sign));
    const auto row = [&](int g) RELIT_INLINE_LAMBDA { return sign * to_floats(b.packets[g].row); };
    const float across_low = lowest_of_packets(across), across_high = highest_of_packets(across);
    const float first_row = lowest_of_packets(row);
    for (int g = 0; g < bundle_packets; ++g) b.packets[g].lag = row(g) - broadcast(first_row);
    const float to_start = highest_of_packets(
        [&](int g) RELIT_INLINE_LAMBDA { return b.packets[g].lag + b.packets[g].begin; });
    b.first_row = int(first_row);
    Hull hull;
    hull.begun = float(int(to_start)) < to_start ? float(int(to_start)) + 1 : to_start;
    hull.z.low = lowest_of_packets(height);
    hull.z.high = highest_of_packets(height);
    const TileLight& light = way.light;
    if (light.at_infinity) {
        hull.distance = 1e9f;
        hull.x.slope_low = hull.x.slope_high = light.slide;
        hull.z.slope_low = hull.z.slope_high = light.rise;
    } else {
        const float tile_row = first_row - float(b.sign * way.row);
        const float farthest = float(b.sign) * light.along - tile_row;
        hull.distance = farthest - to_start;
        // The starts' own rounding.
        const float nearest = hull.distance * 0.999999f, beyond = farthest * 1.000001f;
        bound_slope(light.across, across_low, across_high, nearest, beyond, hull.x);
        bound_slope(light.z, hull.z.low, hull.z.high, nearest, beyond, hull.z);
    }
    // Back from the starts to the first row.
    hull.x.low = across_low - (hull.x.slope_high > 0 ? to_start * hull.x.slope_high : 0);
    hull.x.high = across_high - (hull.x.slope_low < 0 ? to_start * hull.x.slope_low : 0);
    hull.lowest_start = hull.z.low;
    hull.z.low -= to_start * hull.z.slope_high;
    const float rows = (float(s.top_z) - hull.z.low) / hull.z.slope_low;
    hull.rows = hull.z.slope_low > 0 && rows < 1e6f ? int(rows) + 1 : 1 << 30;
    return hull;
}

// Whether no ray of the bundle ends before it is over everything, and all begin on the map: then
// none needs an end of its own. Steep rays are left to others: their hull is all rounding.
RELIT_INLINE bool is_inner(const Scenery& s, const TileWay& way, const TileRays* rays,
                           const Bundle& b, const Hull& hull) {
    Mask taken = rays[0].taken;
    for (int g = 1; g < bundle_packets; ++g) taken = taken & rays[g].taken;
    if (!all(taken) || hull.rows >= 1 << 30 || hull.z.slope_high > 0.5f) return false;
    const int first = b.sign * b.first_row;  // rows of cells 1 to rows - 2 are whole
    const int last = first + b.sign * hull.rows;
    const int low = first < last ? first : last, high = first < last ? last : first;
    if (low < 1 || high > way.grid->rows - 1) return false;
    const float rows = float(hull.rows), inside = 0.01f;
    if (hull.x.least(0) < way.first_column + inside || hull.x.most(0) > way.last_column - inside ||
        hull.x.least(rows) < way.first_column + inside ||
        hull.x.most(rows) > way.last_column - inside)
        return false;
    if (hull.distance <= rows || hull.distance < 1) return false;
    return s.endless_ground || hull.lowest_start >= float(s.floor_z) - 1e-7f;
}

// Columns of cells that rays touch.
struct Columns {
    int left, right;
};

RELIT_INLINE Columns columns_of(const Hull& hull, float first_column, int done, int steps) {
    const float a = float(done), b = float(done + steps), slack = 0.01f;
    const float least = hull.x.least(a) < hull.x.least(b) ? hull.x.least(a) : hull.x.least(b);
    const float most = hull.x.most(a) > hull.x.most(b) ? hull.x.most(a) : hull.x.most(b);
    return {int(least - first_column + 0.5f - slack), int(most - first_column + 0.5f + slack)};
}

// Marches a bundle of which no ray ends on the way.
template <bool masked>
RELIT_INLINE void march_inner(Bundle& b, const TileWay& way, const Hull& hull) {
    const Grid& grid = *b.grid;
    for (Packet& p : b.packets) {
        p.first_whole = ceil(p.begin);
        p.last = p.last_whole = broadcast(1e9f);
        p.row0_on_grid = all_lanes;
    }
    b.ends = false;
    Floats whole = broadcast(0.0f);  // of all packets
    bool is_clear = false;
    for (int done = 0; done < hull.rows;) {
        const int row = b.sign * (b.first_row + done);
        const CellRow cells(row, b.sign);
        const int far = cells.to_edge(far_rows, hull.rows - done);
        const int near = cells.to_edge(near_rows, hull.rows - done);
        const auto is_over = [&](float top) { return top < hull.z.least(float(done)); };
        if (is_clear && far > near) {
            const Columns c = columns_of(hull, way.first_column, done, far);
            const Bounds* table = cells.row_of(grid.far, grid.bounds_across, far_rows);
            if (is_over(widest_of(table, c.left, c.right, far_columns).top)) {
                done += far;
                continue;
            }
        }
        const Columns c = columns_of(hull, way.first_column, done, near);
        const Bounds* table = cells.row_of(grid.near, grid.bounds_across, near_rows);
        const Bounds bounds = widest_of(table, c.left, c.right, near_columns);
        is_clear = is_over(bounds.top);
        const bool whole_way = hull.begun <= float(done);
        if (whole_way && hull.z.most(float(done + near)) < bounds.bottom) {
            whole = whole + broadcast(float(near));
        } else if (!is_clear) {
            const float* bends = cells.row_of(grid.bend, grid.bounds_across, near_rows);
            const float bend = widest_bend(bends, c.left, c.right);
            for (int g = 0; g < bundle_packets; ++g) {
                const Stretch s{row,       near,   broadcast(float(done)) - b.packets[g].lag,
                                all_lanes, c.left, c.right};
                sift_stretch<masked>(b, g, s, done, whole_way, bend);
            }
            if (b.open > open_steps) solve_open<masked>(b);
        }
        done += near;
    }
    solve_open<masked>(b);
    for (Floats& w : b.whole) w = w + whole;
}

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
