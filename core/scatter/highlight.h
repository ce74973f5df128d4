// Highlights from below the surface: what a lobe gives at one point, carried to others by
// e^{-sigma r}. For the transport of highlights over a surface and for sampling them.
//
// Source: Yu, Liu, Hu 2019, "A highlight-generation method for rendering translucent objects",
// section 3; specification "translucency", sections 5.2 and 5.3.
#pragma once

#include <cmath>
#include <numbers>

namespace relit::scatter {

/// e^{-sigma r}, with the members of every profile (dipole.h).
/// @pre sigma > 0 for total(); >= 0 for the others
struct HighlightFalloff {
    double sigma = 0;  ///< extinction, 1/length

    [[nodiscard]] double at(double r) const { return std::exp(-sigma * r); }
    [[nodiscard]] double within(double a) const;
    [[nodiscard]] double total() const { return 2 * std::numbers::pi / (sigma * sigma); }

    /// What the sum is multiplied by for a number without unit that tends to the local highlight
    /// as sigma grows: sigma^2/(2 pi).
    [[nodiscard]] double normalisation() const { return sigma * sigma / (2 * std::numbers::pi); }

    /// How far from x_o to sample, on a plane: density sigma^2 e^{-sigma rho}/(2 pi) per area.
    /// @param u1, u2  uniform in (0, 1]
    [[nodiscard]] double sample(double u1, double u2) const { return -std::log(u1 * u2) / sigma; }

    /// What a sample found along `axis` at distance r weighs: e^{-sigma r} over its density per
    /// area of the surface. Constant on a plane.
    /// @param rho        distance in the plane, as sampled
    /// @param r          distance in space
    /// @param axis_cosine  |n . axis| where it was found, > 0
    [[nodiscard]] double weight(double rho, double r, double axis_cosine) const {
        return std::exp(-sigma * (r - rho)) / (normalisation() * axis_cosine);
    }
};

inline double HighlightFalloff::within(double a) const {
    const double x = sigma * a;
    if (x < 1e-3)  // the series of 1 - (1 + x) e^-x, which cancels here
        return std::numbers::pi * a * a * (1 - x * (2.0 / 3 - x * (0.25 - x / 15)));
    if (std::isinf(x)) return total();
    return total() * (-std::expm1(-x) - x * std::exp(-x));
}

}  // namespace relit::scatter
