#include "core/scatter/medium.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "core/scatter/fresnel.h"

namespace relit::scatter {
namespace {

constexpr std::string_view jensen = "Jensen et al. 2001";
constexpr std::string_view narasimhan = "Narasimhan et al. 2006";

// Jensen, Marschner, Levoy, Hanrahan 2001, "A practical model for subsurface light transport",
// table 1: sigma_s' and sigma_a.
constexpr NamedMedium reduced(std::string_view name, std::string_view title,
                              std::array<double, 3> sigma_s_prime, std::array<double, 3> sigma_a,
                              double eta) {
    return {name, title, jensen, {sigma_a, sigma_s_prime, {0, 0, 0}, eta}};
}

// Narasimhan and others 2006, "Acquiring scattering properties of participating media by dilution",
// at full strength: sigma_s, sigma_a, g, in water.
constexpr NamedMedium liquid(std::string_view name, std::string_view title,
                             std::array<double, 3> sigma_s, std::array<double, 3> sigma_a,
                             std::array<double, 3> g) {
    return {name, title, narasimhan, {sigma_a, sigma_s, g, 1.33}};
}

// clang-format off
constexpr NamedMedium media[] = {
    reduced("apple", "Apple", {2.29, 2.39, 1.97}, {0.0030, 0.0034, 0.046}, 1.3),
    reduced("chicken1", "Chicken 1", {0.15, 0.21, 0.38}, {0.015, 0.077, 0.19}, 1.3),
    reduced("chicken2", "Chicken 2", {0.19, 0.25, 0.32}, {0.018, 0.088, 0.20}, 1.3),
    reduced("cream", "Cream", {7.38, 5.47, 3.15}, {0.0002, 0.0028, 0.0163}, 1.3),
    reduced("ketchup", "Ketchup", {0.18, 0.07, 0.03}, {0.061, 0.97, 1.45}, 1.3),
    reduced("marble", "Marble", {2.19, 2.62, 3.00}, {0.0021, 0.0041, 0.0071}, 1.5),
    reduced("potato", "Potato", {0.68, 0.70, 0.55}, {0.0024, 0.0090, 0.12}, 1.3),
    reduced("skim-milk", "Skim milk", {0.70, 1.22, 1.90}, {0.0014, 0.0025, 0.0142}, 1.3),
    reduced("skin1", "Skin 1", {0.74, 0.88, 1.01}, {0.032, 0.17, 0.48}, 1.3),
    reduced("skin2", "Skin 2", {1.09, 1.59, 1.79}, {0.013, 0.070, 0.145}, 1.3),
    reduced("spectralon", "Spectralon", {11.6, 20.4, 14.9}, {0, 0, 0}, 1.3),
    reduced("whole-milk", "Whole milk", {2.55, 3.21, 3.77}, {0.0011, 0.0024, 0.014}, 1.3),
    liquid("chocolate-milk-lowfat", "Chocolate milk, low fat",
           {9.8371, 11.4954, 13.1629}, {0.01150, 0.03680, 0.15640}, {0.934, 0.927, 0.916}),
    liquid("chocolate-milk-regular", "Chocolate milk, regular",
           {10.5685, 13.1416, 15.2202}, {0.01006, 0.04313, 0.14375}, {0.862, 0.838, 0.806}),
    liquid("espresso", "Espresso",
           {7.78262, 8.13050, 8.53875}, {4.79838, 6.57512, 8.84925}, {0.907, 0.896, 0.880}),
    liquid("milk-lowfat", "Milk, low fat",
           {13.1157, 15.4445, 17.9572}, {0.00287, 0.00575, 0.01150}, {0.932, 0.902, 0.859}),
    liquid("milk-reduced", "Milk, reduced fat",
           {13.7335, 15.6003, 17.8007}, {0.00256, 0.00511, 0.01278}, {0.819, 0.797, 0.746}),
    liquid("milk-regular", "Milk, regular",
           {18.2052, 20.3826, 22.3698}, {0.00153, 0.00460, 0.01993}, {0.750, 0.714, 0.681}),
    liquid("soy-milk-regular", "Soy milk, regular",
           {4.66325, 5.20183, 8.74575}, {0.00192, 0.00958, 0.06517}, {0.873, 0.858, 0.832}),
    liquid("white-grapefruit-juice", "White grapefruit juice",
           {0.50499, 0.52742, 0.75282}, {0.01380, 0.01883, 0.05678}, {0.548, 0.545, 0.565}),
};
// clang-format on

}  // namespace

Coefficients channel(const Medium& medium, int c, double scale) {
    return {scale * medium.sigma_a[c], scale * medium.sigma_s[c], medium.g[c], medium.eta};
}

Derived derived(const Coefficients& coefficients) {
    Derived d;
    d.sigma_s_prime = coefficients.sigma_s * (1 - coefficients.g);
    assert(coefficients.sigma_a + d.sigma_s_prime > 0 && coefficients.eta >= 1);
    d.sigma_a = std::max(coefficients.sigma_a, 1e-8 * (coefficients.sigma_a + d.sigma_s_prime));
    d.sigma_t = coefficients.sigma_s + d.sigma_a;
    d.sigma_t_prime = d.sigma_s_prime + d.sigma_a;
    d.alpha_prime = d.sigma_s_prime / d.sigma_t_prime;
    d.albedo = coefficients.sigma_s / d.sigma_t;
    d.diffusion = 1 / (3 * d.sigma_t_prime);
    d.sigma_tr = std::sqrt(3 * d.sigma_a * d.sigma_t_prime);
    d.free_path = 1 / d.sigma_t_prime;
    d.z_r = d.free_path;
    d.a_j = standard_boundary(coefficients.eta);
    d.a_m = moment_boundary(coefficients.eta);
    d.z_v = d.z_r + 4 * d.a_j * d.diffusion;
    d.fdr_int = diffuse_reflectance(coefficients.eta);
    d.fdt_ext = diffuse_transmittance(coefficients.eta);
    const Moments inside = moments(coefficients.eta);
    d.c_phi = c_phi(inside);
    d.c_e = c_e(inside);
    d.c_phi_ext = d.fdt_ext / 4;
    return d;
}

std::span<const NamedMedium> measured_media() { return media; }

const NamedMedium* find_medium(std::string_view name) {
    const auto* found = std::ranges::find(media, name, &NamedMedium::name);
    return found == std::end(media) ? nullptr : found;
}

}  // namespace relit::scatter
