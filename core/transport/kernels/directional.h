// The inner loops of the directional dipole's sums, once per instruction set. For directional_sum.cpp
// and its parts, which make the lists; nothing else calls them.
//
// Plain data only, no inline functions: what a header defines would be compiled once for each set.
#pragma once

#include <cstddef>

#include "core/transport/kernels/sums.h"

namespace relit::kernels {

/// One colour of scatter::DirectionalDipole in scene units. With e = exp(-sigma_tr d), k = 1 + sigma_tr d
/// and m = (3 k + (sigma_tr d)^2)/d^2 a ray source is
/// e/d (fluence + 1/d^2 (k (ray x.w - turn w.n_o + plain x.n_o) + m turn x.w x.n_o)).
struct DirectionalColour {
    float diffusion = 0, sigma_tr = 0, extrapolation = 0, mirrored = 0;
    float edge = 0, nearest = 0;  ///< squares of edge_step and nearest
    float fluence = 0, ray = 0, turn = 0, plain = 0;
};
inline constexpr int directional_colours = 3;

/// What is summed: S_d itself with the points' normals, or what it is of any normal n near theirs,
/// constant + gradient . n, as four numbers per colour. Pairs with S_d < 0 at the points' own normals
/// count 0 in both.
enum class DirectionalTerms { value, affine };
constexpr int numbers_of(DirectionalTerms terms) {
    return terms == DirectionalTerms::value ? directional_colours : 4 * directional_colours;
}
inline constexpr int max_directional_numbers = 4 * directional_colours;

/// Where S_d bends, for all colours alike: beyond the depth of its real source it goes as 1/r, beyond
/// the height of the virtual one as 1/r^3.
struct DirectionalBend {
    float depth = 0, height = 0;  ///< squares
};

struct DirectionalPoints {
    PointGroup at;
    alignas(64) float normal_x[group_points], normal_y[group_points], normal_z[group_points];
};

/// Floats of a source: x y z, normal, w_12, flux per colour, spread: its area seen from above.
inline constexpr int directional_source_floats = 13;

/// Adds to `sums` [number][point] what the sources give at each point, in the order of the list: of their
/// spread the mean, to second order. Those less than the root of `near` away in the plane give nothing.
using DirectionalGroupSum = void(const DirectionalColour* colours, const DirectionalBend& bend,
                                 DirectionalTerms terms, float near,
                                 const DirectionalPoints& points, const float* sources, int count,
                                 float* sums);
DirectionalGroupSum directional_group_portable;
DirectionalGroupSum directional_group_avx2;
DirectionalGroupSum directional_group_avx512;

/// A part of the cell of the texel `offset` floats away, as seen from a texel.
struct DirectionalTap {
    std::ptrdiff_t offset = 0;
    float x = 0, y = 0;       ///< from there to the texel
    float right = 0, up = 0;  ///< of the cell's centre: height follows its slopes
    float weight = 0;         ///< of its flux
};

/// Numbers of texels in rows, all laid out alike.
struct DirectionalPlanes {
    const float *z, *normal_x, *normal_y, *normal_z, *slope_x, *slope_y;
    const float *inward_x, *inward_y, *inward_z, *flux[directional_colours];
};

/// Adds to `sums` [number][texel, `stride` floats a number] what the taps give at `count` texels from
/// `first` on. Reads, and adds to, up to 15 texels more.
using DirectionalRowSum = void(const DirectionalColour* colours, DirectionalTerms terms,
                               const DirectionalPlanes& planes, std::ptrdiff_t first, int count,
                               const DirectionalTap* taps, int tap_count, float* sums,
                               std::ptrdiff_t stride);
DirectionalRowSum directional_row_portable;
DirectionalRowSum directional_row_avx2;
DirectionalRowSum directional_row_avx512;

}  // namespace relit::kernels
