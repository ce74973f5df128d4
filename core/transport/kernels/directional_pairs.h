// Sums of the directional dipole, written once over the wide types of base/wide; each directional_*.cpp
// compiles it for its instruction set. A point's numbers come from its own lane alone, and roots and
// exponentials are made of sums and products: the same bytes for any set.
#pragma once

#include "core/transport/kernels/directional.h"

namespace relit::kernels {
namespace {

struct Vector {
    Floats x, y, z;
};
RELIT_INLINE Floats dot(Vector a, Vector b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

// 1 / sqrt(a), to 5e-6 of it. @pre 1e-36 <= a <= 1e36
RELIT_INLINE Floats inverse_root(Floats a) {
    const Floats half = broadcast(0.5f) * a, three_halves = broadcast(1.5f);
    Floats root = floats_of_bits(broadcast(0x5f375a86) - shifted_right(bits_of(a), 1));
    root = root * (three_halves - half * root * root);
    return root * (three_halves - half * root * root);
}

// e^-a, to 3e-6 of it; 1e-38 where it is less. @pre a >= 0
RELIT_INLINE Floats falling(Floats a) {
    const Floats power = max(a * broadcast(-1.44269504f), broadcast(-126.0f));
    const Floats whole = floor(power + broadcast(0.5f));
    const Floats f = power - whole;  // 2^f by its series
    constexpr float terms[] = {1.33335581e-3f, 9.61812911e-3f, 5.55041087e-2f,
                               2.40226507e-1f, 6.93147181e-1f, 1.0f};
    Floats sum = broadcast(terms[0]);
    for (int n = 1; n < 6; ++n) sum = sum * f + broadcast(terms[n]);
    return sum * floats_of_bits(shifted_left<23>(to_ints(whole) + broadcast(127)));
}

// S' as constant + facing * w.n_o + outward * x.n_o.
struct RaySource {
    Floats constant, facing, outward;

    RELIT_INLINE RaySource(const DirectionalColour& of, Floats along, Floats squared_distance) {
        const Floats inverse = inverse_root(squared_distance), square = inverse * inverse;
        const Floats sd = broadcast(of.sigma_tr) * (squared_distance * inverse);
        const Floats k = broadcast(1.0f) + sd;
        const Floats m = (broadcast(3.0f) * k + sd * sd) * square;
        const Floats scale = falling(sd) * inverse, inner = scale * square;
        const Floats turn = broadcast(of.turn);
        constant = scale * (broadcast(of.fluence) + square * (k * (broadcast(of.ray) * along)));
        facing = broadcast(0.0f) - inner * (k * turn);
        outward = inner * (k * broadcast(of.plain) + m * (turn * along));
    }
};

// Places that light enters at, one a lane.
struct Entries {
    Vector normal, inward;
    Floats flux[directional_colours];
};

// RayPair of core/scatter, all colours' numbers.
struct WidePair {
    Vector x, normal, inward;  // of the entry
    Floats r2, along, outward, facing, across, down, agreement;
    Floats in_plane, scale;  // n* = scale (normal - in_plane x)

    // x  from the entries to the points; not 0
    RELIT_INLINE WidePair(const Entries& entries, Vector difference, Vector exit_normal)
        : x(difference), normal(entries.normal), inward(entries.inward) {
        r2 = dot(x, x);
        along = dot(x, inward);
        outward = dot(x, exit_normal);
        facing = dot(inward, exit_normal);
        across = max(r2 - along * along, broadcast(0.0f));
        const Floats lift = dot(normal, x);
        in_plane = lift / r2;
        // Where x is all but parallel to the normal n* is shorter, in no certain direction.
        scale = inverse_root(max(broadcast(1.0f) - lift * in_plane, broadcast(1e-6f)));
        down = scale * (dot(normal, inward) - in_plane * along);
        agreement = scale * (dot(normal, exit_normal) - in_plane * outward);
    }

    RELIT_INLINE Floats real_distance(const DirectionalColour& of) const {
        const Floats extrapolation = broadcast(of.extrapolation);
        const Floats product = across * (r2 + extrapolation * extrapolation);
        const Floats cosine = across * inverse_root(max(product, broadcast(1e-36f)));
        const Floats step = broadcast(of.diffusion) * (broadcast(0.0f) - facing);
        const Floats lit = step * (step + broadcast(2.0f) * extrapolation * cosine);
        const Floats added = select(facing < broadcast(0.0f), lit, broadcast(of.edge));
        return max(r2 + added, broadcast(of.nearest));
    }
};

template <DirectionalTerms terms>
RELIT_INLINE void add_pairs(const DirectionalColour* colours, const WidePair& pair,
                            const Floats (&flux)[directional_colours], Floats* sums) {
    const Floats none = broadcast(0.0f), two = broadcast(2.0f);
    for (int c = 0; c < directional_colours; ++c) {
        const DirectionalColour& of = colours[c];
        const Floats mirrored = broadcast(of.mirrored);
        const RaySource real(of, pair.along, pair.real_distance(of));
        const RaySource virt(of, pair.along + mirrored * pair.down, pair.r2 + mirrored * mirrored);
        const Floats constant = real.constant - virt.constant;
        const Floats facing = real.facing - virt.facing;
        const Floats outward = real.outward - virt.outward;
        const Floats star = two * pair.down * virt.facing + mirrored * virt.outward;
        const Floats s_d =
            constant + facing * pair.facing + outward * pair.outward + star * pair.agreement;
        if constexpr (terms == DirectionalTerms::value) {
            sums[c] = sums[c] + max(s_d, none) * flux[c];
        } else {
            const Floats share = select(none < s_d, flux[c], none);
            const Floats by_normal = star * pair.scale;
            const Floats by_x = outward - by_normal * pair.in_plane;
            const auto gradient = [&](Floats x, Floats inward, Floats normal) RELIT_INLINE_LAMBDA {
                return share * (by_x * x + facing * inward + by_normal * normal);
            };
            sums[4 * c] = sums[4 * c] + share * constant;
            sums[4 * c + 1] = sums[4 * c + 1] + gradient(pair.x.x, pair.inward.x, pair.normal.x);
            sums[4 * c + 2] = sums[4 * c + 2] + gradient(pair.x.y, pair.inward.y, pair.normal.y);
            sums[4 * c + 3] = sums[4 * c + 3] + gradient(pair.x.z, pair.inward.z, pair.normal.z);
        }
    }
}

RELIT_INLINE Vector broadcast_vector(const float* v) {
    return {broadcast(v[0]), broadcast(v[1]), broadcast(v[2])};
}

// Of sources of some area: the mean of S_d over it beside S_d of its middle, 1 + area/24 times the
// Laplacian of S_d over S_d. For 1/root(r^2 + depth) - 1/root(r^2 + height), which exp(-sigma_tr r) bends
// by some 1.4 sigma_tr^2 more.
RELIT_INLINE void spread_out(const DirectionalColour* colours, const DirectionalBend& bend,
                             Floats r2, Floats area, Floats (&flux)[directional_colours]) {
    const Floats one = broadcast(1.0f), depth = broadcast(bend.depth);
    const Floats deep = one / (r2 + depth), high = one / (r2 + broadcast(1.6f * bend.height));
    const Floats laplacian = (r2 - broadcast(2.0f) * depth) * deep * deep + broadcast(8.0f) * high;
    const Floats share = broadcast(1.0f / 24) * area;
    for (int c = 0; c < directional_colours; ++c) {
        const Floats s = broadcast(colours[c].sigma_tr);
        const Floats more = share * (laplacian + broadcast(1.4f) * s * s);
        flux[c] = flux[c] * (one + min(more, one));
    }
}

template <DirectionalTerms terms>
RELIT_INLINE void sum_points(const DirectionalColour* colours, const DirectionalBend& bend,
                             float near, const DirectionalPoints& points, int first,
                             const float* sources, int count, float* sums) {
    constexpr int numbers = numbers_of(terms);
    const Vector at{load(points.at.x + first), load(points.at.y + first),
                    load(points.at.z + first)};
    const Vector normal{load(points.normal_x + first), load(points.normal_y + first),
                        load(points.normal_z + first)};
    const Floats none = broadcast(0.0f);
    Floats sum[numbers];
    for (int n = 0; n < numbers; ++n) sum[n] = load(sums + n * group_points + first);
    for (int k = 0; k < count; ++k, sources += directional_source_floats) {
        Vector x{at.x - broadcast(sources[0]), at.y - broadcast(sources[1]),
                 at.z - broadcast(sources[2])};
        const Mask is_near = x.x * x.x + x.y * x.y < broadcast(near);
        x.x = select(is_near, broadcast(1.0f), x.x);
        Entries entries{broadcast_vector(sources + 3), broadcast_vector(sources + 6), {}};
        for (int c = 0; c < directional_colours; ++c)
            entries.flux[c] = select(is_near, none, broadcast(sources[9 + c]));
        const WidePair pair(entries, x, normal);
        spread_out(colours, bend, pair.r2, broadcast(sources[12]), entries.flux);
        add_pairs<terms>(colours, pair, entries.flux, sum);
    }
    for (int n = 0; n < numbers; ++n) store(sums + n * group_points + first, sum[n]);
}

RELIT_INLINE void directional_group(const DirectionalColour* colours, const DirectionalBend& bend,
                                    DirectionalTerms terms, float near,
                                    const DirectionalPoints& points, const float* sources,
                                    int count, float* sums) {
    for (int first = 0; first < group_points; first += lanes)
        if (terms == DirectionalTerms::value)
            sum_points<DirectionalTerms::value>(colours, bend, near, points, first, sources, count,
                                                sums);
        else
            sum_points<DirectionalTerms::affine>(colours, bend, near, points, first, sources, count,
                                                 sums);
}

template <DirectionalTerms terms>
RELIT_INLINE void sum_taps(const DirectionalColour* colours, const DirectionalPlanes& planes,
                           std::ptrdiff_t at, const DirectionalTap* taps, int tap_count,
                           float* sums, std::ptrdiff_t stride) {
    constexpr int numbers = numbers_of(terms);
    const Floats z = load(planes.z + at);
    const Vector normal{load(planes.normal_x + at), load(planes.normal_y + at),
                        load(planes.normal_z + at)};
    Floats sum[numbers];
    for (int n = 0; n < numbers; ++n) sum[n] = load(sums + n * stride);
    for (int k = 0; k < tap_count; ++k) {
        const DirectionalTap& tap = taps[k];
        const std::ptrdiff_t from = at + tap.offset;
        const Floats lift = load(planes.slope_x + from) * broadcast(tap.right) +
                            load(planes.slope_y + from) * broadcast(tap.up);
        const Vector x{broadcast(tap.x), broadcast(tap.y), z - (load(planes.z + from) + lift)};
        Entries entries{{load(planes.normal_x + from), load(planes.normal_y + from),
                         load(planes.normal_z + from)},
                        {load(planes.inward_x + from), load(planes.inward_y + from),
                         load(planes.inward_z + from)},
                        {}};
        for (int c = 0; c < directional_colours; ++c)
            entries.flux[c] = broadcast(tap.weight) * load(planes.flux[c] + from);
        add_pairs<terms>(colours, WidePair(entries, x, normal), entries.flux, sum);
    }
    for (int n = 0; n < numbers; ++n) store(sums + n * stride, sum[n]);
}

RELIT_INLINE void directional_row(const DirectionalColour* colours, DirectionalTerms terms,
                                  const DirectionalPlanes& planes, std::ptrdiff_t first, int count,
                                  const DirectionalTap* taps, int tap_count, float* sums,
                                  std::ptrdiff_t stride) {
    for (int k = 0; k < count; k += lanes)
        if (terms == DirectionalTerms::value)
            sum_taps<DirectionalTerms::value>(colours, planes, first + k, taps, tap_count, sums + k,
                                              stride);
        else
            sum_taps<DirectionalTerms::affine>(colours, planes, first + k, taps, tap_count,
                                               sums + k, stride);
}

}  // namespace
}  // namespace relit::kernels
