// The packet march, written once over the wide types of wide_*.h; each march_*.cpp compiles it for
// its instruction set. What it computes is the same to the last bit for any of them, and for any
// company that a ray is marched in: a lane sees nothing of the others but which steps are worth
// looking at, and steps that are skipped would have added nothing, or exactly a whole step.
//
// The surface is read where a ray crosses the rows of the grid (Grid), by one interpolation along
// the row. A step from row to row counts whole when both its ends lie inside, not at all when
// neither does; what the way does in between is asked only where it begins, ends, or crosses the
// surface, or a mask's edge, and then solved for exactly, as in inside_length.cpp.
#pragma once

#include "core/visibility/kernels/rays.h"

namespace relit::kernels {
namespace {

// ---- Marching a packet ------------------------------------------------------------------------

// `lanes` rays of one kind, near each other; see Rays.
struct Packet {
    Floats column, x, begin, z, slide, rise, last, end;
    Ints whole_column;
    Floats lag;  // rows from the packet's first row to the ray's row 0
    // Steps that are no parts: [first_whole, last_whole].
    Floats first_whole, last_whole;
    Floats inverse_slide;

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

// Step n of every lane, solved for exactly: the part of it that lies inside, in steps. Lanes that
// are not wanted give any number.
// @param upper, lower  the rows where the step begins and ends; places in them count from `base`
template <bool masked, class Row>
RELIT_INLINE Floats part_inside(const Packet& p, Floats n, Mask wanted, Row upper, Row lower,
                                Ints base, int rightmost) {
    const Floats zero = broadcast(0.0f), one = broadcast(1.0f), half = broadcast(0.5f);
    // t is counted from where the way begins in the step.
    const Floats origin = select(n == zero, p.begin, zero);
    const Floats x = p.x_at(n) + origin * p.slide;
    const Floats z = p.z_at(n + origin);
    const Floats end = select(n == p.last, p.end, one - origin);
    const Floats x_end = x + end * p.slide;

    const auto crossing = [&](Floats from, Floats to, Floats shift) {
        const Floats a = floor(from + shift), b = floor(to + shift);
        const Floats line = max(a, b) - shift;
        const Floats t = min(max((line - x) * p.inverse_slide, zero), end);
        return select(a == b, end, t);
    };
    const auto piece = [&](Floats from, Floats to) {
        const Floats middle = half * (from + to);
        const Floats x_middle = x + middle * p.slide;
        const Floats column = floor(x_middle);
        const Ints at = upper.place(to_ints(column) + base, rightmost);
        const Ints beside = at + broadcast(1);
        const Floats z00 = upper(at), z10 = upper(beside), z01 = lower(at), z11 = lower(beside);
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

// So many steps of each ray are looked at more closely: here a short way in or out changes d most.
constexpr float careful_steps = 16;

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
    const Floats at = p.column + p.x;
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

// Bounds of the cells of a stretch, from the table whose entries hold `columns` of them.
RELIT_INLINE Bounds bounds_of(const Bounds* table_row, int left, int right, int columns) {
    const int first = left / near_rows;
    Bounds bounds = table_row[first];
    for (int next = first + columns / near_rows; next * near_rows <= right;
         next += columns / near_rows) {
        const Bounds& more = table_row[next];
        bounds.top = more.top > bounds.top ? more.top : bounds.top;
        bounds.bottom = more.bottom < bounds.bottom ? more.bottom : bounds.bottom;
    }
    return bounds;
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

template <bool masked, class Row>
RELIT_INLINE void march_rows(const Packet& p, const Grid& grid, const Stretch& s, int sign,
                             Floats& whole, Floats& parts) {
    const Floats zero = broadcast(0.0f), one = broadcast(1.0f);
    const long pitch = long(sign) * grid.pitch;
    const float* first = grid.z + long(s.row) * grid.pitch + s.left;
    const Ints base = p.whole_column - broadcast(s.left);
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
        whole = select(active & is_whole & ~is_part, whole + one, whole);
        unclear = unclear & active;
        if (any(unclear)) {
            const Row upper(first + k * pitch), lower(first + (k + 1) * pitch);
            parts = select(
                unclear, parts + part_inside<masked>(p, n, unclear, upper, lower, base, rightmost),
                parts);
        }
    }
}

// Steps of each lane that lie inside.
template <bool masked>
Floats march_packet(const Packet& p, const Grid& grid, int first_row, int sign, int steps) {
    Floats whole = broadcast(0.0f), parts = whole;
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
            if (passes(p, s, bounds_of(table, s.left, s.right, far_columns), whole)) {
                done += far;
                continue;
            }
        }
        const Stretch s = stretch(p, grid, row, done, near);
        const Bounds* table = grid.near + long(cell_row / near_rows) * grid.bounds_across;
        is_clear = passes(p, s, bounds_of(table, s.left, s.right, near_columns), whole);
        if (!is_clear) {
            if (s.right - s.left + 2 <= window_size)
                march_rows<masked, Window>(p, grid, s, sign, whole, parts);
            else march_rows<masked, Gather>(p, grid, s, sign, whole, parts);
        }
        done += near;
    }
    return whole + parts;
}

// ---- Packets of rays --------------------------------------------------------------------------

// Sorts rays by kind and then by the row that they start in, so that neighbours cross the same rows
// at the same time. order[starts[k]] is the first of kind k.
RELIT_INLINE void sort(const Scenery& s, const double* from, int count, int* order,
                       int (&starts)[kinds + 1]) {
    constexpr int buckets = 64;  // rows, with those below and above in the outer ones
    int place[kinds * buckets + 1] = {};
    int bucket[max_rays];
    const double middle_u = from[0] * s.width, middle_v = s.height - from[1] * s.width;
    for (int i = 0; i < count; ++i) {
        const double x = from[3 * i], y = from[3 * i + 1];
        const double way_x = s.at_infinity ? s.light[0] : s.light[0] - x;
        const double way_y = s.at_infinity ? s.light[1] : s.light[1] - y;
        const bool by_columns = __builtin_fabs(way_x) > __builtin_fabs(way_y);
        const bool backwards = by_columns ? way_x < 0 : way_y > 0;
        const double row =
            by_columns ? x * s.width - middle_u : (s.height - y * s.width) - middle_v;
        const double shifted = row + buckets / 2;
        const int b = shifted > 0 ? shifted < buckets ? int(shifted) : buckets - 1 : 0;
        bucket[i] = ((by_columns ? 2 : 0) + (backwards ? 1 : 0)) * buckets + b;
    }
    for (int i = 0; i < count; ++i) ++place[bucket[i] + 1];
    for (int b = 0; b < kinds * buckets; ++b) place[b + 1] += place[b];
    for (int kind = 0; kind <= kinds; ++kind) starts[kind] = place[kind * buckets];
    for (int i = 0; i < count; ++i) order[place[bucket[i]]++] = i;
}

// r of the rays `order`, `lanes` of them, all of one kind.
template <bool masked>
RELIT_INLINE void march_lanes(const Scenery& scenery, int kind, const double* from,
                              const int* order, double* r) {
    constexpr int batches = 2;
    const bool by_columns = kind == columns_down || kind == columns_up;
    const bool backwards = kind == rows_up || kind == columns_up;
    Rays rays[batches];
    for (int b = 0; b < batches; ++b) {
        const auto coordinate = [&](int c) { return gather(from + c, order + b * batch); };
        rays[b] =
            prepared(scenery, by_columns, backwards, coordinate(0), coordinate(1), coordinate(2));
    }
    const auto floats = [&](Doubles Rays::*field) {
        Doubles values[batches];
        for (int b = 0; b < batches; ++b) values[b] = rays[b].*field;
        return to_floats(values);
    };
    const Floats zero = broadcast(0.0f), one = broadcast(1.0f);
    Packet p;
    p.last = floats(&Rays::last);
    const int sign = backwards ? -1 : 1;
    const Mask idle = p.last < zero;
    const Floats row = select(idle, broadcast(1e9f), broadcast(float(sign)) * floats(&Rays::row));
    const float first_row = lowest(row);
    Floats inside = zero;
    if (first_row < 1e9f) {
        p.lag = select(idle, zero, row - broadcast(first_row));
        p.column = floats(&Rays::column);
        p.whole_column = to_ints(p.column);
        p.x = floats(&Rays::x);
        p.begin = floats(&Rays::begin);
        p.z = floats(&Rays::z);
        p.slide = floats(&Rays::slide);
        p.inverse_slide = one / p.slide;
        p.rise = floats(&Rays::rise);
        p.end = floats(&Rays::end);
        p.first_whole = select(zero < p.begin, one, zero);
        const Floats whole_end = select(p.last == zero, one - p.begin, one);
        p.last_whole = select(p.end < whole_end, p.last - one, p.last);
        const int steps = int(highest(p.lag + p.last)) + 1;
        inside = march_packet<masked>(p, by_columns ? scenery.by_columns : scenery.by_rows,
                                      sign * int(first_row), sign, steps);
    }
    alignas(64) double found[lanes];
    for (int b = 0; b < batches; ++b)
        store(found + b * batch, rays[b].elsewhere + rays[b].step_length * to_doubles(inside, b));
    for (int k = 0; k < lanes; ++k) r[order[k]] = found[k];
}

template <bool masked>
RELIT_INLINE void march_all(const Scenery& scenery, const double* from, int count, double* r) {
    int order[max_rays], starts[kinds + 1];
    sort(scenery, from, count, order, starts);
    for (int kind = 0; kind < kinds; ++kind)
        for (int k = starts[kind]; k < starts[kind + 1]; k += lanes) {
            // The last packet is filled up with its last ray.
            int filled[lanes];
            const int* some = order + k;
            const int left_over = starts[kind + 1] - k;
            if (left_over < lanes) {
                for (int lane = 0; lane < lanes; ++lane)
                    filled[lane] = some[lane < left_over ? lane : left_over - 1];
                some = filled;
            }
            march_lanes<masked>(scenery, kind, from, some, r);
        }
}

void march(const Scenery& scenery, const double* from, int count, double* r) {
    if (scenery.masked) march_all<true>(scenery, from, count, r);
    else march_all<false>(scenery, from, count, r);
}

}  // namespace
}  // namespace relit::kernels
