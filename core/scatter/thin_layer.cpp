#include "core/scatter/thin_layer.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/base/hemisphere.h"
#include "core/scatter/fresnel.h"

namespace relit::scatter {
namespace {

constexpr double pi = std::numbers::pi;

constexpr LayerPreset presets[] = {
    {"epidermis", {.sigma_a = 3.8, .sigma_s = 50.0, .g = 0.79, .eta = 1.4}, 0.01, 0.1},
    {"dermis", {.sigma_a = 0.3, .sigma_s = 21.7, .g = 0.81, .eta = 1.4}, 0.6, 3},
};

// A direction outside, at one of the boundaries, and what it is inside.
struct Crossing {
    double let_through = 0;  // T
    double inside = 0;       // mu'
};

Crossing crossing(double cosine, double eta) {
    const double inside = refracted_cosine(cosine, eta);
    return {inside > 0 ? transmittance(cosine, eta) : 0, inside};
}

double literal(const ThinLayer& layer, double cos_i) {
    return layer.hk_literal ? transmittance(cos_i, layer.eta) : 1;
}

// (1 - e^{-tau (1/mu_i' + 1/mu_r')})/(mu_i' + mu_r')
double depth_reflected(double tau, double mu_i, double mu_r) {
    return -std::expm1(-tau * (1 / mu_i + 1 / mu_r)) / (mu_i + mu_r);
}

// (e^{-tau/mu_i'} - e^{-tau/mu_t'})/(mu_i' - mu_t'), without its loss where the cosines meet.
double depth_transmitted(double tau, double mu_i, double mu_t) {
    const double apart = mu_i - mu_t;
    if (tau / std::max(mu_i, mu_t) > 700) return 0;
    if (std::abs(apart) < 1e-6) {
        const double mu = 0.5 * (mu_i + mu_t);
        return tau * std::exp(-tau / mu) / (mu * mu);
    }
    const double argument = tau * (apart / (mu_i * mu_t));  // tau (1/mu_t' - 1/mu_i')
    if (std::abs(argument) < 0.1) return std::exp(-tau / mu_t) * std::expm1(argument) / apart;
    return (std::exp(-tau / mu_i) - std::exp(-tau / mu_t)) / apart;
}

// f_r1 and f_t1 without the phase function.
double reflected_factor(const ThinLayer& layer, double cos_i, double cos_r) {
    const Crossing in = crossing(cos_i, layer.eta), out = crossing(cos_r, layer.eta);
    const double through = in.let_through * out.let_through * literal(layer, cos_i);
    if (through <= 0) return 0;
    return through * layer.albedo * depth_reflected(layer.tau, in.inside, out.inside) /
           (layer.eta * layer.eta);
}

double transmitted_factor(const ThinLayer& layer, double cos_i, double cos_t) {
    const double relative = layer.eta / layer.eta_below;
    const Crossing in = crossing(cos_i, layer.eta), out = crossing(cos_t, relative);
    const double through = in.let_through * out.let_through * literal(layer, cos_i);
    if (through <= 0) return 0;
    return through * layer.albedo * depth_transmitted(layer.tau, in.inside, out.inside) /
           (relative * relative);
}

double sine(double cosine) { return std::sqrt(std::max(0.0, 1 - cosine * cosine)); }

// Mean of the phase function over the azimuth between a ray with cosine `in` and one with cosine
// `out`, both inside and along the axis: a complete elliptic integral,
// integral_0^pi (a - b cos phi)^{-3/2} dphi = 2 E(k)/((a - b) sqrt(a + b)), k^2 = 2 b/(a + b).
double mean_phase(double in, double out, double g) {
    const double a = 1 + g * g - 2 * g * in * out;
    const double b = 2 * std::abs(g) * sine(in) * sine(out);
    const double least = std::max(a - b, (1 - std::abs(g)) * (1 - std::abs(g)));
    const double k = std::sqrt(std::clamp(2 * b / (a + b), 0.0, 1.0));
    return (1 - g * g) / (2 * pi * pi) * std::comp_ellint_2(k) / (least * std::sqrt(a + b));
}

const std::vector<hemisphere::Node>& nodes() {
    static const auto all = hemisphere::nodes(128);
    return all;
}

double reflected_share(const ThinLayer& layer, double cos_i) {
    const double in = refracted_cosine(cos_i, layer.eta);
    double sum = 0;
    for (const hemisphere::Node& node : nodes())
        sum += node.weight * node.z * reflected_factor(layer, cos_i, node.z) *
               mean_phase(in, -refracted_cosine(node.z, layer.eta), layer.g);
    return 2 * pi * sum;
}

// Over the cosine on the side of the lower boundary where all cosines go through: outside unless
// what is below is denser than the layer. mu' dmu' (layer) = (n_3/eta)^2 mu dmu (below).
double transmitted_share(const ThinLayer& layer, double cos_i) {
    const double in = refracted_cosine(cos_i, layer.eta);
    const double relative = layer.eta / layer.eta_below;
    double sum = 0;
    for (const hemisphere::Node& node : nodes()) {
        const bool outside = relative >= 1;
        const double cos_t = outside ? node.z : refracted_cosine(node.z, 1 / relative);
        const double inside = outside ? refracted_cosine(node.z, relative) : node.z;
        const double jacobian = outside ? 1 : relative * relative;
        sum += node.weight * jacobian * node.z * transmitted_factor(layer, cos_i, cos_t) *
               mean_phase(in, inside, layer.g);
    }
    return 2 * pi * sum;
}

}  // namespace

double henyey_greenstein(double cosine, double g) {
    const double base = 1 + g * g - 2 * g * cosine;
    return (1 - g * g) / (4 * pi * base * std::sqrt(base));
}

ThinLayer thin_layer(const Coefficients& coefficients, double thickness, double eta_below) {
    const double sigma_t = coefficients.sigma_a + coefficients.sigma_s;
    return {.tau = sigma_t * thickness,
            .albedo = coefficients.sigma_s / sigma_t,
            .g = coefficients.g,
            .eta = coefficients.eta,
            .eta_below = eta_below};
}

double reflected(const ThinLayer& layer, Vec3 w_i, Vec3 w_o) {
    if (w_i.z <= 0 || w_o.z <= 0) return 0;
    const double inside = refracted_cosine(w_i.z, layer.eta) * refracted_cosine(w_o.z, layer.eta);
    const double flat = (w_i.x * w_o.x + w_i.y * w_o.y) / (layer.eta * layer.eta);
    return reflected_factor(layer, w_i.z, w_o.z) * henyey_greenstein(-inside - flat, layer.g);
}

double transmitted(const ThinLayer& layer, Vec3 w_i, Vec3 w_o) {
    if (w_i.z <= 0 || w_o.z >= 0) return 0;
    const double relative = layer.eta / layer.eta_below;
    const double inside = refracted_cosine(w_i.z, layer.eta) * refracted_cosine(-w_o.z, relative);
    const double flat = (w_i.x * w_o.x + w_i.y * w_o.y) / (layer.eta * relative);
    const double cos_j = std::clamp(inside - flat, -1.0, 1.0);  // flat: no direction inside
    return transmitted_factor(layer, w_i.z, -w_o.z) * henyey_greenstein(cos_j, layer.g);
}

double unscattered(const ThinLayer& layer, double cos_i) {
    const Crossing in = crossing(cos_i, layer.eta);
    const double below = refracted_cosine(cos_i, layer.eta_below);
    const double through = in.let_through * transmittance(below, layer.eta / layer.eta_below);
    return through > 0 ? through * std::exp(-layer.tau / in.inside) : 0;
}

LayerEnergy layer_energy(const ThinLayer& layer, double cos_i) {
    return {.surface = fresnel(cos_i, layer.eta),
            .reflected = reflected_share(layer, cos_i),
            .transmitted = transmitted_share(layer, cos_i),
            .unscattered = unscattered(layer, cos_i)};
}

LayerTable::LayerTable(const ThinLayer& layer) {
    for (int i = 0; i <= steps; ++i) {
        const double root = std::max(double(i), 1e-3) / steps;  // the limit at 0, where T_12 is 0
        reflected_[i] = reflected_share(layer, root * root);
        transmitted_[i] = transmitted_share(layer, root * root);
    }
}

double LayerTable::at(const Column& column, double cos_i) {
    const double place = std::sqrt(cos_i) * steps;
    const int i = std::min(int(place), steps - 1);
    return column[i] + (place - i) * (column[i + 1] - column[i]);
}

std::span<const LayerPreset> layer_presets() { return presets; }

}  // namespace relit::scatter
