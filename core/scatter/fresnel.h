// What a smooth boundary between two dielectrics reflects, bends and lets through: Fresnel's
// reflectance, its moments over the hemisphere, and the boundary constants of the diffusion models
// that follow from them. For the profiles, the thin layer and the lobes of scatter/.
//
// eta is always the index of the medium that light enters over that of the one it comes from.
// Sources: d'Eon and Irving 2011, "A quantized-diffusion model for rendering translucent
// materials" (moments); Egan and Hilgeman 1979 (older fits, as in Jensen and others 2001);
// specification "translucency", section 1.
#pragma once

#include <algorithm>
#include <cmath>

#include "core/base/vec.h"

namespace relit::scatter {

/// Media whose indices differ by less have no boundary: F = 0, moments 0, A = 1.
inline constexpr double no_boundary = 1e-4;

/// F, the reflectance of unpolarised light.
/// @param cosine  of the angle between the ray and the normal; 0 and below count as grazing, F = 1
/// @param eta     n_t / n_i > 0; below 1 there is total reflection
inline double fresnel(double cosine, double eta) {
    if (std::abs(eta - 1) < no_boundary) return 0;
    const double c = std::clamp(cosine, 0.0, 1.0);
    const double squared_sine = (1 - c * c) / (eta * eta);
    if (squared_sine >= 1) return 1;
    const double inside = std::sqrt(1 - squared_sine);
    const double rs = (c - eta * inside) / (c + eta * inside);
    const double rp = (eta * c - inside) / (eta * c + inside);
    return 0.5 * (rs * rs + rp * rp);
}

/// T = 1 - F; 0 for rays from behind the surface.
inline double transmittance(double cosine, double eta) {
    return cosine > 0 ? 1 - fresnel(cosine, eta) : 0;
}

/// Schlick 1994, with F0 = ((eta - 1)/(eta + 1))^2. @pre 0 <= cosine <= 1
inline double schlick(double cosine, double eta) {
    const double f0 = (eta - 1) / (eta + 1) * ((eta - 1) / (eta + 1));
    const double rest = 1 - cosine;
    return f0 + (1 - f0) * (rest * rest) * (rest * rest) * rest;
}

/// mu', the cosine beyond the boundary of a ray with `cosine` before it; 0 where it is reflected
/// totally.
inline double refracted_cosine(double cosine, double eta) {
    return std::sqrt(std::max(0.0, 1 - (1 - cosine * cosine) / (eta * eta)));
}

/// w_12, where light from `to_light` goes below the surface: into the medium, of length 1.
/// @param to_light, normal  unit vectors, on the same side of the surface
/// @pre eta >= 1
inline Vec3 refracted(Vec3 to_light, Vec3 normal, double eta) {
    const double cosine = dot(to_light, normal);
    return (-1 / eta) * to_light + (cosine / eta - refracted_cosine(cosine, eta)) * normal;
}

/// C_k(n) = integral of F mu^k over mu in [0, 1], for light that arrives from inside a medium whose
/// index relative to what lies beyond is n (n < 1: from the thinner side).
struct Moments {
    double c1 = 0;
    double c2 = 0;
};

/// Polynomials of d'Eon and Irving 2011. C_1 is within 0.5 % for n and 1/n in [1.2, 2], C_2 within
/// 1 % from 1.3 on and 2 % from 1.2 on; at 1.05 it is 12 % off.
[[nodiscard]] Moments fitted_moments(double n);

/// By quadrature, to 1e-8 of the values. @pre n > 0
[[nodiscard]] Moments exact_moments(double n);

/// The fits where they are good, quadrature elsewhere, 0 without a boundary.
[[nodiscard]] Moments moments(double n);

/// C_phi = (1 - 2 C_1)/4 and C_E = (1 - 3 C_2)/2, what fluence and flux weigh in the light that
/// leaves (d'Eon and Irving 2011).
inline double c_phi(Moments m) { return (1 - 2 * m.c1) / 4; }
inline double c_e(Moments m) { return (1 - 3 * m.c2) / 2; }

/// F_dr by the older fits (Egan and Hilgeman), from inside for n >= 1, from outside for n < 1.
/// The same quantity as 2 C_1.
[[nodiscard]] double fitted_diffuse_reflectance(double n);

/// F_dr as the standard dipole takes it: the older fits up to indices of 2, quadrature beyond,
/// where they would pass 1; 0 without a boundary.
[[nodiscard]] double diffuse_reflectance(double n);

/// F_dt = 1 - 2 C_1(1/eta): the share of diffuse light from outside that enters.
[[nodiscard]] double diffuse_transmittance(double eta);

/// A_j = (1 + F_dr)/(1 - F_dr), of the standard dipole as published (Jensen and others 2001).
[[nodiscard]] double standard_boundary(double eta);

/// A_m = (1 + 3 C_2)/(1 - 2 C_1), of the better and the directional dipole (d'Eon 2012).
[[nodiscard]] double moment_boundary(double eta);

}  // namespace relit::scatter
