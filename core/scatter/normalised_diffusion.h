// The fast profile of diffusion: two exponentials over the distance, which integrate to the albedo
// and invert in closed form. For the transport of light over a surface, and for sampling.
//
// Source: Christensen and Burley 2015, "Approximate reflectance profiles for efficient subsurface
// scattering"; specification "translucency", section 4.
#pragma once

#include "core/scatter/medium.h"

namespace relit::scatter {

/// What the profile was fitted to, and by which length it is scaled.
enum class DiffusionFit {
    searchlight_mfp,  ///< light at normal incidence, mean free path
    diffuse_mfp,      ///< diffuse illumination, mean free path
    diffuse_dmfp,     ///< diffuse illumination, diffuse mean free path
};

/// s(A): the length that the fit is scaled by, over the d of the profile. @pre 0 <= albedo <= 1
[[nodiscard]] double diffusion_shape(double albedo, DiffusionFit fit);

/// Members as those of every profile (dipole.h).
class NormalisedDiffusion {
public:
    /// @param albedo  A >= 0, of the surface; what total() is
    /// @param d       > 0, the length of the steeper exponential
    NormalisedDiffusion(double albedo, double d) : albedo_(albedo), d_(d) {}

    /// With the albedo of the standard dipole; d = l'/s(A), l' the mean free path of transport.
    /// @pre fit is one of those scaled by a mean free path (asserted)
    explicit NormalisedDiffusion(const Coefficients& coefficients,
                                 DiffusionFit fit = DiffusionFit::searchlight_mfp);

    /// R(r), per unit of area; infinite at 0, as 1/r: sums over cells take within(). @pre r >= 0
    [[nodiscard]] double at(double r) const;
    /// A CDF(a), exact. @pre a >= 0, which may be infinite
    [[nodiscard]] double within(double a) const;
    [[nodiscard]] double total() const { return albedo_; }

    /// The radius within which the share u of all light leaves: CDF(sample(u)) = u, to 1e-12 for
    /// u <= 1 - 1e-9. Infinite at 1. @pre 0 <= u <= 1
    [[nodiscard]] double sample(double u) const;

private:
    double albedo_;
    double d_;
};

}  // namespace relit::scatter
