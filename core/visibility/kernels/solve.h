// The steps that a look at the rows leaves open (bundle.h), solved for exactly, as inside_length.cpp
// does it: a register of them at a time, whichever packets and rows they are of. For steps.h.
#pragma once

#include "core/visibility/kernels/bundle.h"

namespace relit::kernels {
namespace {

// Part of begin <= t <= end where a t^2 + b t + c is positive.
RELIT_INLINE Floats positive_part(Floats a, Floats b, Floats c, Floats begin, Floats end) {
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
    const Floats middle = broadcast(0.5f) * (begin + end);
    const Floats at_middle = (a * middle + b) * middle + c;
    const Floats uncrossed = select(zero < at_middle, end - begin, zero);
    return select(zero < discriminant, crossed, uncrossed);
}

// A register of steps. t is counted from where the way begins in each, in steps.
struct Steps {
    Floats origin;       // from the step's row to where its way begins
    Floats x, z;         // there; x from the grid point to the left of it
    Floats slide, rise;  // per step
    Floats end;          // of t
    Mask rightward;
    // In the grid: the leftmost point of the upper row of the cells that they cross, two at most.
    alignas(64) int place[lanes];
};

// Of the bundle's rays: a number that its packets hold.
RELIT_INLINE Floats of_rays(const Bundle& b, Ints ray, Floats Packet::*field) {
    return pick(b.packets[0].*field, b.packets[1].*field, b.packets[2].*field, b.packets[3].*field,
                ray);
}
RELIT_INLINE Ints columns_of_rays(const Bundle& b, Ints ray) {
    const auto column = [&](int g)
                            RELIT_INLINE_LAMBDA { return floats_of_bits(b.packets[g].column); };
    return bits_of(pick(column(0), column(1), column(2), column(3), ray));
}

// @param code  step * bundle_rays + ray of each
RELIT_INLINE void prepare(const Bundle& b, Ints code, Steps& s) {
    const Ints ray = code & broadcast(bundle_rays - 1);
    const Ints step = shifted_right(code, __builtin_ctz(bundle_rays));
    const auto of = [&](Floats Packet::*field)
                        RELIT_INLINE_LAMBDA { return of_rays(b, ray, field); };
    const Floats zero = broadcast(0.0f), one = broadcast(1.0f);
    const Floats n = to_floats(step) - of(&Packet::lag), begin = of(&Packet::begin);
    s.slide = of(&Packet::slide) + zero;  // no -0, which would be crossed at once
    s.rise = of(&Packet::rise);
    s.origin = select(n == zero, begin, zero);
    s.z = of(&Packet::z) + ((n + s.origin) - begin) * s.rise;
    s.end = one - s.origin;
    // Rounded: a way may end before it begins.
    if (b.ends) s.end = max(select(n == of(&Packet::last), of(&Packet::end), s.end), zero);
    const Floats x = (of(&Packet::x) + n * s.slide) + s.origin * s.slide, column = floor(x);
    s.x = x - column;
    s.rightward = zero <= s.slide;
    const Ints row = broadcast(b.sign * b.first_row) + broadcast(b.sign) * step;
    const Ints leftmost = to_ints(select(s.rightward, column, column - one));
    store(s.place, row * broadcast(b.grid->pitch) + (columns_of_rays(b, ray) + leftmost));
}

// Heights at the corners of a cell that is crossed between two rows: z10 is the next column's, z01 the
// next row's.
struct Cell {
    Floats z00, z10, z01, z11;
};

RELIT_INLINE Cell select(Mask m, const Cell& a, const Cell& b) {
    return {select(m, a.z00, b.z00), select(m, a.z10, b.z10), select(m, a.z01, b.z01),
            select(m, a.z11, b.z11)};
}

// Part of from <= t <= to that lies inside, all in one cell.
// @param x  where it begins, from the cell's left
template <bool masked>
RELIT_INLINE Floats inside_cell(const Steps& s, const Cell& cell, Floats x, Floats from,
                                Floats to) {
    const Floats across = cell.z10 - cell.z00, twist = (cell.z11 - cell.z01) - across;
    const Floats down = (cell.z01 - cell.z00) + x * twist;
    const Floats a = s.slide * twist;
    const Floats b = s.slide * (across + s.origin * twist) + (down - s.rise);
    const Floats c = (cell.z00 + x * across) + (s.origin * down - s.z);
    if constexpr (!masked) return positive_part(a, b, c, from, to);
    // Texels meet half way.
    const Floats half = broadcast(0.5f);
    const auto part = [&](Floats begin, Floats end) RELIT_INLINE_LAMBDA {
        const Floats middle = half * (begin + end);
        const Mask right = half <= x + middle * s.slide, low = half <= s.origin + middle;
        const Floats nearest =
            select(low, select(right, cell.z11, cell.z01), select(right, cell.z10, cell.z00));
        return select(lowest_bit(nearest), positive_part(a, b, c, begin, end), broadcast(0.0f));
    };
    const Floats column = min(max((half - x) / s.slide, from), to);
    const Floats row = min(max(half - s.origin, from), to);
    const Floats cut1 = min(column, row), cut2 = max(column, row);
    return (part(from, cut1) + part(cut1, cut2)) + part(cut2, to);
}

// Part of each step that lies inside, [0, 1].
template <bool masked>
RELIT_INLINE Floats part_inside(const Bundle& b, const Steps& s) {
    const Floats zero = broadcast(0.0f), one = broadcast(1.0f);
    const Mask right = s.rightward;
    const Floats to_column = (select(right, one, zero) - s.x) / s.slide;
    const Floats crossed = min(max(to_column, zero), s.end);
    Floats upper[3], lower[3];
    load_triples(b.grid->z, s.place, upper);
    load_triples(b.grid->z + b.sign * b.grid->pitch, s.place, lower);
    const Cell left_cell = {upper[0], upper[1], lower[0], lower[1]};
    const Cell right_cell = {upper[1], upper[2], lower[1], lower[2]};
    const Floats next_x = select(right, s.x - one, s.x + one);
    return inside_cell<masked>(s, select(right, left_cell, right_cell), s.x, zero, crossed) +
           inside_cell<masked>(s, select(right, right_cell, left_cell), next_x, crossed, s.end);
}

// Adds pairs of numbers to those of rays, one after the other: a ray may occur twice.
RELIT_INLINE void add_pairs(const int* codes, const float* pairs, int count, float* sums) {
    using Pair = float __attribute__((vector_size(8), aligned(4), may_alias));
    for (int k = 0; k < count; ++k) {
        Pair* const sum = (Pair*)(sums + 2 * (codes[k] & (bundle_rays - 1)));
        *sum += *(const Pair*)(pairs + 2 * k);
    }
}

// Solves for all open steps and forgets them. A step that lies inside all along counts as a whole one,
// and the rest of one as just that, as they do in company that need not solve for them.
template <bool masked>
RELIT_INLINE void solve_open(Bundle& b) {
    if (b.open == 0) return;
    alignas(64) int codes[(most_open_steps + 1) * lanes];
    int* next = codes;
    for (const OpenStep* open = b.open_list; open < b.open_list + b.open; ++open)
        next = append_lanes(next, open->lanes, open->first);
    const int count = int(next - codes);
    store(next, broadcast(next[-1]));  // fills the last register up
    b.open = 0;

    // All of a batch before the next step of the work: numbers come back from memory that their
    // stores have reached by then.
    constexpr int at_once = 8;
    const Floats zero = broadcast(0.0f), one = broadcast(1.0f);
    for (int begin = 0; begin < count; begin += at_once * lanes) {
        const int some = count - begin < at_once * lanes ? count - begin : at_once * lanes;
        Steps steps[at_once];
        alignas(64) float found[2 * at_once * lanes];
        for (int k = 0; k < some; k += lanes) prepare(b, load(codes + begin + k), steps[k / lanes]);
        for (int k = 0; k < some; k += lanes) {
            const Floats end = steps[k / lanes].end;
            const Floats part = part_inside<masked>(b, steps[k / lanes]);
            // Its pieces are rounded.
            const Mask is_all = broadcast(0.9999995f) * end < part;
            const Mask is_whole = is_all & (end == one) & (steps[k / lanes].origin == zero);
            store_pairs(found + 2 * k, select(is_whole, one, zero),
                        select(is_whole, zero, select(is_all, end, part)));
        }
        add_pairs(codes + begin, found, some, b.solved);
    }
}

}  // namespace
}  // namespace relit::kernels
