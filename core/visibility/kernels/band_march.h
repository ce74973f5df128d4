// The elevation-band march, written once over the wide types of shorts_*.h; each bands_*.cpp
// compiles it for its instruction set. What it computes is the same to the last bit for any of them:
// a texel's numbers come from its own lane alone, and samples that are left out add nothing.
//
// The heights along an azimuth are read once and serve the rays of all elevations. Near the start
// they are interpolated, and the share of a step that lies inside is that of a straight line. Farther
// on, steps grow with the distance, heights are means as wide as the steps, texels of 16 bits that
// neighbours read in one load, and a step counts whole or not at all: the errors of many directions
// cancel, while one direction alone would show them.
#pragma once

#include "core/visibility/kernels/bands.h"

namespace relit::kernels {
namespace {

constexpr int parts = band_texels / lanes;              // registers of floats per packet
constexpr int short_parts = band_texels / short_lanes;  // of short integers

// What lies along one azimuth.
struct Profile {
    alignas(64) float near[max_near][band_texels];      // height above the start
    alignas(64) float material[max_near][band_texels];  // share of the step before that has any
    alignas(64) short far[max_far][band_texels];
};

// Rays of a group of bands.
struct GroupRays {
    alignas(64) short start[band_group][band_texels];  // height, carried back to the texel
    alignas(64) short counted[band_group][band_texels];
};

// d of four azimuths at right angles to each other.
struct Cross {
    alignas(64) float d[4][max_bands][band_texels];
};

RELIT_INLINE int clamped(int a, int lo, int hi) { return a < lo ? lo : a > hi ? hi : a; }

// Texel of a level at any place, the border repeated outwards; and 1 where the nearest one is
// material, else 0.
template <bool walled>
RELIT_INLINE Floats interpolated(const BandScenery& s, int level, Floats x, Floats y,
                                 Floats& material) {
    x = max(min(x, broadcast(float(s.width - 1))), broadcast(0.0f));
    y = max(min(y, broadcast(float(s.height - 1))), broadcast(0.0f));
    const Floats column = floor(x), row = floor(y);
    const Floats a = x - column, b = y - row;
    const Ints at = to_ints(row) * broadcast(s.pitch) + to_ints(column);
    const Ints upper = gather_pairs(s.levels[level].texels, at);
    const Ints lower = gather_pairs(s.levels[level].texels, at + broadcast(s.pitch));
    const Floats z00 = to_floats(low_half(upper)), z10 = to_floats(high_half(upper));
    const Floats z01 = to_floats(low_half(lower)), z11 = to_floats(high_half(lower));
    if constexpr (walled) {
        const Floats half = broadcast(0.5f);
        const Mask right = half <= a, low = half <= b;
        const Floats nearest = half * select(low, select(right, z11, z01), select(right, z10, z00));
        material = broadcast(2.0f) * (nearest - floor(nearest));  // whether it is odd
    }
    const Floats above = z00 + a * (z10 - z00), below = z01 + a * (z11 - z01);
    return above + b * (below - above);
}

// Texels along an axis to where the map begins and ends.
struct OnMap {
    Floats begin, end;
    RELIT_INLINE void clip(Floats at, float speed, int size) {
        if (speed == 0) return;
        const Floats inverse = broadcast(1 / speed);
        const Floats to_first = (broadcast(-0.5f) - at) * inverse;
        const Floats to_last = (broadcast(float(size) - 0.5f) - at) * inverse;
        begin = max(begin, min(to_first, to_last));
        end = min(end, max(to_first, to_last));
    }
    // Of the step that ends at u.
    RELIT_INLINE Floats share(float u, float step) const {
        const Floats on_map = min(end, broadcast(u)) - max(begin, broadcast(u - step));
        return max(on_map * broadcast(1 / step), broadcast(0.0f));
    }
};

template <bool walled>
RELIT_INLINE void look_near(const BandScenery& s, const BandPacket& packet, const Azimuth& azimuth,
                            int samples, Profile& profile) {
    for (int part = 0; part < parts; ++part) {
        const int first = part * lanes;
        const Floats x = load(packet.x + first), y = load(packet.y + first);
        const Floats start = load(packet.z + first) - broadcast(s.lowest - s.height_unit);
        OnMap on_map{broadcast(0.0f), broadcast(1e9f)};
        on_map.clip(x, azimuth.x, s.width);
        on_map.clip(y, -azimuth.y, s.height);
        Floats before = broadcast(0.0f);
        for (int k = 0; k <= samples; ++k) {
            const float u = s.near[k].distance;
            Floats material;
            const Floats texel =
                interpolated<walled>(s, s.near[k].level, x + broadcast(u * azimuth.x),
                                     y - broadcast(u * azimuth.y), material);
            store(profile.near[k] + first, texel * broadcast(s.height_unit) - start);
            if constexpr (walled) {
                store(profile.material[k] + first,
                      broadcast(0.5f) * (before + material) * on_map.share(u, s.near[k].step));
                before = material;
            }
        }
    }
}

RELIT_INLINE void look_far(const BandScenery& s, const BandPacket& packet, const Azimuth& azimuth,
                           int samples, Profile& profile) {
    for (int k = 0; k < samples; ++k) {
        const FarSample& sample = azimuth.far[k];
        const int row = clamped(packet.row + sample.dy, -level_rows_around, s.height + 1);
        const int column = clamped(packet.column + sample.dx, -level_margin, s.width);
        const unsigned short* texels =
            s.levels[sample.level].texels + (long(row) * s.pitch + column);
        for (int part = 0; part < short_parts; ++part)
            store(profile.far[k] + part * short_lanes,
                  load_marked_quarters(texels + part * short_lanes));
    }
}

// A height as it changes from sample to sample: what of it is positive, and its size.
struct Excess {
    Floats positive, size;
    RELIT_INLINE Excess() = default;
    RELIT_INLINE explicit Excess(Floats e)
        : positive(max(e, broadcast(0.0f))), size(magnitude(e)) {}
};

// Share of a step on which a straight line from one to the other is positive.
RELIT_INLINE Floats positive_share(const Excess& a, const Excess& b) {
    return (a.positive + b.positive) / max(a.size + b.size, broadcast(1e-30f));
}

// Texels of the way of `band_group` bands that lie inside near the start. Where a step leaves the
// material, half of it is taken to lie on either side.
template <bool downwards, bool walled>
RELIT_INLINE void march_near(const BandScenery& s, const BandPacket& packet, const Azimuth& azimuth,
                             const Profile& profile, int first_band, int samples, int first,
                             Floats (&inside)[band_group]) {
    constexpr bool ground = walled && !downwards;  // there may be some beyond the material
    const Floats zero = broadcast(0.0f);
    const Floats z = load(packet.z + first);
    const Floats above_floor = z - broadcast(s.floor), below_ground = broadcast(s.lowest) - z;
    Excess e[band_group], f[band_group], g[band_group];
    for (int b = 0; b < band_group; ++b) {
        inside[b] = zero;
        e[b] = Excess(load(profile.near[0] + first));
        if constexpr (downwards) f[b] = Excess(above_floor);
        if constexpr (ground) g[b] = Excess(below_ground);
    }
    for (int k = 1; k <= samples; ++k) {
        const Floats height = load(profile.near[k] + first);
        const Floats step = broadcast(s.near[k].step);
        Floats material;
        if constexpr (walled) material = load(profile.material[k] + first);
        for (int b = 0; b < band_group; ++b) {
            const Floats rise = broadcast(s.near_rises[first_band + b][k]);
            const Excess next(downwards ? height + rise : height - rise);
            Floats share = positive_share(e[b], next);
            e[b] = next;
            if constexpr (downwards) {
                const Excess next_floor(above_floor - rise);
                share = min(share, positive_share(f[b], next_floor));
                f[b] = next_floor;
            }
            if constexpr (walled) share = material * share;
            if constexpr (ground) {
                const Excess next_ground(below_ground - rise);
                share = share + (broadcast(1.0f) - material) * positive_share(g[b], next_ground);
                g[b] = next_ground;
            }
            inside[b] = inside[b] + step * share;
        }
    }
    // Here the way is counted from the start, farther on from its texel.
    const Floats overlap = load(packet.right + first) * broadcast(azimuth.x) +
                           load(packet.up + first) * broadcast(azimuth.y);
    for (int b = 0; b < band_group; ++b) {
        Mask goes_on = zero < e[b].positive;
        if constexpr (downwards) goes_on = goes_on & (zero < f[b].positive);
        if constexpr (walled)
            goes_on = goes_on & (broadcast(0.5f) < load(profile.material[samples] + first));
        inside[b] = inside[b] - select(goes_on, overlap, zero);
    }
}

// Heights at which rays of the bands would have passed their own texels, in far heights.
template <bool downwards>
RELIT_INLINE void carry_back(const BandScenery& s, const BandPacket& packet, const Azimuth& azimuth,
                             int first_band, GroupRays& rays) {
    const Floats unit = broadcast(1 / (4 * s.height_unit));
    for (int part = 0; part < parts; ++part) {
        const int first = part * lanes;
        const Floats z = load(packet.z + first) - broadcast(s.lowest);
        const Floats ahead = load(packet.right + first) * broadcast(azimuth.x) +
                             load(packet.up + first) * broadcast(azimuth.y);
        for (int b = 0; b < band_group; ++b) {
            const float slope = s.band[first_band + b].slope;
            const Floats rise = ahead * broadcast(downwards ? -slope : slope);
            const Floats start =
                max(min((z - rise) * unit, broadcast(16400.0f)), broadcast(-15000.0f));
            store_shorts(rays.start[b] + first, to_ints(floor(start)));
        }
    }
}

// Units of the way farther on that lie inside.
template <bool downwards>
RELIT_INLINE void march_far(const BandScenery& s, const Azimuth& azimuth, const Profile& profile,
                            int first_band, int samples, GroupRays& rays) {
    const short* rises = azimuth.rises + ((downwards ? s.bands : 0) + first_band) * s.far_samples;
    const Shorts beneath_floor = broadcast_short(-1);
    for (int part = 0; part < short_parts; ++part) {
        const int first = part * short_lanes;
        Shorts start[band_group], counted[band_group];
        for (int b = 0; b < band_group; ++b) {
            start[b] = load(rays.start[b] + first);
            counted[b] = broadcast_short(0);
        }
        for (int k = 0; k < samples; ++k) {
            const Shorts height = load(profile.far[k] + first);
            const Shorts step = broadcast_short(azimuth.far[k].step);
            for (int b = 0; b < band_group; ++b) {
                const Shorts rise = broadcast_short(rises[b * s.far_samples + k]);
                if constexpr (downwards) {
                    const Shorts ray = start[b] + rise;
                    counted[b] =
                        add_where((height > ray) & (ray > beneath_floor), counted[b], step);
                } else {
                    counted[b] = add_where(height - rise > start[b], counted[b], step);
                }
            }
        }
        for (int b = 0; b < band_group; ++b) store(rays.counted[b] + first, counted[b]);
    }
}

// e to the power of -x. @pre x >= 0
RELIT_INLINE Floats decay(Floats x) {
    const Floats y = min(x * broadcast(1.44269504f), broadcast(126.0f));
    const Floats whole = floor(y);
    const Floats t = (whole - y) * broadcast(0.69314718f);  // (-ln 2, 0]
    // Taylor: the remainder is below 2e-7.
    constexpr float coefficients[] = {1 / 720.0f, 1 / 120.0f, 1 / 24.0f, 1 / 6.0f,
                                      0.5f,       1.0f,       1.0f};
    Floats sum = broadcast(1 / 5040.0f);
    for (const float c : coefficients) sum = sum * t + broadcast(c);
    return sum * power_of_two(broadcast(0) - to_ints(whole));
}

RELIT_INLINE Floats illumination(const BandScenery& s, Floats r) {
    const Floats depth = broadcast(s.depth);
    if (!s.exponential) return min(depth / r, broadcast(1.0f));
    return decay(max(r - depth, broadcast(0.0f)) * broadcast(s.attenuation));
}

// d of every band towards one azimuth.
template <bool downwards, bool walled>
RELIT_INLINE void march_azimuth(const BandScenery& s, const BandPacket& packet,
                                const Azimuth& azimuth, const Profile& profile,
                                float (&d)[max_bands][band_texels]) {
    GroupRays rays;
    for (int group = 0; group * band_group < s.bands; ++group) {
        const int first_band = group * band_group;
        carry_back<downwards>(s, packet, azimuth, first_band, rays);
        march_far<downwards>(s, azimuth, profile, first_band, packet.far_samples[downwards][group],
                             rays);
        for (int part = 0; part < parts; ++part) {
            const int first = part * lanes;
            Floats inside[band_group];
            march_near<downwards, walled>(s, packet, azimuth, profile, first_band,
                                          packet.near_samples[downwards][group], first, inside);
            for (int b = 0; b < band_group; ++b) {
                const Floats far = to_floats(load_unsigned(rays.counted[b] + first));
                const Floats r = (inside[b] + far * broadcast(s.far_unit)) *
                                 broadcast(s.band[first_band + b].stretch);
                store(d[first_band + b] + first, illumination(s, r));
            }
        }
    }
}

// d of the four azimuths of a cross, put together so that the orders of the functions that treat
// them alike share a sum: the multiples of 4, the other even ones, and for the odd ones two.
RELIT_INLINE void combine_cross(const BandScenery& s, Cross& cross) {
    for (int b = 0; b < s.bands; ++b)
        for (int first = 0; first < band_texels; first += lanes) {
            const Floats d0 = load(cross.d[0][b] + first), d1 = load(cross.d[1][b] + first);
            const Floats d2 = load(cross.d[2][b] + first), d3 = load(cross.d[3][b] + first);
            store(cross.d[0][b] + first, (d0 + d2) + (d1 + d3));
            store(cross.d[1][b] + first, d0 - d2);
            store(cross.d[2][b] + first, (d0 + d2) - (d1 + d3));
            store(cross.d[3][b] + first, d1 - d3);
        }
}

RELIT_INLINE Floats radial_sum(const BandScenery& s, const Radial& radial, const Cross& cross,
                               int source, int first) {
    Floats sum = broadcast(0.0f);
    for (int b = 0; b < s.bands; ++b)
        sum = sum + broadcast(radial.of_band[b]) * load(cross.d[source][b] + first);
    return sum;
}

RELIT_INLINE void add(float* to, Floats a) { store(to, load(to) + a); }

// Adds the cross to the projection.
// @param cosines, sines  of the orders, at the first of its azimuths
RELIT_INLINE void project_cross(const BandScenery& s, const float* cosines, const float* sines,
                                const Cross& cross, float* out) {
    for (int n = 0; n < s.radials; ++n) {
        const int m = s.radial[n].order;
        const Floats c = broadcast(cosines[m]), i = broadcast(sines[m]);
        for (int first = 0; first < band_texels; first += lanes) {
            float* cosine_sum = out + first;
            float* sine_sum = out + band_texels + first;
            if (m % 2 == 0) {
                const Floats all = radial_sum(s, s.radial[n], cross, m % 4, first);
                add(cosine_sum, m == 0 ? all : c * all);
                if (m > 0) add(sine_sum, i * all);
            } else {
                const Floats a = radial_sum(s, s.radial[n], cross, 1, first);
                const Floats b = radial_sum(s, s.radial[n], cross, 3, first);
                add(cosine_sum, m % 4 == 1 ? c * a - i * b : c * a + i * b);
                add(sine_sum, m % 4 == 1 ? i * a + c * b : i * a - c * b);
            }
        }
        out += band_texels * (m == 0 ? 1 : 2);
    }
}

template <class Count>
RELIT_INLINE int most(const Count (&of_half)[2][max_bands / band_group], const BandScenery& s) {
    int most = 0;
    for (int half = 0; half < (s.has_lower_half ? 2 : 1); ++half)
        for (int group = 0; group * band_group < s.bands; ++group)
            most = of_half[half][group] > most ? of_half[half][group] : most;
    return most;
}

template <bool walled>
RELIT_INLINE void project_packet(const BandScenery& s, const BandPacket& packet, float* out) {
    int functions = 0;
    for (int n = 0; n < s.radials; ++n) functions += s.radial[n].order == 0 ? 1 : 2;
    const int near = most(packet.near_samples, s), far = most(packet.far_samples, s);
    const int halves = s.has_lower_half ? 2 : 1;
    for (int k = 0; k < halves * functions * band_texels; ++k) out[k] = 0;
    Profile profile;
    Cross cross[2];
    for (int a = 0; a < s.azimuths / 4; ++a) {
        for (int quarter = 0; quarter < 4; ++quarter) {
            const Azimuth& azimuth = s.azimuth[a + quarter * (s.azimuths / 4)];
            look_near<walled>(s, packet, azimuth, near, profile);
            look_far(s, packet, azimuth, far, profile);
            march_azimuth<false, walled>(s, packet, azimuth, profile, cross[0].d[quarter]);
            if (s.has_lower_half)
                march_azimuth<true, walled>(s, packet, azimuth, profile, cross[1].d[quarter]);
        }
        for (int half = 0; half < halves; ++half) {
            combine_cross(s, cross[half]);
            project_cross(s, s.cosines + a * (max_degree + 1), s.sines + a * (max_degree + 1),
                          cross[half], out + half * functions * band_texels);
        }
    }
}

void project_bands(const BandScenery& s, const BandPacket& packet, float* out) {
    if (packet.walled) project_packet<true>(s, packet, out);
    else project_packet<false>(s, packet, out);
}

void sum_products(const short* block, int pairs, const short* weights, int* out) {
    constexpr int registers = block_texels / lanes;
    for (int r = 0; r < registers; ++r) {
        Ints sums[3] = {broadcast(0), broadcast(0), broadcast(0)};
        for (int pair = 0; pair < pairs; ++pair) {
            const short* place = block + (pair * registers + r) * short_lanes;
            __builtin_prefetch(place + 2 * pairs * registers * short_lanes);  // memory is the limit
            const Shorts numbers = load(place);
            for (int c = 0; c < 3; ++c)
                sums[c] = sums[c] +
                          sums_of_products(numbers, broadcast_pair(weights + (pair * 3 + c) * 2));
        }
        for (int c = 0; c < 3; ++c) store(out + c * block_texels + r * lanes, sums[c]);
    }
}

}  // namespace
}  // namespace relit::kernels
