// Diffuse reflectance of a half space by two point sources, as a function of distance: the standard
// dipole and the better one, and the BSSRDF that either makes. For the transport of light over a
// surface, which sums them.
//
// Every profile of scatter/ has the same three members: at(r), the light that leaves per area at
// distance r from where 1 enters; within(a), its integral over a disc of radius a, exact; and
// total(), over the plane. Constants are derived once, in double.
#pragma once

#include "core/scatter/medium.h"

namespace relit::scatter {

/// Jensen, Marschner, Levoy, Hanrahan 2001, equation 4; specification "translucency", section 2.
class StandardDipole {
public:
    explicit StandardDipole(const Coefficients& coefficients);

    /// R_d(r), per unit of area; finite at 0, falls with r, 0 where sigma_tr r > 80. @pre r >= 0
    [[nodiscard]] double at(double r) const;
    /// P(a), in [0, total()]. @pre a >= 0, which may be infinite
    [[nodiscard]] double within(double a) const;
    [[nodiscard]] double total() const;

private:
    double alpha_prime_;
    double sigma_tr_;
    double z_r_;
    double z_v_;
};

/// d'Eon 2012, "A better dipole": the same cost, closer at low albedo. Specification
/// "translucency", section 2; the integral over a disc from the same antiderivatives.
class BetterDipole {
public:
    explicit BetterDipole(const Coefficients& coefficients);

    /// R(r), per unit of area; finite at 0, 0 where sigma_tr r > 80. @pre r >= 0
    [[nodiscard]] double at(double r) const;
    /// In [0, total()]. @pre a >= 0, which may be infinite
    [[nodiscard]] double within(double a) const;
    [[nodiscard]] double total() const;

private:
    double squared_albedo_;  // alpha'^2
    double diffusion_;       // D_g = (2 sigma_a + sigma_s')/(3 sigma_t'^2), of Grosjean
    double sigma_tr_;
    double z_r_;
    double z_v_;
    double c_phi_;
    double c_e_;
};

/// How light that reached the surface from below is spread over directions.
enum class ExitNormalisation {
    transmittance,  ///< T(cos_o)/(pi F_dt): all of it leaves
    jensen2001,     ///< T(cos_o)/pi, as printed there; loses 6 to 9 %
    reflectance,    ///< T(cos_o)/(pi F_dr), a published slip; 2.1 times too bright at eta 1.3
};

/// What T(cos_o) M_o is multiplied by for the radiance that leaves, 1/sr.
[[nodiscard]] double exit_factor(ExitNormalisation normalisation, double eta);

/// S(x_i, w_i; x_o, w_o) = T(cos_i) R T(cos_o) exit_factor; 0 from or to behind the surface.
/// Jensen and others 2001, equation 5.
/// @param profile  R at the distance of the two points, by any of the profiles
[[nodiscard]] double bssrdf(double profile, double cos_i, double cos_o, double eta,
                            ExitNormalisation normalisation = ExitNormalisation::transmittance);

}  // namespace relit::scatter
