#include "core/scatter/dipole.h"

#include <cmath>
#include <numbers>

#include "core/scatter/fresnel.h"

namespace relit::scatter {
namespace {

constexpr double pi = std::numbers::pi;

constexpr double underflow = 80;  // e^-80 is nothing, and floats cannot hold much less

// Of a source at height z with falloff s, at distance d = sqrt(r^2 + z^2) and per 4 pi: its flux
// through the surface and its fluence.
double flux(double z, double s, double r) {
    const double d = std::hypot(r, z);
    return z * (1 + s * d) * std::exp(-s * d) / (d * d * d);
}

double fluence(double z, double s, double r) {
    const double d = std::hypot(r, z);
    return std::exp(-s * d) / d;
}

// hypot(a, z) - z without the loss where a is small.
double further(double z, double a) { return std::isinf(a) ? a : a * a / (std::hypot(a, z) + z); }

// Their integrals over a disc, per 2 pi: e^{-s z} - z e^{-s d}/d and (e^{-s z} - e^{-s d})/s.
double flux_within(double z, double s, double a) {
    const double by = further(z, a), share = z / (z + by);
    const double rest = std::isinf(by) ? 1 : by / (z + by);
    return std::exp(-s * z) * (rest - share * std::expm1(-s * by));
}

double fluence_within(double z, double s, double a) {
    return -std::exp(-s * z) * std::expm1(-s * further(z, a)) / s;
}

}  // namespace

StandardDipole::StandardDipole(const Coefficients& coefficients) {
    const Derived d = derived(coefficients);
    alpha_prime_ = d.alpha_prime;
    sigma_tr_ = d.sigma_tr;
    z_r_ = d.z_r;
    z_v_ = d.z_v;
}

double StandardDipole::at(double r) const {
    if (sigma_tr_ * r > underflow) return 0;
    return alpha_prime_ / (4 * pi) * (flux(z_r_, sigma_tr_, r) + flux(z_v_, sigma_tr_, r));
}

double StandardDipole::within(double a) const {
    return alpha_prime_ / 2 * (flux_within(z_r_, sigma_tr_, a) + flux_within(z_v_, sigma_tr_, a));
}

double StandardDipole::total() const {
    return alpha_prime_ / 2 * (std::exp(-sigma_tr_ * z_r_) + std::exp(-sigma_tr_ * z_v_));
}

BetterDipole::BetterDipole(const Coefficients& coefficients) {
    const Derived d = derived(coefficients);
    squared_albedo_ = d.alpha_prime * d.alpha_prime;
    diffusion_ = (2 * d.sigma_a + d.sigma_s_prime) / (3 * d.sigma_t_prime * d.sigma_t_prime);
    sigma_tr_ = std::sqrt(d.sigma_a / diffusion_);
    z_r_ = d.z_r;
    z_v_ = z_r_ + 4 * d.a_m * diffusion_;
    c_phi_ = d.c_phi;
    c_e_ = d.c_e;
}

double BetterDipole::at(double r) const {
    if (sigma_tr_ * r > underflow) return 0;
    const double from_fluence = fluence(z_r_, sigma_tr_, r) - fluence(z_v_, sigma_tr_, r);
    const double from_flux = flux(z_r_, sigma_tr_, r) + flux(z_v_, sigma_tr_, r);
    return squared_albedo_ / (4 * pi) * (c_phi_ * from_fluence / diffusion_ + c_e_ * from_flux);
}

double BetterDipole::within(double a) const {
    const double from_fluence =
        fluence_within(z_r_, sigma_tr_, a) - fluence_within(z_v_, sigma_tr_, a);
    const double from_flux = flux_within(z_r_, sigma_tr_, a) + flux_within(z_v_, sigma_tr_, a);
    return squared_albedo_ / 2 * (c_phi_ * from_fluence / diffusion_ + c_e_ * from_flux);
}

double BetterDipole::total() const {
    const double real = std::exp(-sigma_tr_ * z_r_);
    const double apart = -std::expm1(-sigma_tr_ * (z_v_ - z_r_));  // 1 - e^{-s (z_v - z_r)}
    return squared_albedo_ / 2 *
           (c_phi_ * real * apart / (diffusion_ * sigma_tr_) + c_e_ * real * (2 - apart));
}

double exit_factor(ExitNormalisation normalisation, double eta) {
    switch (normalisation) {
        case ExitNormalisation::transmittance:
            return 1 / (pi * diffuse_transmittance(eta));
        case ExitNormalisation::reflectance:
            return 1 / (pi * diffuse_reflectance(eta));
        case ExitNormalisation::jensen2001:
            break;
    }
    return 1 / pi;
}

double bssrdf(double profile, double cos_i, double cos_o, double eta,
              ExitNormalisation normalisation) {
    return transmittance(cos_i, eta) * profile * transmittance(cos_o, eta) *
           exit_factor(normalisation, eta);
}

}  // namespace relit::scatter
