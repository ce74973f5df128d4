#include "core/scatter/normalised_diffusion.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/scatter/dipole.h"

namespace relit::scatter {

double diffusion_shape(double albedo, DiffusionFit fit) {
    const double from = albedo - 0.8;
    switch (fit) {
        case DiffusionFit::searchlight_mfp:
            return 1.85 - albedo + 7 * std::abs(from * from * from);
        case DiffusionFit::diffuse_mfp:
            return 1.9 - albedo + 3.5 * from * from;
        case DiffusionFit::diffuse_dmfp:
            break;
    }
    const double squared = (albedo - 0.33) * (albedo - 0.33);
    return 3.5 + 100 * squared * squared;
}

NormalisedDiffusion::NormalisedDiffusion(const Coefficients& coefficients, DiffusionFit fit)
    : albedo_(StandardDipole(coefficients).total()),
      d_(derived(coefficients).free_path / diffusion_shape(albedo_, fit)) {
    assert(fit != DiffusionFit::diffuse_dmfp);
}

double NormalisedDiffusion::at(double r) const {
    if (r == 0) return std::numeric_limits<double>::infinity();
    return albedo_ * (std::exp(-r / d_) + std::exp(-r / (3 * d_))) /
           (8 * std::numbers::pi * d_ * r);
}

double NormalisedDiffusion::within(double a) const {
    return -albedo_ * (std::expm1(-a / d_) + 3 * std::expm1(-a / (3 * d_))) / 4;
}

double NormalisedDiffusion::sample(double u) const {
    // The root of y^3 + 3 y = 2 k with y = e^{-r/(3 d)}.
    const double k = 2 * (1 - u);
    return std::max(0.0, -3 * d_ * std::log(2 * std::sinh(std::asinh(k) / 3)));
}

}  // namespace relit::scatter
