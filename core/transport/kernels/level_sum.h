// Sums level by level, written once over the wide types of base/wide; each levels_*.cpp compiles it for
// its instruction set. A node's numbers come from its own lane alone: the same bytes for any set.
#pragma once

#include "core/transport/kernels/levels.h"

namespace relit::kernels {
namespace {

// (bits of w >> shift) - first, the last piece at most.
RELIT_INLINE Ints piece_of(const LevelOffset& offset, Floats w) {
    const Ints bits = shifted_right(bits_of(w), offset.shift);
    return min(bits - broadcast(offset.first), broadcast(level_pieces - 1));
}

template <int channels>
RELIT_INLINE void sum_samples(const LevelRows& rows, const LevelOffset& offset) {
    const long away = offset.dy * rows.pitch + offset.dx;
    const Picked32 a0(offset.pieces), b0(offset.pieces + 32), c0(offset.pieces + 64);
    const float* more = offset.pieces + (channels > 1 ? 96 : 0);
    const Picked32 a1(more), b1(more + 32), c1(more + 64);
    if (channels > 1) more += 96;
    const Picked32 a2(more), b2(more + 32), c2(more + 64);
    for (int i = 0; i < rows.columns; i += lanes) {
        const Floats dz = load(rows.z + i) - load(rows.source_z + i + away);
        const Floats w = dz * dz + broadcast(offset.start);
        const Ints at = piece_of(offset, w);
        const auto add = [&](int c, const Picked32& a, const Picked32& b, const Picked32& cc)
                             RELIT_INLINE_LAMBDA {
                                 const Floats value = a(at) + w * (b(at) + w * cc(at));
                                 float* to = rows.sums[0][c] + i;
                                 store(to, load(to) + value * load(rows.sources[0][c] + i + away));
                             };
        add(0, a0, b0, c0);
        if constexpr (channels > 1) {
            add(1, a1, b1, c1);
            add(2, a2, b2, c2);
        }
    }
}

// Second order in heights on both sides.
template <int channels>
RELIT_INLINE void sum_expansions(const LevelRows& rows, const LevelOffset& offset) {
    const long away = offset.dy * rows.pitch + offset.dx;
    for (int channel = 0; channel < channels; ++channel) {
        const float* pieces = offset.pieces + 96 * channel;
        const Picked32 a(pieces), b(pieces + 32), c(pieces + 64);
        const float* q0 = rows.sources[0][channel] + away;
        const float* q1 = rows.sources[1][channel] + away;
        const float* q2 = rows.sources[2][channel] + away;
        float *s0 = rows.sums[0][channel], *s1 = rows.sums[1][channel], *s2 = rows.sums[2][channel];
        for (int i = 0; i < rows.columns; i += lanes) {
            const Floats dz = load(rows.z + i) - load(rows.source_z + i + away);
            const Floats squared = dz * dz;
            const Floats w = squared + broadcast(offset.start);
            const Ints at = piece_of(offset, w);
            const Floats curve = c(at), bent = w * curve;
            const Floats inner = b(at) + bent;
            const Floats value = a(at) + w * inner;
            const Floats slope = inner + bent;  // of the value over w
            const Floats first = (dz + dz) * slope;
            const Floats second = (slope + slope) + broadcast(8.0f) * squared * curve;
            const Floats flux = load(q0 + i), moment = load(q1 + i), half_square = load(q2 + i);
            store(s0 + i, load(s0 + i) + (value * flux - first * moment + second * half_square));
            store(s1 + i, load(s1 + i) + (first * flux - second * moment));
            store(s2 + i, load(s2 + i) + second * flux);
        }
    }
}

RELIT_INLINE void sum_level(const LevelRows& rows, const LevelOffset* offsets, int count,
                            int channels, bool expanded) {
    for (int k = 0; k < count; ++k) {
        if (expanded && channels == 1) sum_expansions<1>(rows, offsets[k]);
        else if (expanded) sum_expansions<3>(rows, offsets[k]);
        else if (channels == 1) sum_samples<1>(rows, offsets[k]);
        else sum_samples<3>(rows, offsets[k]);
    }
}

// Of the cubic through four nodes a quarter on from the second one.
constexpr float near_weights[4] = {-7 / 128.0f, 105 / 128.0f, 35 / 128.0f, -5 / 128.0f};
constexpr float weights_of_fine[8] = {near_weights[3], near_weights[0], near_weights[2],
                                      near_weights[1], near_weights[1], near_weights[2],
                                      near_weights[0], near_weights[3]};

RELIT_INLINE Floats within(Floats value, Floats reach) {
    return max(min(value, reach), broadcast(0.0f) - reach);
}

template <bool has_moments>
RELIT_INLINE void restrict_row(const Restriction& r) {
    const Floats reach = broadcast(r.reach), half = broadcast(0.5f);
    for (int i = 0; i < r.count; i += lanes) {
        Floats sum[3] = {broadcast(0.0f), broadcast(0.0f), broadcast(0.0f)};
        const Floats z = load(r.coarse_z + i);
        for (int k = 0; k < 8; ++k) {
            const Floats rise = within(load(r.fine_z[k] + i) - z, reach);
            const Floats flux = load(r.from[0][k] + i), weight = broadcast(weights_of_fine[k]);
            Floats moment = rise * flux, half_square = half * rise * moment;
            if constexpr (has_moments) {
                const Floats own = load(r.from[1][k] + i);
                half_square = half_square + load(r.from[2][k] + i) + rise * own;
                moment = moment + own;
            }
            sum[0] = sum[0] + weight * flux;
            sum[1] = sum[1] + weight * moment;
            sum[2] = sum[2] + weight * half_square;
        }
        for (int m = 0; m < 3; ++m) store(r.to[m] + i, sum[m]);
    }
}

template <bool has_derivatives>
RELIT_INLINE void prolong_row(const Prolongation& p) {
    const Floats reach = broadcast(p.reach), half = broadcast(0.5f);
    for (int i = 0; i < p.count; i += lanes) {
        Floats sum[3] = {broadcast(0.0f), broadcast(0.0f), broadcast(0.0f)};
        const Floats z = load(p.fine_z + i);
        for (int k = 0; k < 4; ++k) {
            const Floats rise = within(z - load(p.coarse_z[k] + i), reach);
            const Floats weight = broadcast(near_weights[p.is_upper ? k : 3 - k]);
            const Floats first = load(p.from[1][k] + i), second = load(p.from[2][k] + i);
            const Floats bent = rise * second;
            sum[0] = sum[0] + weight * (load(p.from[0][k] + i) + rise * (first + half * bent));
            sum[1] = sum[1] + weight * (first + bent);
            sum[2] = sum[2] + weight * second;
        }
        for (int m = 0; m < (has_derivatives ? 3 : 1); ++m) store(p.to[m] + i, sum[m]);
    }
}

RELIT_INLINE void restrict_any(const Restriction& r) {
    if (r.has_moments) restrict_row<true>(r);
    else restrict_row<false>(r);
}

RELIT_INLINE void prolong_any(const Prolongation& p) {
    if (p.has_derivatives) prolong_row<true>(p);
    else prolong_row<false>(p);
}

RELIT_INLINE void split_any(const float* __restrict from, int count, float* __restrict even,
                            float* __restrict odd) {
    for (int i = 0; i < count; ++i) {
        even[i] = from[2 * i];
        odd[i] = from[2 * i + 1];
    }
}

RELIT_INLINE void join_any(const float* __restrict even, const float* __restrict odd, int count,
                           float* __restrict to) {
    for (int i = 0; i < count; ++i) {
        to[2 * i] = even[i];
        to[2 * i + 1] = odd[i];
    }
}

}  // namespace
}  // namespace relit::kernels
