// A packet of rays on its way through the grid, written once over the wide types of wide_*.h. What is
// computed is the same to the last bit for any of them, and for any company that a ray is marched
// in: a lane sees nothing of the others but which steps are worth looking at, and steps that are
// skipped would have added nothing, or exactly a whole step.
//
// The surface is read where a ray crosses the rows of the grid (Grid), by one interpolation along
// the row. For march_rays.h and march_tile.h, which fill packets, and steps.h, which marches them.
#pragma once

#include "core/visibility/kernels/march.h"

namespace relit::kernels {
namespace {

// `lanes` rays that cross the rows of a grid the same way, near each other. Row 0 of a ray is the last
// one at or before its beginning; the position there is extrapolated. Step n goes from its row n to
// its row n + 1.
struct Packet {
    int sign;            // 1: down the rows, -1: up
    Ints row;            // of the grid: the ray's row 0
    Ints column;         // of the grid: what x counts from
    Floats x;            // at row 0
    Floats begin;        // where in step 0 the way begins, [0, 1]
    Floats z;            // height there: a steep ray's height at row 0 would be lost in rounding
    Floats slide, rise;  // of x and z per step
    Floats last;         // step in which the way ends; -1 where nothing is to be marched
    Floats end;          // there, counted from its row; from the beginning where last is 0
    Floats lag;          // steps from the packet's first row to row 0
    // Steps that are no parts: [first_whole, last_whole].
    Floats first_whole, last_whole;

    RELIT_INLINE Floats x_at(Floats n) const { return x + n * slide; }
    RELIT_INLINE Floats z_at(Floats n) const { return z + (n - begin) * rise; }
};

// Part of begin <= t <= end where a t^2 + b t + c is positive; `middle` = (begin + end) / 2.
RELIT_INLINE Floats positive_part(Floats a, Floats b, Floats c, Floats begin, Floats end,
                                  Floats middle) {
    const Floats zero = broadcast(0.0f);
    const Floats discriminant = b * b - broadcast(4.0f) * a * c;
    const Floats root = square_root(max(discriminant, zero));
    // Citardauq form: no cancellation, and the straight line is no special case: with a = +0 the
    // second root is infinite on the side where it does no harm.
    const Floats q = broadcast(-0.5f) * (b + with_sign_of(root, b));
    const Floats root1 = c / q, root2 = q / (a + zero);
    const Floats first = min(max(min(root1, root2), begin), end);
    const Floats second = min(max(max(root1, root2), begin), end);
    // Not the whole less what is between: a steep ray leaves after a trace of a step.
    const Floats crossed = select(a < zero, second - first, (first - begin) + (end - second));
    const Floats at_middle = (a * middle + b) * middle + c;
    const Floats uncrossed = select(zero < at_middle, end - begin, zero);
    return select(zero < discriminant, crossed, uncrossed);
}

// Heights at the corners of the cell that a ray crosses between two rows: z10 is the next column's, z01
// the next row's.
struct Cell {
    Floats column, z00, z10, z01, z11;
};

// A step of each lane, with the cells that its way begins and ends in.
struct Step {
    Floats n;
    Cell first, last;
};

// A step of every lane, solved for exactly: the part of it that lies inside, in steps. Lanes that
// are not wanted give any number.
template <bool masked>
RELIT_INLINE Floats part_inside(const Packet& p, const Step& step, Mask wanted) {
    const Floats n = step.n;
    const Floats zero = broadcast(0.0f), one = broadcast(1.0f), half = broadcast(0.5f);
    // t is counted from where the way begins in the step.
    const Floats origin = select(n == zero, p.begin, zero);
    const Floats x = p.x_at(n) + origin * p.slide;
    const Floats z = p.z_at(n + origin);
    const Floats end = select(n == p.last, p.end, one - origin);
    const Floats x_end = x + end * p.slide;
    const Floats inverse_slide = one / p.slide;

    const auto crossing = [&](Floats from, Floats to, Floats shift) RELIT_INLINE_LAMBDA {
        const Floats a = floor(from + shift), b = floor(to + shift);
        const Floats line = max(a, b) - shift;
        const Floats t = min(max((line - x) * inverse_slide, zero), end);
        return select(a == b, end, t);
    };
    const auto piece = [&](Floats from, Floats to) RELIT_INLINE_LAMBDA {
        const Floats middle = half * (from + to);
        const Floats x_middle = x + middle * p.slide;
        const Floats column = floor(x_middle);
        const Mask in_first = column == step.first.column;
        const auto corner = [&](Floats Cell::*height) RELIT_INLINE_LAMBDA {
            return select(in_first, step.first.*height, step.last.*height);
        };
        const Floats z00 = corner(&Cell::z00), z10 = corner(&Cell::z10);
        const Floats z01 = corner(&Cell::z01), z11 = corner(&Cell::z11);
        const Floats across = z10 - z00, twist = (z11 - z01) - across;
        const Floats a0 = x - column;
        const Floats down = (z01 - z00) + a0 * twist;
        const Floats inside =
            positive_part(p.slide * twist, p.slide * (across + origin * twist) + (down - p.rise),
                          (z00 + a0 * across) + (origin * down - z), from, to, middle);
        if constexpr (!masked) return inside;
        const Mask right = half <= x_middle - column, low = half <= origin + middle;
        const Floats nearest = select(low, select(right, z11, z01), select(right, z10, z00));
        return select(lowest_bit(nearest), inside, zero);
    };
    const Floats line = crossing(x, x_end, zero);
    if constexpr (!masked) {
        const Floats first = piece(zero, line);
        return any(wanted & (line < end)) ? first + piece(line, end) : first;
    }
    const Floats between_columns = crossing(x, x_end, half);
    const Floats between_rows = min(max(half - origin, zero), end);
    const Floats a = min(between_columns, between_rows), b = max(between_columns, between_rows);
    const Floats cut1 = min(a, line), cut2 = min(max(a, line), b), cut3 = max(b, line);
    return ((piece(zero, cut1) + piece(cut1, cut2)) + piece(cut2, cut3)) + piece(cut3, end);
}

// At most one step of each lane that is still to be solved: solving costs as much for one lane as
// for all, so it waits until a lane has a second one.
struct OpenSteps {
    Mask any = ~all_lanes;
    Step step;  // of those; of the others whatever was there

    RELIT_INLINE void add(Mask more, const Step& other) {
        const auto keep = [&](Floats& kept, Floats a)
                              RELIT_INLINE_LAMBDA { kept = select(more, a, kept); };
        const auto keep_cell = [&](Cell& cell, const Cell& a) RELIT_INLINE_LAMBDA {
            keep(cell.column, a.column);
            keep(cell.z00, a.z00);
            keep(cell.z10, a.z10);
            keep(cell.z01, a.z01);
            keep(cell.z11, a.z11);
        };
        keep(step.n, other.n);
        keep_cell(step.first, other.first);
        keep_cell(step.last, other.last);
        any = any | more;
    }
    // Adds what lies inside to `parts`, and forgets them. A step that lies inside all along is one of
    // the `whole`, as it is in company that need not look at it.
    template <bool masked>
    RELIT_INLINE void solve(const Packet& p, Floats& whole, Floats& parts) {
        if (!kernels::any(any)) return;
        const Floats part = part_inside<masked>(p, step, any), one = broadcast(1.0f);
        const Mask is_whole = any & (broadcast(0.9999995f) < part);  // its pieces are rounded
        whole = select(is_whole, whole + one, whole);
        parts = select(any & ~is_whole, parts + part, parts);
        any = ~all_lanes;
    }
};

constexpr int near_rows = 8, far_rows = 32;
constexpr int near_columns = 32, far_columns = 64;

// Rows that a packet has in front of it: their first row, how many, and where its lanes are there.
struct Stretch {
    int row, steps;
    Floats n;         // the first step's number per lane
    Mask relevant;    // lanes that have a part of their way there
    int left, right;  // columns of cells that they touch
};

RELIT_INLINE Stretch stretch(const Packet& p, const Grid& grid, int row, int done, int steps) {
    const Floats zero = broadcast(0.0f);
    Stretch s;
    s.row = row;
    s.steps = steps;
    s.n = broadcast(float(done)) - p.lag;
    const Floats from = max(s.n, zero);
    const Floats to = min(s.n + broadcast(float(steps)), p.last + broadcast(1.0f));
    s.relevant = from < to;
    const Floats at = to_floats(p.column) + p.x;
    const Floats a = at + from * p.slide, b = at + to * p.slide;
    // These sums are rough for wide maps; a little more room makes up for that.
    const float leftmost = lowest(select(s.relevant, min(a, b), broadcast(1e9f))) - 0.01f;
    const float rightmost = highest(select(s.relevant, max(a, b), broadcast(-1e9f))) + 0.01f;
    const int last_cell = grid.columns - 1;
    s.left = leftmost > 0 ? (leftmost < float(last_cell) ? int(leftmost) : last_cell) : 0;
    s.right = rightmost > float(s.left)
                  ? (rightmost < float(last_cell) ? int(rightmost) : last_cell)
                  : s.left;
    return s;
}

RELIT_INLINE Bounds widest(Bounds a, Bounds b) {
    return {b.top > a.top ? b.top : a.top, b.bottom < a.bottom ? b.bottom : a.bottom};
}

// What the table whose entries hold `columns` cells says of the cells of a stretch together.
RELIT_INLINE Bounds widest_of(const Bounds* table_row, int left, int right, int columns) {
    const int first = left / near_rows, stride = columns / near_rows;
    Bounds entry = table_row[first];
    for (int next = first + stride; next * near_rows <= right; next += stride)
        entry = widest(entry, table_row[next]);
    return entry;
}

// Whether all lanes pass the stretch wholly above or wholly inside; adds to `whole` if so.
RELIT_INLINE bool passes(const Packet& p, const Stretch& s, Bounds bounds, Floats& whole) {
    const Floats one = broadcast(1.0f);
    const Floats steps = broadcast(float(s.steps));
    const Floats to = s.n + steps;
    const Floats z_in = p.z_at(max(s.n, p.begin));
    const Floats z_out = p.z_at(min(to, p.last + one));
    const Mask above = broadcast(bounds.top) < min(z_in, z_out);
    const Mask inside = (max(z_in, z_out) < broadcast(bounds.bottom)) & (p.first_whole <= s.n) &
                        (to <= p.last_whole + one);
    if (!all(~s.relevant | above | inside)) return false;
    whole = select(inside & s.relevant, whole + steps, whole);
    return true;
}

}  // namespace
}  // namespace relit::kernels
