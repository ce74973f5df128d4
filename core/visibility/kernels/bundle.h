// Packets that are marched together, step by step, as far as a look at the surface where rays cross
// the rows of the grid tells: steps that lie inside from row to row are counted, steps outside
// left. Those that it leaves open, few, are gathered from all packets and solved for by solve.h.
//
// Two passes, each over all rows, and one queue: next to nothing is decided by branches, which
// processors guess wrongly where surfaces are interesting. For steps.h.
#pragma once

#include "core/visibility/kernels/packet.h"

namespace relit::kernels {
namespace {

constexpr int bundle_packets = 4;
constexpr int bundle_rays = bundle_packets * lanes;

// Open steps that are kept until they are solved for: about so many times a register.
constexpr int open_steps = 48, most_open_steps = open_steps + bundle_packets * near_rows;

// An open step of some lanes of a packet.
struct OpenStep {
    int first;       // step, from the bundle's first row, * bundle_rays + the ray of lane 0
    unsigned lanes;  // bit per lane
};

// Packets that cross the rows of one grid the same way.
struct Bundle {
    const Grid* grid;
    int sign;          // of all packets
    int first_row;     // times `sign`: what lags and open steps count from
    bool ends = true;  // some way ends before it is over everything
    int open = 0;      // of open_list
    Packet packets[bundle_packets];
    Floats whole[bundle_packets];  // steps that lie inside
    // Of solved steps: how many are whole, and the parts of others, by ray.
    alignas(64) float solved[2 * bundle_rays];
    OpenStep open_list[most_open_steps];

    RELIT_INLINE void clear() {
        for (Floats& w : whole) w = broadcast(0.0f);
        for (int k = 0; k < 2 * bundle_rays; k += lanes) store(solved + k, broadcast(0.0f));
    }
    // Adds to the parts of packet g. @pre rays that it adds anything for have none yet
    RELIT_INLINE void begin_parts(int g, Floats first) {
        Floats more, parts;
        load_pairs(solved + 2 * lanes * g, more, parts);
        store_pairs(solved + 2 * lanes * g, more, parts + first);
    }
    // Steps that lie inside, of the rays of packet g.
    [[nodiscard]] RELIT_INLINE Floats inside(int g) const {
        Floats more, parts;
        load_pairs(solved + 2 * lanes * g, more, parts);
        return (whole[g] + more) + parts;
    }
};

// Where rays cross a row.
struct Crossing {
    Floats excess;        // of the surface over the ray
    Floats both, either;  // lowest bits: whether both grid points beside it are material, or one
};

RELIT_INLINE Floats step_number(const Stretch& s, int k) { return s.n + broadcast(float(k)); }

// Of row k of a stretch, which is read from the stretch's first column on: by one interpolation along
// the row.
template <bool masked, class Row>
RELIT_INLINE Crossing cross_row(const Packet& p, const Row& row, const Stretch& s, int k) {
    const Floats n = step_number(s, k), x = p.x_at(n), column = floor(x);
    const Ints at = to_ints(column) + (p.column - broadcast(s.left));
    const Ints place = Row::place(at, s.right - s.left);
    const Floats z0 = row(place), z1 = row(place + broadcast(1));
    Crossing c;
    c.excess = (z0 + (x - column) * (z1 - z0)) - p.z_at(n);
    if constexpr (masked) {
        c.both = floats_of_bits(bits_of(z0) & bits_of(z1));
        c.either = floats_of_bits(bits_of(z0) | bits_of(z1));
    }
    return c;
}

// Which lanes a step lies inside for all along, and which it is left open for.
struct Verdict {
    Mask is_whole, is_open;
};

// @param margin  more than the surface leaves the straight line between the rows by
template <bool masked>
RELIT_INLINE Verdict verdict(const Crossing& from, const Crossing& to, Floats margin) {
    Mask is_whole = margin < min(from.excess, to.excess);
    Mask touches_inside = broadcast(0.0f) - margin < max(from.excess, to.excess);
    if constexpr (masked) {
        const auto lowest = [](Ints a)
                                RELIT_INLINE_LAMBDA { return lowest_bit(floats_of_bits(a)); };
        is_whole = is_whole & lowest(bits_of(from.both) & bits_of(to.both));
        touches_inside = touches_inside & lowest(bits_of(from.either) | bits_of(to.either));
    }
    return {is_whole, touches_inside & ~is_whole};
}

// Of a step that ways may begin or end in: it is no whole one for them. What is left of the step that a
// way begins in may lie inside all along.
struct EndVerdict {
    Verdict of_whole;
    Mask is_rest;
};

RELIT_INLINE EndVerdict with_ends(const Packet& p, const Stretch& s, Floats n, Verdict v) {
    const Mask active = s.relevant & (broadcast(0.0f) <= n) & (n <= p.last);
    const Mask begins = n < p.first_whole, ends = p.last_whole < n;
    const Mask is_rest = v.is_whole & active & begins & ~ends & p.row0_on_grid;
    return {
        {v.is_whole & active & ~(begins | ends), (v.is_open | begins | ends) & active & ~is_rest},
        is_rest};
}

// Packet g over a stretch that begins `done` steps after the bundle's first row.
// @param whole_way  no lane begins or ends on it
// @param bend       Bounds::bend of its cells
template <bool masked, bool whole_way, class Row>
RELIT_INLINE void sift_steps(Bundle& b, int g, const Stretch& s, int done, float bend) {
    const Packet& p = b.packets[g];
    const float* const first = b.grid->z + long(s.row) * b.grid->pitch + s.left;
    const long pitch = long(b.sign) * b.grid->pitch;
    Crossing c[near_rows + 1];
    for (int k = 0; k <= s.steps; ++k)
        c[k] = cross_row<masked, Row>(p, Row(first + k * pitch), s, k);
    const Floats margin = magnitude(p.slide) * broadcast(bend) + broadcast(b.grid->rounding);
    Floats whole = b.whole[g], rest = broadcast(0.0f);
    OpenStep* open = b.open_list + b.open;
    for (int k = 0; k < s.steps; ++k) {
        Verdict v = verdict<masked>(c[k], c[k + 1], margin);
        if constexpr (!whole_way) {
            const EndVerdict e = with_ends(p, s, step_number(s, k), v);
            rest = select(e.is_rest, broadcast(1.0f) - p.begin, rest);
            v = e.of_whole;
        }
        whole = select(v.is_whole, whole + broadcast(1.0f), whole);
        // Written always, and kept if it is one.
        *open = {(done + k) * bundle_rays + g * lanes, bits(v.is_open)};
        open += open->lanes != 0;
    }
    b.whole[g] = whole;
    if constexpr (!whole_way) b.begin_parts(g, rest);
    b.open = int(open - b.open_list);
}

template <bool masked>
RELIT_INLINE void sift_stretch(Bundle& b, int g, const Stretch& s, int done, bool whole_way,
                               float bend) {
    if (s.right - s.left + 2 > window_size) sift_steps<masked, false, Gather>(b, g, s, done, bend);
    else if (whole_way) sift_steps<masked, true, Window>(b, g, s, done, bend);
    else sift_steps<masked, false, Window>(b, g, s, done, bend);
}

}  // namespace
}  // namespace relit::kernels
