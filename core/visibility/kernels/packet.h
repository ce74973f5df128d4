// A packet of rays on its way through the grid, written once over the wide types of wide_*.h. What is
// computed is the same to the last bit for any of them, and for any company that a ray is marched
// in: a lane sees nothing of the others but which steps are worth looking at, and steps that are
// skipped would have added nothing, or exactly a whole step.
//
// For march_rays.h and march_tile.h, which fill packets, and steps.h, which marches them.
#pragma once

#include "core/visibility/kernels/march.h"

namespace relit::kernels {
namespace {

// `lanes` rays that cross the rows of a grid the same way, near each other. Row 0 of a ray is the last
// one at or before its beginning; the position there is extrapolated. Step n goes from its row n to
// its row n + 1.
struct Packet {
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
    Mask row0_on_grid;  // lanes whose position at row 0 is: the surface there can be looked at

    RELIT_INLINE Floats x_at(Floats n) const { return x + n * slide; }
    RELIT_INLINE Floats z_at(Floats n) const { return z + (n - begin) * rise; }
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
    return {b.top > a.top ? b.top : a.top, b.bottom < a.bottom ? b.bottom : a.bottom,
            b.bend > a.bend ? b.bend : a.bend};
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
