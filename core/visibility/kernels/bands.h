// The elevation-band march: d of 32 neighbouring texels towards a grid of directions, and its
// projection on a few functions, once per instruction set. For sky_transfer.cpp, which makes the
// tables and checks the numbers; nothing else calls it.
//
// As in march.h: plain data only, no inline functions.
#pragma once

namespace relit::kernels {

/// Texels of a row that are marched together.
inline constexpr int band_texels = 32;
/// Bands that are marched together; the number of bands is a multiple of it.
inline constexpr int band_group = 4;
// Upper ends of what BandScenery counts.
inline constexpr int max_levels = 12, max_bands = 16, max_near = 40, max_far = 112;
inline constexpr int max_directions = 128;  // azimuths
inline constexpr int max_degree = 10;       // of the functions
inline constexpr int max_radials = 36;      // with max_degree
inline constexpr int max_functions = 66;    // of one half of the sphere

/// A map of heights, smoothed so far as a level asks for: 16 bits from the scenery's lowest height
/// to its highest, the lowest bit set where there is material. The border is repeated outwards,
/// without material.
struct BandLevel {
    const unsigned short* texels = nullptr;  ///< texel (0, 0)
};
/// Columns and rows repeated around a level.
inline constexpr int level_margin = 40, level_rows_around = 2;

/// Where the way is looked at near its start, texels from it; the way in between is straight.
struct NearSample {
    float distance = 0;
    float step = 1;  ///< from the sample before
    int level = 0;
};

/// Where it is looked at farther on: whole texels from the start's own.
struct FarSample {
    int dx = 0, dy = 0;  ///< columns and rows
    int level = 0;
    short step = 0;  ///< what it stands for, in units of BandScenery::far_unit
};

/// One azimuth: the texels of its far samples, and by how much a ray of each band has risen there,
/// in far heights.
struct Azimuth {
    float x = 0, y = 0;  ///< unit, y upwards
    const FarSample* far = nullptr;
    const short* rises = nullptr;  ///< [band][far_samples] of the upper half, then of the lower
};

/// Rays of one elevation.
struct Band {
    float slope = 0;    ///< rise per texel, of the upper half; the lower half's are negated
    float stretch = 0;  ///< length of the way per texel
};

/// A function of the projection is a radial one times cos(m azimuth) and, for m > 0, another one
/// times sin(m azimuth).
struct Radial {
    int order = 0;               ///< m
    float of_band[max_bands]{};  ///< with the weight of the band's directions
};

/// All that the texels of a map have in common. Lengths are in texels.
struct BandScenery {
    BandLevel levels[max_levels];
    int pitch = 0;              ///< texels from row to row
    int width = 0, height = 0;  ///< of the map
    /// Height of material = lowest + height_unit * (texel - 1). Without it the solid ends at `lowest`.
    float lowest = 0, height_unit = 0;
    float floor = 0;              ///< where material ends below; with `has_lower_half`
    bool has_lower_half = false;  ///< light from below is asked for as well
    bool exponential = false;
    float depth = 0, attenuation = 0;
    int bands = 0, near_samples = 0, far_samples = 0;
    NearSample near[max_near];                ///< the first one at distance 0
    float near_rises[max_bands][max_near]{};  ///< of rays of the upper half
    float far_unit = 0;                       ///< texels
    Band band[max_bands];                     ///< flattest first
    int azimuths = 0;  ///< a multiple of 4; those a quarter of them on are a right angle on
    const Azimuth* azimuth = nullptr;
    int radials = 0;
    Radial radial[max_radials];
    const float* cosines = nullptr;  ///< [azimuth][order], and sines alike
    const float* sines = nullptr;
};

/// 32 neighbours of a row and how far their ways are worth looking at: beyond, nothing is inside.
struct BandPacket {
    int column = 0, row = 0;  ///< of the first one
    bool walled = false;      ///< some of the near samples may lie beyond the material
    /// Starts: columns and rows as texels have them, heights.
    float x[band_texels], y[band_texels], z[band_texels];
    /// By how much the start lies to the right of its texel, and up.
    float right[band_texels], up[band_texels];
    /// Samples that count, per half of the sphere and group of bands; of the near ones at least 1.
    int near_samples[2][max_bands / band_group];
    int far_samples[2][max_bands / band_group];
};

/// Projects d of the packet's texels: `band_texels` numbers per function into `out`, functions in
/// the order of the radials, cosine before sine, the upper half before the lower.
using Bands = void(const BandScenery& scenery, const BandPacket& packet, float* out);

Bands bands_portable;
Bands bands_avx2;
Bands bands_avx512;

/// Texels that projections are kept for together, as pairs of functions: for each pair the two
/// numbers of one texel after the other.
inline constexpr int block_texels = 16;

/// Products of sums: for each texel of `block` and each of three colours the sum over all functions
/// of projection times weight. Whole numbers, so that they are the same in any order.
/// @param weights  [pair][colour][2]
/// @param out      [colour][texel]
/// @pre  no sum is beyond an int
using LightBlock = void(const short* block, int pairs, const short* weights, int* out);

LightBlock light_block_portable;
LightBlock light_block_avx2;
LightBlock light_block_avx512;

}  // namespace relit::kernels
