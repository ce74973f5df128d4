// Bundles of which no ray ends before it is over everything: blocks are passed by what bounds all their
// rays together. For march_tile.h.
#pragma once

#include "core/visibility/kernels/tile_rays.h"

namespace relit::kernels {
namespace {

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
            if (is_over(cells.far(grid, c.left, c.right).top)) {
                done += far;
                continue;
            }
        }
        const Columns c = columns_of(hull, way.first_column, done, near);
        const Bounds bounds = cells.near(grid, c.left, c.right);
        is_clear = is_over(bounds.top);
        const bool whole_way = hull.begun <= float(done);
        if (whole_way && hull.z.most(float(done + near)) < bounds.bottom) {
            whole = whole + broadcast(float(near));
        } else if (!is_clear) {
            for (int g = 0; g < bundle_packets; ++g) {
                const Stretch s{row,       near,   broadcast(float(done)) - b.packets[g].lag,
                                all_lanes, c.left, c.right};
                sift_stretch<masked>(b, g, s, done, whole_way, bounds.bend);
            }
            if (b.open > open_steps) solve_open<masked>(b);
        }
        done += near;
    }
    solve_open<masked>(b);
    for (Floats& w : b.whole) w = w + whole;
}

}  // namespace
}  // namespace relit::kernels
