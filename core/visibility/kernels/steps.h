// The march of a packet, from row to row: see packet.h. Sources: Amanatides and Woo 1987 for the walk,
// here row by row for a whole packet.
//
// A step from row to row counts whole when both its ends lie inside, not at all when neither does,
// unless the cells between them may bulge beyond; the others are solved for exactly, as in
// inside_length.cpp.
#pragma once

#include "core/visibility/kernels/packet.h"

namespace relit::kernels {
namespace {

struct Sums {
    Floats whole = broadcast(0.0f);  // steps that lie inside
    Floats parts = broadcast(0.0f);  // of others
    OpenSteps open;
};

// Where rays cross a row.
struct Crossing {
    Floats excess;  // of the surface over the ray
    Floats z0, z1;  // of the grid points to the left and to the right
    Floats column;  // of the left one
    Ints place;     // of it in the rows of the stretch
};

// The grid's rows of a stretch, from its first column on.
struct Rows {
    const float* first;
    long pitch;
    RELIT_INLINE const float* operator[](int k) const { return first + k * pitch; }
};

RELIT_INLINE Floats step_number(const Stretch& s, int k) { return s.n + broadcast(float(k)); }

// Of row k of a stretch.
template <class Row>
RELIT_INLINE Crossing cross_row(const Packet& p, const Rows& rows, const Stretch& s, int k) {
    const Floats n = step_number(s, k), x = p.x_at(n);
    const Row row(rows[k]);
    Crossing c;
    c.column = floor(x);
    c.place = row.place(to_ints(c.column) + (p.column - broadcast(s.left)), s.right - s.left);
    c.z0 = row(c.place);
    c.z1 = row(c.place + broadcast(1));
    c.excess = (c.z0 + (x - c.column) * (c.z1 - c.z0)) - p.z_at(n);
    return c;
}

// The cells that step k begins and ends in.
template <class Row>
RELIT_INLINE Step step_between(const Rows& rows, const Crossing& from, const Crossing& to, Floats n,
                               int k) {
    const Row upper(rows[k]), lower(rows[k + 1]);
    const Ints one = broadcast(1);
    return {n,
            {from.column, from.z0, from.z1, lower(from.place), lower(from.place + one)},
            {to.column, upper(to.place), upper(to.place + one), to.z0, to.z1}};
}

// What of a mask's material lies around a step: all of it, or some.
struct Cover {
    Mask solid, material;
};
RELIT_INLINE Cover cover_of(const Crossing& from, const Crossing& to) {
    const auto bit = [](Floats z) RELIT_INLINE_LAMBDA { return lowest_bit(z); };
    return {bit(from.z0) & bit(from.z1) & bit(to.z0) & bit(to.z1),
            bit(from.z0) | bit(from.z1) | bit(to.z0) | bit(to.z1)};
}

// What is told of a step: which lanes lie inside all along, and for which it has to be solved.
struct Verdict {
    Mask is_whole, is_open;
};

// As well as the cells that the lanes cross can tell.
template <bool masked>
RELIT_INLINE Verdict verdict(const Packet& p, const Crossing& from, const Crossing& to,
                             const Step& step) {
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
    const Floats low = min(from.excess, to.excess) + min(bulge, zero) - more;
    const Floats high = max(from.excess, to.excess) + max(bulge, zero) + more;
    const Mask touches_inside = zero < high, is_inside = zero < low;
    if constexpr (!masked) return {is_inside, touches_inside & ~is_inside};
    const Cover cover = cover_of(from, to);
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

// Steps are solved for wherever the way begins, ends, or may cross the surface or a mask's edge.
template <bool masked, bool whole_way, class Row>
RELIT_INLINE void march_steps(const Packet& p, const Grid& grid, const Stretch& s, Sums& sums) {
    const Rows rows{grid.z + long(s.row) * grid.pitch + s.left, long(p.sign) * grid.pitch};
    Crossing c[near_rows + 1];
    for (int k = 0; k <= s.steps; ++k) c[k] = cross_row<Row>(p, rows, s, k);
    Mask open[near_rows];
    unsigned some_open = 0;
    for (int k = 0; k < s.steps; ++k) {
        const Floats n = step_number(s, k);
        Verdict v =
            verdict<masked>(p, c[k], c[k + 1], step_between<Row>(rows, c[k], c[k + 1], n, k));
        const Mask active = s.relevant & (broadcast(0.0f) <= n) & (n <= p.last);
        add_whole<whole_way>(p, n, active, v, sums);
        open[k] = v.is_open;
        some_open |= unsigned(any(v.is_open)) << k;
    }
    for (; some_open != 0; some_open &= some_open - 1) {
        const int k = __builtin_ctz(some_open);
        if (any(open[k] & sums.open.any))
            sums.open.template solve<masked>(p, sums.whole, sums.parts);
        sums.open.add(open[k], step_between<Row>(rows, c[k], c[k + 1], step_number(s, k), k));
    }
}

// @param whole_way  no lane begins or ends on the stretch
template <bool masked>
RELIT_INLINE void march_stretch(const Packet& p, const Grid& grid, const Stretch& s, bool whole_way,
                                Sums& sums) {
    if (s.right - s.left + 2 > window_size) march_steps<masked, false, Gather>(p, grid, s, sums);
    else if (whole_way) march_steps<masked, true, Window>(p, grid, s, sums);
    else march_steps<masked, false, Window>(p, grid, s, sums);
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
        if (!is_clear) march_stretch<masked>(p, grid, s, false, sums);
        done += near;
    }
    sums.open.template solve<masked>(p, sums.whole, sums.parts);
    return sums.whole + sums.parts;
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
