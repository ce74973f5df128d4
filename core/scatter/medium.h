// What a translucent material is made of: coefficients of absorption and scattering, all that the
// diffusion models derive from them, and tables of measured media. For scatter/ and what lists or
// renders them.
//
// Source: specification "translucency", section 1.
#pragma once

#include <array>
#include <span>
#include <string_view>

namespace relit::scatter {

/// Of red, green and blue. @pre as Coefficients, for each of them
struct Medium {
    std::array<double, 3> sigma_a{};  ///< absorption, 1/mm
    std::array<double, 3> sigma_s{};  ///< scattering, 1/mm
    std::array<double, 3> g{};        ///< mean cosine of the phase function
    double eta = 1.3;                 ///< index of refraction inside over outside

    friend bool operator==(const Medium&, const Medium&) = default;
};

/// Of one colour, in inverses of any unit of length; all lengths that follow are in that unit.
/// @pre finite; sigma_a, sigma_s >= 0; sigma_a + sigma_s (1 - g) > 0; -1 < g < 1; eta >= 1
struct Coefficients {
    double sigma_a = 0;
    double sigma_s = 0;
    double g = 0;
    double eta = 1.3;
};

/// Of colour c (0 red, 1 green, 2 blue) in another unit of length.
/// @param scale  millimetres in that unit; the width of a scene in mm for scene units
[[nodiscard]] Coefficients channel(const Medium& medium, int c, double scale = 1);

/// What follows from coefficients, by the specification's letters.
struct Derived {
    double sigma_a = 0;        ///< as given, at least 1e-8 sigma_t_prime
    double sigma_s_prime = 0;  ///< reduced scattering sigma_s (1 - g)
    double sigma_t = 0;        ///< extinction
    double sigma_t_prime = 0;  ///< reduced extinction
    double alpha_prime = 0;    ///< reduced albedo
    double albedo = 0;         ///< W = sigma_s / sigma_t, of single scattering
    double diffusion = 0;      ///< D = 1 / (3 sigma_t')
    double sigma_tr = 0;       ///< effective transport coefficient sqrt(sigma_a / D)
    double free_path = 0;      ///< l' = 1 / sigma_t'
    double z_r = 0;            ///< depth of the real source, l'
    double z_v = 0;            ///< height of the virtual source, z_r + 4 A_j D
    double a_j = 1;            ///< boundary of the standard dipole
    double a_m = 1;            ///< boundary of the better and the directional dipole
    double fdr_int = 0;        ///< F_dr(eta), diffuse light from inside that is reflected
    double fdt_ext = 1;        ///< F_dt, diffuse light from outside that enters
    double c_phi = 0;          ///< C_phi(eta)
    double c_e = 0;            ///< C_E(eta)
    double c_phi_ext = 0;      ///< C_phi(1/eta) = F_dt/4
};

[[nodiscard]] Derived derived(const Coefficients& coefficients);

struct NamedMedium {
    std::string_view name;   ///< in kebab-case, as "skim-milk"
    std::string_view title;  ///< for people, as "Skim milk"
    std::string_view source;
    Medium medium;
};

/// Media that were measured, by source and then by name. Those of Jensen and others have
/// sigma_s' in place of sigma_s, and g = 0.
[[nodiscard]] std::span<const NamedMedium> measured_media();

/// @return nullptr when there is none of that name
[[nodiscard]] const NamedMedium* find_medium(std::string_view name);

}  // namespace relit::scatter
