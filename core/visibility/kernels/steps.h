// The march of a packet, from row to row: see packet.h. Sources: Amanatides and Woo 1987 for the walk,
// here row by row for a whole packet.
//
// Near its start a step from row to row counts whole when both its ends lie inside, not at all when
// neither does; the others are solved for exactly, as in inside_length.cpp. Far from it a part of a
// step changes d little (by t / r^2 of it): there the surface is taken for straight from row to row,
// wherever that cannot be wrong by more than a small share of the step.
#pragma once

#include "core/visibility/kernels/packet.h"

namespace relit::kernels {
namespace {

struct Sums {
    Floats whole = broadcast(0.0f);  // steps that lie inside
    Floats parts = broadcast(0.0f);  // of others
    // Of far ones, in quanta: their sum is the same in whatever order.
    Floats shares = broadcast(0.0f);
    OpenSteps open;

    RELIT_INLINE Floats total() const { return (whole + shares) + parts; }
};

// A ray is near its start on stretches that begin within so many steps of it.
constexpr float near_steps = 8;
// Share of a step that it may be told wrong by farther away.
constexpr float rough_share = 0.1f;

// Where the rays of a stretch cross its rows.
struct Crossings {
    Floats excess[near_rows + 1];  // of the surface over the ray
    Floats across[near_rows + 1];  // slope of the surface along the row
    Floats columns[near_rows + 1];
    Ints place[near_rows + 1];  // of the columns, from the first one of the rows
    Mask solid[near_rows + 1], material[near_rows + 1];
};

// The grid's rows of a stretch, from its first column on.
struct Rows {
    const float* first;
    long pitch;
    RELIT_INLINE const float* operator[](int k) const { return first + k * pitch; }
};

template <bool masked, class Row>
RELIT_INLINE void cross_rows(const Packet& p, const Rows& rows, const Stretch& s, Crossings& c) {
    const Ints base = p.column - broadcast(s.left);
    for (int k = 0; k <= s.steps; ++k) {
        const Floats n = s.n + broadcast(float(k));
        const Floats x = p.x_at(n);
        c.columns[k] = floor(x);
        const Row row(rows[k]);
        c.place[k] = row.place(to_ints(c.columns[k]) + base, s.right - s.left);
        const Floats z0 = row(c.place[k]), z1 = row(c.place[k] + broadcast(1));
        c.across[k] = z1 - z0;
        c.excess[k] = (z0 + (x - c.columns[k]) * c.across[k]) - p.z_at(n);
        if constexpr (masked) {
            c.solid[k] = lowest_bit(z0) & lowest_bit(z1);
            c.material[k] = lowest_bit(z0) | lowest_bit(z1);
        }
    }
}

// What is told of a step: which lanes lie inside all along, and for which it has to be solved.
struct Verdict {
    Mask is_whole, is_open;
};

// @param low, high  bounds of the surface's excess on step k
template <bool masked>
RELIT_INLINE Verdict verdict(const Crossings& c, int k, Floats low, Floats high) {
    const Floats zero = broadcast(0.0f);
    const Mask touches_inside = zero < high, is_inside = zero < low;
    if constexpr (!masked) return {is_inside, touches_inside & ~is_inside};
    const Mask is_whole = is_inside & c.solid[k] & c.solid[k + 1];
    const Mask some_material = c.material[k] | c.material[k + 1];
    return {is_whole, touches_inside & some_material & ~is_whole};
}

// Adds the lanes of step n that lie inside all along, and opens the ends of ways. What is left of the
// step that a way begins in is the first that is added to its parts, in any company.
template <bool whole_way>
RELIT_INLINE void add_whole(const Packet& p, Floats n, Mask active, Verdict& v, Sums& sums) {
    const Floats one = broadcast(1.0f);
    if constexpr (!whole_way) {
        const Mask begins = n < p.first_whole, ends = p.last_whole < n;
        const Mask is_rest = v.is_whole & begins & ~ends & active;
        sums.parts = select(is_rest, sums.parts + (one - p.begin), sums.parts);
        v.is_open = (v.is_open | begins | ends) & active & ~is_rest;
        v.is_whole = v.is_whole & active & ~(begins | ends);
    }
    sums.whole = select(v.is_whole, sums.whole + one, sums.whole);
}

// Tells what bounds of the whole stretch tell.
// @return bit k: for some lane step k is not told; which, is in `unclear`
template <bool masked, bool whole_way>
RELIT_INLINE unsigned tell_steps(const Packet& p, const Stretch& s, const Crossings& c, Sums& sums,
                                 Mask (&unclear)[near_rows]) {
    const Floats zero = broadcast(0.0f);
    // However the surface bends between two rows, it is no farther from what it is at their ends.
    const Floats reach = magnitude(p.slide) * broadcast(0.25f * 5.01f * s.bend);
    unsigned open = 0;
    for (int k = 0; k < s.steps; ++k) {
        const Floats n = s.n + broadcast(float(k));
        Verdict v = verdict<masked>(c, k, min(c.excess[k], c.excess[k + 1]) - reach,
                                    max(c.excess[k], c.excess[k + 1]) + reach);
        add_whole<whole_way>(p, n, s.relevant & (zero <= n) & (n <= p.last), v, sums);
        unclear[k] = v.is_open;
        open |= unsigned(any(v.is_open)) << k;
    }
    return open;
}

// The same for the unclear lanes of step k, as well as the cells that they cross can tell.
template <bool masked, bool whole_way, class Row>
RELIT_INLINE void look_closer(const Packet& p, const Rows& rows, const Stretch& s, int k,
                              const Mask (&unclear)[near_rows], const Crossings& c, Sums& sums) {
    const Floats n = s.n + broadcast(float(k));
    const Floats zero = broadcast(0.0f), quarter_slide = broadcast(0.25f) * p.slide;
    const Row upper(rows[k]), lower(rows[k + 1]);
    // Within a cell the surface leaves the straight line by a parabola, where a column is
    // crossed by a kink; both reach this far.
    const Floats bulge = quarter_slide * (c.across[k] - c.across[k + 1]);
    // The parabolas on both sides of a kink.
    const auto slope = [&](const Row& row, Ints at) { return row(at + broadcast(1)) - row(at); };
    const Floats twist = magnitude(slope(lower, c.place[k]) - c.across[k]) +
                         magnitude(slope(upper, c.place[k + 1]) - c.across[k + 1]);
    const Mask is_kinked = ~(c.columns[k] == c.columns[k + 1]);
    const Floats more = select(is_kinked, magnitude(quarter_slide) * twist, zero);
    const Floats low = min(c.excess[k], c.excess[k + 1]) + min(bulge, zero) - more;
    const Floats high = max(c.excess[k], c.excess[k + 1]) + max(bulge, zero) + more;
    Verdict v = verdict<masked>(c, k, low, high);
    v.is_whole = v.is_whole & unclear[k];
    v.is_open = v.is_open & unclear[k];
    add_whole<whole_way>(p, n, unclear[k], v, sums);
    if (!any(v.is_open)) return;
    if (any(v.is_open & sums.open.any)) sums.open.template solve<masked>(p, sums.parts);
    sums.open.add(v.is_open, n, c.columns[k], c.place[k], c.columns[k + 1], c.place[k + 1], upper,
                  lower);
}

// Lanes of a stretch that are far from their starts, and do not end there within a step: the same
// ones in any company.
RELIT_INLINE Mask lanes_afar(const Packet& p, const Stretch& s) {
    const Mask ends_in_step =
        (p.last_whole < p.last) & (p.last < s.n + broadcast(float(near_rows)));
    return s.relevant & (broadcast(near_steps) <= s.n) & ~ends_in_step;
}

// Adds the shares of far lanes' steps that lie inside.
// @param whole_way  all lanes are far, and none ends
// @return as tell_steps()
template <bool masked, bool whole_way>
RELIT_INLINE unsigned tell_steps_afar(const Packet& p, const Stretch& s, Mask afar,
                                      const Crossings& c, Sums& sums, Mask (&unclear)[near_rows]) {
    const Floats zero = broadcast(0.0f);
    // Adding this to a share and taking it away again leaves quanta of 1 / 512.
    const Floats to_quanta = broadcast(24576.0f);
    const Floats reach = magnitude(p.slide) * broadcast(0.25f / rough_share);
    unsigned open = 0;
    for (int k = 0; k < s.steps; ++k) {
        const Floats inside = max(c.excess[k], zero) + max(c.excess[k + 1], zero);
        const Floats all = (inside + inside) - (c.excess[k] + c.excess[k + 1]);
        const Floats share = (inside / max(all, broadcast(1e-30f)) + to_quanta) - to_quanta;
        Mask is_open = all < reach * magnitude(c.across[k] - c.across[k + 1]);
        Mask counts = all_lanes;
        if constexpr (!whole_way) counts = afar & (s.n + broadcast(float(k)) <= p.last);
        if constexpr (masked) {
            const Mask solid = c.solid[k] & c.solid[k + 1];
            is_open = (is_open | ~solid) & (c.material[k] | c.material[k + 1]);
            counts = counts & solid;
        }
        if constexpr (!whole_way) is_open = is_open & afar & (s.n + broadcast(float(k)) <= p.last);
        sums.shares = select(counts & ~is_open, sums.shares + share, sums.shares);
        unclear[k] = is_open;
        open |= unsigned(any(is_open)) << k;
    }
    return open;
}

// Steps are solved for wherever the way begins, ends, or may cross the surface or a mask's edge.
template <bool masked, bool whole_way, class Row>
RELIT_INLINE void march_steps(const Packet& p, const Grid& grid, Stretch s, Mask afar, Sums& sums) {
    const Rows rows{grid.z + long(s.row) * grid.pitch + s.left, long(p.sign) * grid.pitch};
    Crossings crossings;
    cross_rows<masked, Row>(p, rows, s, crossings);
    Mask unclear[near_rows];
    if (any(afar)) {
        unsigned open = tell_steps_afar<masked, whole_way>(p, s, afar, crossings, sums, unclear);
        for (; open != 0; open &= open - 1)
            look_closer<masked, true, Row>(p, rows, s, __builtin_ctz(open), unclear, crossings,
                                           sums);
        s.relevant = s.relevant & ~afar;
        if (whole_way || !any(s.relevant)) return;
    }
    unsigned open = tell_steps<masked, whole_way>(p, s, crossings, sums, unclear);
    for (; open != 0; open &= open - 1)
        look_closer<masked, whole_way, Row>(p, rows, s, __builtin_ctz(open), unclear, crossings,
                                            sums);
}

// @param afar       lanes_afar()
// @param whole_way  no lane begins or ends on the stretch
template <bool masked>
RELIT_INLINE void march_stretch(const Packet& p, const Grid& grid, const Stretch& s, Mask afar,
                                bool whole_way, Sums& sums) {
    const bool same_way = whole_way && (all(afar) || !any(afar));
    if (s.right - s.left + 2 > window_size)
        march_steps<masked, false, Gather>(p, grid, s, afar, sums);
    else if (same_way) march_steps<masked, true, Window>(p, grid, s, afar, sums);
    else march_steps<masked, false, Window>(p, grid, s, afar, sums);
}

// Steps of each lane that lie inside.
// @param first_row  of the grid: the first one that a lane begins at
// @param steps      from there to where the last lane ends
template <bool masked>
RELIT_INLINE Floats steps_inside(const Packet& p, const Grid& grid, int first_row, int steps) {
    Sums sums;
    const int sign = p.sign;
    bool is_clear = false;  // of the surface, as far as the last rows tell
    for (int done = 0; done < steps;) {
        const int row = first_row + sign * done;
        const int cell_row = sign > 0 ? row : row - 1;
        const int left_over = steps - done;
        const auto to_edge = [&](int size) {
            const int inner = cell_row & (size - 1);
            const int edge = sign > 0 ? size - inner : inner + 1;
            return edge < left_over ? edge : left_over;
        };
        const int far = to_edge(far_rows), near = to_edge(near_rows);
        if (is_clear && far > near) {
            const Stretch s = stretch(p, grid, row, done, far);
            const Bounds* table = grid.far + long(cell_row / far_rows) * grid.bounds_across;
            if (passes(p, s, widest_of(table, s.left, s.right, far_columns), sums.whole)) {
                done += far;
                continue;
            }
        }
        Stretch s = stretch(p, grid, row, done, near);
        const Bounds* table = grid.near + long(cell_row / near_rows) * grid.bounds_across;
        is_clear = passes(p, s, widest_of(table, s.left, s.right, near_columns), sums.whole);
        if (!is_clear) {
            const float* bends = grid.bend + long(cell_row / near_rows) * grid.bounds_across;
            s.bend = widest_of(bends, s.left, s.right, near_columns);
            march_stretch<masked>(p, grid, s, lanes_afar(p, s), false, sums);
        }
        done += near;
    }
    sums.open.template solve<masked>(p, sums.parts);
    return sums.total();
}

// The same for a packet whose derived numbers are still to be filled in.
template <bool masked>
RELIT_INLINE Floats inside_of(Packet& p, const Grid& grid) {
    const Floats zero = broadcast(0.0f), one = broadcast(1.0f);
    const Mask idle = p.last < zero;
    const Floats sign = broadcast(float(p.sign));
    const Floats row = select(idle, broadcast(1e9f), sign * to_floats(p.row));
    const float first_row = lowest(row);
    if (!(first_row < 1e9f)) return zero;
    p.lag = select(idle, zero, row - broadcast(first_row));
    p.first_whole = select(zero < p.begin, one, zero);
    const Floats whole_end = select(p.last == zero, one - p.begin, one);
    p.last_whole = select(p.end < whole_end, p.last - one, p.last);
    const int steps = int(highest(p.lag + p.last)) + 1;
    return steps_inside<masked>(p, grid, p.sign * int(first_row), steps);
}

}  // namespace
}  // namespace relit::kernels
