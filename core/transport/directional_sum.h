// Light that enters a surface and knows where it came from: for every texel of a height map the sum of
// the directional dipole's S_d over all of it. For the renderer, which says what enters and which way
// it goes. Source: specification "translucency", section 3 (b); Frisvad and others 2014.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <stop_token>

#include "core/base/parallel.h"
#include "core/base/simd.h"
#include "core/image/image.h"
#include "core/scatter/directional_dipole.h"
#include "core/transport/transport.h"

namespace relit {

/// Everything that sums for one surface and one material need but the light: made once, used for every
/// light, from any thread.
///
/// S_d is linear in w_12 but for d_r and max(0, S_d), so that light of several lights counts as that of
/// their mean w_12, weighted by flux and not normalised. Three lights 30, 60 and 120 degrees apart: 0.3,
/// 0.6 and 0.9 % (relative RMS) off the sum over them one by one in marble 6 mm wide, at worst 1.3, 2.3
/// and 3.7 % in skin; with the mean at length 1 1.3 to 3 times as much. Diffuse light: 0.8 %.
class DirectionalSum {
public:
    /// @param surface  at least one texel; heights and areas finite
    /// @param slopes   2 channels: dz/dx and dz/dy, y up
    /// @param shading_slopes  the same of what light sees: with a bump map, or `slopes`
    /// @param dipoles  of red, green and blue, in scene units; `robust` for pictures
    /// @throws Error cancelled
    DirectionalSum(const TransportSurface& surface, const Image& slopes,
                   const Image& shading_slopes,
                   const std::array<scatter::DirectionalDipole, 3>& dipoles,
                   TransportAccuracy accuracy, const Executor& executor,
                   const std::stop_token& stop = {}, Simd simd = best_simd());
    ~DirectionalSum();
    DirectionalSum(const DirectionalSum&) = delete;
    DirectionalSum& operator=(const DirectionalSum&) = delete;

    /// Sum over texels p of max(0, S_d(p -> x)) flux(p), for every texel x and three colours; means over
    /// cells where texels are near each other, as RadialKernel has them. Within 0.5 % of the double sum
    /// (relative RMS) as final, 2 % on rough reliefs thinner than a free path.
    ///
    /// @param flux    finite, >= 0: irradiance that enters times area
    /// @param inward  w_12 of the light that enters, into the surface; of several lights the mean weighted
    ///                by flux, shorter than 1. Not read where there is no flux
    /// @return        0 where the surface's area is 0. The same bytes for any number of threads and any
    ///                instruction set
    /// @throws Error cancelled
    [[nodiscard]] Image sum(const Image& flux, const Image& inward, const Executor& executor,
                            const std::stop_token& stop = {}) const;

    [[nodiscard]] std::uint64_t bytes() const;  ///< in memory, for caches

private:
    struct Parts;
    std::unique_ptr<const Parts> parts_;
};

}  // namespace relit
