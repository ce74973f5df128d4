// The march of packets through the grid, block by block: see packet.h. Sources: Amanatides and Woo 1987
// for the walk, here row by row for whole packets.
#pragma once

#include "core/visibility/kernels/solve.h"

namespace relit::kernels {
namespace {

// Cells from the row `row` on, in steps of `sign`: which row of cells, and how many rows until the
// next edge of blocks of `size` rows.
struct CellRow {
    int sign, cell_row;
    RELIT_INLINE CellRow(int row, int way) : sign(way), cell_row(way > 0 ? row : row - 1) {}
    [[nodiscard]] RELIT_INLINE int to_edge(int size, int at_most) const {
        const int inner = cell_row & (size - 1);
        const int edge = sign > 0 ? size - inner : inner + 1;
        return edge < at_most ? edge : at_most;
    }
    // What the tables say of the cells from column `left` to `right`.
    [[nodiscard]] RELIT_INLINE Bounds near(const Grid& grid, int left, int right) const {
        const Bounds* table = grid.near + long(cell_row / near_rows) * grid.bounds_across;
        return widest_of(table, left, right, near_columns);
    }
    [[nodiscard]] RELIT_INLINE Bounds far(const Grid& grid, int left, int right) const {
        const Bounds* table = grid.far + long(cell_row / far_rows) * grid.bounds_across;
        return widest_of(table, left, right, far_columns);
    }
};

// Marches packet g by itself, from where its first lane begins for `steps` rows.
template <bool masked>
RELIT_INLINE void march_packet(Bundle& b, int g, int steps) {
    const Packet& p = b.packets[g];
    const Grid& grid = *b.grid;
    bool is_clear = false;  // of the surface, as far as the last rows tell
    for (int done = 0; done < steps;) {
        const int row = b.sign * (b.first_row + done);
        const CellRow cells(row, b.sign);
        const int far = cells.to_edge(far_rows, steps - done);
        const int near = cells.to_edge(near_rows, steps - done);
        if (is_clear && far > near) {
            const Stretch s = stretch(p, grid, row, done, far);
            if (passes(p, s, cells.far(grid, s.left, s.right), b.whole[g])) {
                done += far;
                continue;
            }
        }
        const Stretch s = stretch(p, grid, row, done, near);
        const Bounds bounds = cells.near(grid, s.left, s.right);
        is_clear = passes(p, s, bounds, b.whole[g]);
        if (!is_clear) {
            sift_stretch<masked>(b, g, s, done, false, bounds.bend);
            if (b.open > open_steps) solve_open<masked>(b);
        }
        done += near;
    }
    solve_open<masked>(b);
}

// The same for a packet whose derived numbers are still to be filled in.
template <bool masked>
RELIT_INLINE void march_alone(Bundle& b, int g) {
    Packet& p = b.packets[g];
    const Floats zero = broadcast(0.0f), one = broadcast(1.0f);
    const Mask idle = p.last < zero;
    const Floats row = select(idle, broadcast(1e9f), broadcast(float(b.sign)) * to_floats(p.row));
    const float first_row = lowest(row);
    if (!(first_row < 1e9f)) return;
    p.lag = select(idle, zero, row - broadcast(first_row));
    p.first_whole = select(zero < p.begin, one, zero);
    const Floats whole_end = select(p.last == zero, one - p.begin, one);
    p.last_whole = select(p.end < whole_end, p.last - one, p.last);
    const Floats column = to_floats(p.column) + p.x;
    p.row0_on_grid = (zero <= column) & (column < broadcast(float(b.grid->columns)));
    b.first_row = int(first_row);
    b.ends = true;
    march_packet<masked>(b, g, int(highest(p.lag + p.last)) + 1);
}

}  // namespace
}  // namespace relit::kernels
