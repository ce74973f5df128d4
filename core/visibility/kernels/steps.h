// The march of a packet, from row to row: see packet.h. Sources: Amanatides and Woo 1987 for the walk,
// here row by row for a whole packet.
//
// A step from row to row counts whole when both its ends lie inside, not at all when neither does;
// the others are solved for exactly, as in inside_length.cpp.
#pragma once

#include "core/visibility/kernels/packet.h"

namespace relit::kernels {
namespace {

struct Sums {
    Floats whole = broadcast(0.0f);  // steps that lie inside
    Floats parts = broadcast(0.0f);  // of others
    OpenSteps open;
};

// So many steps of each ray are looked at more closely: here a short way in or out changes d most.
constexpr float careful_steps = 16;

// Steps are solved for wherever the way begins, ends, or may cross the surface or a mask's edge.
template <bool masked, class Row>
RELIT_INLINE void march_steps(const Packet& p, const Grid& grid, const Stretch& s, Sums& sums) {
    const Floats zero = broadcast(0.0f), one = broadcast(1.0f);
    const long pitch = long(p.sign) * grid.pitch;
    const float* first = grid.z + long(s.row) * grid.pitch + s.left;
    const Ints base = p.column - broadcast(s.left);
    const int rightmost = s.right - s.left;
    const Floats quarter_slide = broadcast(0.25f) * p.slide;
    // No lane begins or ends here.
    const bool is_inner =
        all(~s.relevant |
            ((p.first_whole <= s.n) & (s.n + broadcast(float(s.steps - 1)) <= p.last_whole)));
    const bool careful = any(s.relevant & (s.n < broadcast(careful_steps)));

    Floats excess[near_rows + 1], across[near_rows + 1], columns[near_rows + 1];
    Ints place[near_rows + 1];
    Mask solid[near_rows + 1], material[near_rows + 1];
    for (int k = 0; k <= s.steps; ++k) {
        const Floats n = s.n + broadcast(float(k));
        const Floats x = p.x_at(n);
        const Floats column = floor(x);
        const Row row(first + k * pitch);
        const Ints at = row.place(to_ints(column) + base, rightmost);
        place[k] = at;
        const Floats z0 = row(at), z1 = row(at + broadcast(1));
        columns[k] = column;
        across[k] = z1 - z0;
        excess[k] = (z0 + (x - column) * across[k]) - p.z_at(n);
        if constexpr (masked) {
            solid[k] = lowest_bit(z0) & lowest_bit(z1);
            material[k] = lowest_bit(z0) | lowest_bit(z1);
        }
    }
    for (int k = 0; k < s.steps; ++k) {
        const Floats n = s.n + broadcast(float(k));
        Mask active = s.relevant, is_part = ~all_lanes;
        if (!is_inner) {
            active = (zero <= n) & (n <= p.last);
            is_part = (n < p.first_whole) | (p.last_whole < n);
        }
        // Within a cell the surface leaves the straight line by a parabola, where a column is
        // crossed by a kink; both reach this far.
        const Floats bulge = quarter_slide * (across[k] - across[k + 1]);
        Floats low = min(excess[k], excess[k + 1]) + min(bulge, zero);
        Floats high = max(excess[k], excess[k + 1]) + max(bulge, zero);
        if (careful) {
            // The parabolas on both sides of a kink.
            const Row upper(first + k * pitch), lower(first + (k + 1) * pitch);
            const auto slope = [&](const Row& row, Ints at) {
                return row(at + broadcast(1)) - row(at);
            };
            const Floats twist = magnitude(slope(lower, place[k]) - across[k]) +
                                 magnitude(slope(upper, place[k + 1]) - across[k + 1]);
            const Mask counts = (n < broadcast(careful_steps)) & ~(columns[k] == columns[k + 1]);
            const Floats more = select(counts, magnitude(quarter_slide) * twist, zero);
            low = low - more;
            high = high + more;
        }
        const Mask touches_inside = zero < high;
        Mask is_whole = zero < low;
        Mask unclear = (touches_inside & ~is_whole) | is_part;
        if constexpr (masked) {
            const Mask all_solid = solid[k] & solid[k + 1];
            const Mask some_solid = material[k] | material[k + 1];
            unclear = (touches_inside & some_solid & ~(is_whole & all_solid)) | is_part;
            is_whole = is_whole & all_solid;
        }
        sums.whole = select(active & is_whole & ~is_part, sums.whole + one, sums.whole);
        unclear = unclear & active;
        if (any(unclear)) {
            if (any(unclear & sums.open.any)) sums.open.template solve<masked>(p, sums.parts);
            sums.open.add(unclear, n, columns[k], place[k], columns[k + 1], place[k + 1],
                          Row(first + k * pitch), Row(first + (k + 1) * pitch));
        }
    }
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
            if (passes(p, s, bounds_of(table, s.left, s.right, far_columns), sums.whole)) {
                done += far;
                continue;
            }
        }
        const Stretch s = stretch(p, grid, row, done, near);
        const Bounds* table = grid.near + long(cell_row / near_rows) * grid.bounds_across;
        is_clear = passes(p, s, bounds_of(table, s.left, s.right, near_columns), sums.whole);
        if (!is_clear) {
            if (s.right - s.left + 2 <= window_size) march_steps<masked, Window>(p, grid, s, sums);
            else march_steps<masked, Gather>(p, grid, s, sums);
        }
        done += near;
    }
    sums.open.template solve<masked>(p, sums.parts);
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
