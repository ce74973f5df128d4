// Surfaces to sum over, and the sum itself as it is written: every texel to every texel, in double.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <vector>

#include "core/scatter/dipole.h"
#include "core/scatter/highlight.h"
#include "core/transport/transport.h"
#include "tests/support/maps.h"

namespace relit::test {

/// z(i, j) in scene units as a surface; areas from central differences.
template <class Height>
TransportSurface surface_of(int width, int height, const Height& z) {
    TransportSurface surface{Image(width, height, 1), Image(width, height, 1)};
    for (int j = 0; j < height; ++j)
        for (int i = 0; i < width; ++i) surface.z.at(i, j) = float(z(i, j));
    const double h = surface.spacing();
    const auto slope = [&](double below, double above, int steps) {
        return steps > 0 ? (above - below) / (steps * h) : 0.0;
    };
    for (int j = 0; j < height; ++j)
        for (int i = 0; i < width; ++i) {
            const int i0 = std::max(i - 1, 0), i1 = std::min(i + 1, width - 1);
            const int j0 = std::max(j - 1, 0), j1 = std::min(j + 1, height - 1);
            const double x = slope(surface.z.at(i0, j), surface.z.at(i1, j), i1 - i0);
            const double y = slope(surface.z.at(i, j0), surface.z.at(i, j1), j1 - j0);
            surface.area.at(i, j) = float(h * h * std::sqrt(1 + x * x + y * y));
        }
    return surface;
}

/// relief * heights of a map; what its mask takes out has no area.
inline TransportSurface surface_of(const HeightField& field, double relief) {
    TransportSurface surface = surface_of(field.width(), field.height(), [&](int i, int j) {
        return relief * field.heights.at(i, j);
    });
    for (int j = 0; j < field.height(); ++j)
        for (int i = 0; i < field.width(); ++i)
            if (!field.is_solid(i, j)) surface.area.at(i, j) = 0;
    return surface;
}

/// Standard dipoles of a measured medium, red, green and blue.
inline std::vector<RadialProfile> dipoles(const char* medium, double mm_per_width) {
    std::vector<RadialProfile> profiles;
    profiles.reserve(3);
    for (int c = 0; c < 3; ++c)
        profiles.push_back(radial_profile(scatter::StandardDipole(
            channel(scatter::find_medium(medium)->medium, c, mm_per_width))));
    return profiles;
}

/// e^{-sigma r}, of one channel.
inline RadialProfile highlight_profile(double sigma) {
    return radial_profile(scatter::HighlightFalloff{sigma});
}

inline RadialKernel kernel_for(const TransportSurface& surface,
                               const std::vector<RadialProfile>& profiles) {
    return RadialKernel(profiles, surface.spacing(), surface.extent());
}

/// Flux of a light that reaches the surface at a low angle, with hard shadows as a checkerboard of
/// unequal squares throws them; of another colour per channel.
inline Image uneven_flux(const TransportSurface& surface, int channels = 3) {
    Image flux(surface.width(), surface.height(), channels);
    for (int j = 0; j < flux.height; ++j)
        for (int i = 0; i < flux.width; ++i) {
            const double x = (i + 0.5) * surface.spacing(), y = (j + 0.5) * surface.spacing();
            const bool is_lit = (int(x * 7 + y) + int(y * 5)) % 2 == 0;
            for (int c = 0; c < channels; ++c)
                flux.at(i, j, c) =
                    surface.area.at(i, j) * float(is_lit ? 0.6 + 0.3 * std::sin(9 * x + c) : 0.05);
        }
    return flux;
}

/// The sums at texel (i, j) of all channels.
inline std::array<double, RadialKernel::max_channels> direct_sum(const TransportSurface& surface,
                                                                 const Image& flux,
                                                                 const RadialKernel& kernel, int i,
                                                                 int j) {
    std::array<double, RadialKernel::max_channels> sums{};
    if (!(surface.area.at(i, j) > 0)) return sums;
    const double h = surface.spacing(), z = surface.z.at(i, j);
    const double range_squared = kernel.range() * kernel.range();
    const std::span<const float> segments = kernel.segments();
    for (int c = 0; c < flux.channels; ++c)
        sums[c] = kernel.at_own_place(c, surface.area.at(i, j)) * flux.at(i, j, c);
    for (int v = 0; v < flux.height; ++v)
        for (int u = 0; u < flux.width; ++u) {
            if (!(surface.area.at(u, v) > 0)) continue;
            const double dx = h * (u - i), dy = h * (v - j), dz = surface.z.at(u, v) - z;
            const double r_squared = dx * dx + dy * dy + dz * dz;
            if (r_squared > range_squared) continue;
            const auto u2 = float(r_squared);
            const float* const of = &segments[std::size_t(kernel.index_of(u2)) * kernel.stride];
            for (int c = 0; c < flux.channels; ++c)
                sums[c] += (of[c] + of[4 + c] * u2) * flux.at(u, v, c);
        }
    return sums;
}

inline Image direct_sums(const TransportSurface& surface, const Image& flux,
                         const RadialKernel& kernel) {
    Image sums(flux.width, flux.height, flux.channels);
    parallel_rows(executor(), flux.height, {}, [&](RowRange rows) {
        for (int j = rows.begin; j < rows.end; ++j)
            for (int i = 0; i < flux.width; ++i) {
                const auto exact = direct_sum(surface, flux, kernel, i, j);
                for (int c = 0; c < flux.channels; ++c) sums.at(i, j, c) = float(exact[c]);
            }
    });
    return sums;
}

/// A quarter turn, and left for right.
inline Image turned(const Image& image) {
    Image out(image.height, image.width, image.channels);
    for (int j = 0; j < image.height; ++j)
        for (int i = 0; i < image.width; ++i)
            for (int c = 0; c < image.channels; ++c)
                out.at(j, image.width - 1 - i, c) = image.at(i, j, c);
    return out;
}
inline Image mirrored(const Image& image) {
    Image out(image.width, image.height, image.channels);
    for (int j = 0; j < image.height; ++j)
        for (int i = 0; i < image.width; ++i)
            for (int c = 0; c < image.channels; ++c)
                out.at(image.width - 1 - i, j, c) = image.at(i, j, c);
    return out;
}

/// Errors relative to each texel's own exact sum, where that is above 1e-4 of the largest one.
struct RelativeError {
    double rms = 0, max = 0;
};

/// Of the numbers of all channels together.
inline RelativeError relative_error(std::span<const float> found, std::span<const float> exact) {
    float largest = 0;
    for (const float e : exact) largest = std::max(largest, e);
    double squares = 0, max = 0;
    std::size_t count = 0;
    for (std::size_t k = 0; k < exact.size(); ++k) {
        if (!(exact[k] > 1e-4f * largest)) continue;
        const double error = std::abs(double(found[k]) - exact[k]) / exact[k];
        squares += error * error;
        max = std::max(max, error);
        ++count;
    }
    return {count > 0 ? std::sqrt(squares / double(count)) : 0, max};
}

/// Of three channels against the double sum, at random texels.
inline RelativeError error_at_random_texels(const TransportSurface& surface, const Image& flux,
                                            const RadialKernel& kernel, const Image& sums,
                                            int texels) {
    std::vector<float> some(3 * std::size_t(texels)), exact(some.size());
    parallel_rows(executor(), texels, {}, [&](RowRange range) {
        for (int k = range.begin; k < range.end; ++k) {
            Random random(std::uint64_t(k) + 1);
            const int i = int(random() * flux.width), j = int(random() * flux.height);
            const auto at = direct_sum(surface, flux, kernel, i, j);
            for (int c = 0; c < 3; ++c) {
                some[3 * std::size_t(k) + c] = sums.at(i, j, c);
                exact[3 * std::size_t(k) + c] = float(at[c]);
            }
        }
    });
    return relative_error(some, exact);
}

}  // namespace relit::test
