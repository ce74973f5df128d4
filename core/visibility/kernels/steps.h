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
// Farther away it may be told wrong by this share of a step, as far as its two rows tell; and by this
// one at most, as far as the bends of the block tell, where the ray crosses a column.
constexpr float rough_share = 0.1f, roughest_share = 1;

// Where the rays of a stretch cross its rows.
struct Crossings {
    Floats excess[near_rows + 1];   // of the surface over the ray
    Floats z0[near_rows + 1];       // of the row, to the left
    Floats z1[near_rows + 1];       // and to the right
    Floats columns[near_rows + 1];  // to the left
    Ints place[near_rows + 1];      // of the columns, from the first one of the rows
};

// The grid's rows of a stretch, from its first column on.
struct Rows {
    const float* first;
    long pitch;
    RELIT_INLINE const float* operator[](int k) const { return first + k * pitch; }
};

template <class Row>
RELIT_INLINE void cross_rows(const Packet& p, const Rows& rows, const Stretch& s, Crossings& c) {
    const Ints base = p.column - broadcast(s.left);
    for (int k = 0; k <= s.steps; ++k) {
        const Floats n = s.n + broadcast(float(k));
        const Floats x = p.x_at(n);
        c.columns[k] = floor(x);
        const Row row(rows[k]);
        c.place[k] = row.place(to_ints(c.columns[k]) + base, s.right - s.left);
        c.z0[k] = row(c.place[k]);
        c.z1[k] = row(c.place[k] + broadcast(1));
        c.excess[k] = (c.z0[k] + (x - c.columns[k]) * (c.z1[k] - c.z0[k])) - p.z_at(n);
    }
}

// The cells that step k begins and ends in.
template <class Row>
RELIT_INLINE Step step_between(const Rows& rows, const Crossings& c, Floats n, int k) {
    const Row upper(rows[k]), lower(rows[k + 1]);
    const Ints first = c.place[k], last = c.place[k + 1], one = broadcast(1);
    return {n,
            {c.columns[k], c.z0[k], c.z1[k], lower(first), lower(first + one)},
            {c.columns[k + 1], upper(last), upper(last + one), c.z0[k + 1], c.z1[k + 1]}};
}

// What of a mask's material lies around a step: all of it, or some.
struct Cover {
    Mask solid, material;
};
RELIT_INLINE Cover cover_of(const Crossings& c, int k) {
    const auto bit = [](Floats z) RELIT_INLINE_LAMBDA { return lowest_bit(z); };
    return {bit(c.z0[k]) & bit(c.z1[k]) & bit(c.z0[k + 1]) & bit(c.z1[k + 1]),
            bit(c.z0[k]) | bit(c.z1[k]) | bit(c.z0[k + 1]) | bit(c.z1[k + 1])};
}

// What is told of a step: which lanes lie inside all along, and for which it has to be solved.
struct Verdict {
    Mask is_whole, is_open;
};

// As well as the cells that the lanes cross can tell.
template <bool masked>
RELIT_INLINE Verdict verdict(const Packet& p, const Crossings& c, const Step& step, int k) {
    const Floats zero = broadcast(0.0f), quarter_slide = broadcast(0.25f) * p.slide;
    const auto across = [](Floats a, Floats b) RELIT_INLINE_LAMBDA { return b - a; };
    const Floats first_upper = across(step.first.z00, step.first.z10);
    const Floats first_lower = across(step.first.z01, step.first.z11);
    const Floats last_upper = across(step.last.z00, step.last.z10);
    const Floats last_lower = across(step.last.z01, step.last.z11);
    // Within a cell the surface leaves the straight line by a parabola, where a column is
    // crossed by a kink; both reach this far.
    const Floats bulge = quarter_slide * (first_upper - last_lower);
    // The parabolas on both sides of a kink.
    const Floats twist = magnitude(first_lower - first_upper) + magnitude(last_upper - last_lower);
    const Mask is_kinked = ~(step.first.column == step.last.column);
    const Floats more = select(is_kinked, magnitude(quarter_slide) * twist, zero);
    const Floats low = min(c.excess[k], c.excess[k + 1]) + min(bulge, zero) - more;
    const Floats high = max(c.excess[k], c.excess[k + 1]) + max(bulge, zero) + more;
    const Mask touches_inside = zero < high, is_inside = zero < low;
    if constexpr (!masked) return {is_inside, touches_inside & ~is_inside};
    const Cover cover = cover_of(c, k);
    const Mask is_whole = is_inside & cover.solid;
    return {is_whole, touches_inside & cover.material & ~is_whole};
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

// Adds what lies inside of steps near the starts, all but those that have to be solved for.
// @return bit k: step k has to be, for the lanes in `open`
template <bool masked, bool whole_way, class Row>
RELIT_INLINE unsigned tell_steps(const Packet& p, const Rows& rows, const Stretch& s,
                                 const Crossings& c, Sums& sums, Mask (&open)[near_rows]) {
    const Floats zero = broadcast(0.0f);
    unsigned steps = 0;
    for (int k = 0; k < s.steps; ++k) {
        const Floats n = s.n + broadcast(float(k));
        Verdict v = verdict<masked>(p, c, step_between<Row>(rows, c, n, k), k);
        add_whole<whole_way>(p, n, s.relevant & (zero <= n) & (n <= p.last), v, sums);
        open[k] = v.is_open;
        steps |= unsigned(any(v.is_open)) << k;
    }
    return steps;
}

// Lanes of a stretch that are far from their starts, and do not end there within a step: the same
// ones in any company.
RELIT_INLINE Mask lanes_afar(const Packet& p, const Stretch& s) {
    const Mask ends_in_step =
        (p.last_whole < p.last) & (p.last < s.n + broadcast(float(near_rows)));
    return s.relevant & (broadcast(near_steps) <= s.n) & ~ends_in_step;
}

// Most by which the slopes along the rows change in the blocks that lanes cross on a stretch: lane by
// lane, so that it is the same in any company.
RELIT_INLINE Floats bends_of(const Packet& p, const Grid& grid, const Stretch& s,
                             const Crossings& c) {
    const int cell_row = p.sign > 0 ? s.row : s.row - 1;
    const float* bends = grid.bend + long(cell_row / near_rows) * grid.bounds_across;
    const Floats leftmost = min(c.columns[0], c.columns[s.steps]);
    const Ints column = clamped(p.column + to_ints(leftmost), 0, grid.columns - 1);
    return gather(bends, shifted_right(column, 3));
}
static_assert(near_rows == 1 << 3);

// The same far from the starts, by shares of steps.
// @param whole_way  all lanes are far, and none ends
template <bool masked, bool whole_way, class Row>
RELIT_INLINE unsigned tell_steps_afar(const Packet& p, const Grid& grid, const Rows& rows,
                                      const Stretch& s, Mask afar, const Crossings& c, Sums& sums,
                                      Mask (&open)[near_rows]) {
    const Floats zero = broadcast(0.0f);
    // Adding this to a share and taking it away again leaves quanta of 1 / 512.
    const Floats to_quanta = broadcast(24576.0f);
    const Floats reach = magnitude(p.slide) * broadcast(0.25f / rough_share);
    const Floats bend_reach = magnitude(p.slide) * broadcast(0.25f * 2 / roughest_share);
    const Floats roughest = bend_reach * bends_of(p, grid, s, c);
    unsigned steps = 0;
    for (int k = 0; k < s.steps; ++k) {
        const Floats n = s.n + broadcast(float(k));
        const Floats inside = max(c.excess[k], zero) + max(c.excess[k + 1], zero);
        const Floats all = (inside + inside) - (c.excess[k] + c.excess[k + 1]);
        const Floats share = (inside / max(all, broadcast(1e-30f)) + to_quanta) - to_quanta;
        const Floats bend = (c.z1[k] - c.z0[k]) - (c.z1[k + 1] - c.z0[k + 1]);
        Mask is_rough = all < max(reach * magnitude(bend), roughest);
        Mask counts = all_lanes;
        if constexpr (masked) {
            const Cover cover = cover_of(c, k);
            is_rough = (is_rough | ~cover.solid) & cover.material;
            counts = cover.solid;
        }
        if constexpr (!whole_way) {
            const Mask active = afar & (n <= p.last);
            is_rough = is_rough & active;
            counts = counts & active;
        }
        sums.shares = select(counts & ~is_rough, sums.shares + share, sums.shares);
        open[k] = is_rough;
        steps |= unsigned(any(is_rough)) << k;
    }
    unsigned unclear = steps;
    for (steps = 0; unclear != 0; unclear &= unclear - 1) {
        const int k = __builtin_ctz(unclear);
        const Floats n = s.n + broadcast(float(k));
        Verdict v = verdict<masked>(p, c, step_between<Row>(rows, c, n, k), k);
        v = {v.is_whole & open[k], v.is_open & open[k]};
        add_whole<true>(p, n, open[k], v, sums);
        open[k] = v.is_open;
        steps |= unsigned(any(v.is_open)) << k;
    }
    return steps;
}

// Steps are solved for wherever the way begins, ends, or may cross the surface or a mask's edge.
template <bool masked, bool whole_way, class Row>
RELIT_INLINE void march_steps(const Packet& p, const Grid& grid, Stretch s, Mask afar, Sums& sums) {
    const Rows rows{grid.z + long(s.row) * grid.pitch + s.left, long(p.sign) * grid.pitch};
    Crossings crossings;
    cross_rows<Row>(p, rows, s, crossings);
    Mask open[near_rows];
    const auto add_open = [&](unsigned steps) RELIT_INLINE_LAMBDA {
        for (; steps != 0; steps &= steps - 1) {
            const int k = __builtin_ctz(steps);
            if (any(open[k] & sums.open.any)) sums.open.template solve<masked>(p, sums.parts);
            const Floats n = s.n + broadcast(float(k));
            sums.open.add(open[k], step_between<Row>(rows, crossings, n, k));
        }
    };
    if (any(afar)) {
        add_open(
            tell_steps_afar<masked, whole_way, Row>(p, grid, rows, s, afar, crossings, sums, open));
        s.relevant = s.relevant & ~afar;
        if (whole_way || !any(s.relevant)) return;
    }
    add_open(tell_steps<masked, whole_way, Row>(p, rows, s, crossings, sums, open));
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
        if (!is_clear) march_stretch<masked>(p, grid, s, lanes_afar(p, s), false, sums);
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
