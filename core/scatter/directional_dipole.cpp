#include "core/scatter/directional_dipole.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/base/hemisphere.h"
#include "core/scatter/dipole.h"
#include "core/scatter/fresnel.h"

namespace relit::scatter {
namespace {

constexpr double pi = std::numbers::pi;

constexpr double underflow = 80;   // as in dipole.cpp
constexpr double parallel = 1e-7;  // sine below which x and n_i span no plane
constexpr double least_albedo = 1e-8;

// n*: the part of n_i orthogonal to x, at length 1.
Vec3 modified_normal(Vec3 x, double r, Vec3 normal, double touching) {
    if (r < touching) return normal;
    Vec3 side = cross(normal, x);
    if (length(side) < parallel * r)  // any will do but n_i, which may put x_v on x_o
        side = cross(normal, std::abs(normal.x) < 0.9 ? Vec3{1, 0, 0} : Vec3{0, 1, 0});
    return cross((1 / r) * x, normalized(side));
}

double real_distance(const DirectionalDipole& dipole, const RayPair& pair) {
    const double r2 = pair.squared_distance, mu0 = -pair.facing;
    if (mu0 <= 0) return std::sqrt(r2 + dipole.edge_step * dipole.edge_step);
    const double across = std::max(0.0, r2 - pair.along * pair.along);
    const double cos_beta = -std::sqrt(across / (r2 + dipole.extrapolation * dipole.extrapolation));
    const double step = dipole.diffusion * mu0;
    return std::sqrt(r2 + step * (step - 2 * dipole.extrapolation * cos_beta));
}

}  // namespace

DirectionalDipole directional_dipole(const Coefficients& coefficients,
                                     const DirectionalOptions& options) {
    const Derived d = derived(coefficients);
    DirectionalDipole dipole;
    dipole.diffusion = d.diffusion;
    dipole.sigma_tr = d.sigma_tr;
    dipole.extrapolation = 2.131 * d.diffusion / std::sqrt(std::max(d.alpha_prime, least_albedo));
    dipole.mirrored = 2 * d.a_m * dipole.extrapolation;
    dipole.edge_step = 1 / (3 * d.sigma_t);
    dipole.touching = 1e-9 * d.free_path;
    dipole.nearest = options.robust ? 0.5 * dipole.edge_step : dipole.touching;
    dipole.c_phi = d.c_phi;
    dipole.c_e = d.c_e;
    dipole.norm = 1 / (4 * d.c_phi_ext) / (4 * pi * pi);
    dipole.eta = coefficients.eta;
    if (options.energy == DirectionalEnergy::matched)
        dipole.norm *= BetterDipole(coefficients).total() / half_space_total(dipole);
    return dipole;
}

RayPair ray_pair(const SurfacePoint& entry, Vec3 inward, const SurfacePoint& exit,
                 double touching) {
    const Vec3 x = exit.position - entry.position;
    const Vec3 star = modified_normal(x, length(x), entry.normal, touching);
    return {.squared_distance = dot(x, x),
            .along = dot(x, inward),
            .outward = dot(x, exit.normal),
            .facing = dot(inward, exit.normal),
            .down = dot(inward, star),
            .agreement = dot(star, exit.normal)};
}

double ray_source(const DirectionalDipole& dipole, double along, double facing, double outward,
                  double d) {
    const double sd = dipole.sigma_tr * d, k = 1 + sd;
    const double fluence = d * d / dipole.diffusion + 3 * k * along;
    const double gradient =
        3 * dipole.diffusion * k * facing -
        (k + 3 * dipole.diffusion * (3 * k + sd * sd) / (d * d) * along) * outward;
    return dipole.norm * std::exp(-sd) / (d * d * d) *
           (dipole.c_phi * fluence - dipole.c_e * gradient);
}

// x_v = x_i + 2 A d_e n* and w_v = w_12 - 2 (w_12 . n*) n*; n* is orthogonal to x, so that of
// products with them only these terms are left.
Diffused diffused(const DirectionalDipole& dipole, const RayPair& pair) {
    Diffused result;
    result.d_r = std::max(real_distance(dipole, pair), dipole.nearest);
    result.d_v = std::sqrt(pair.squared_distance + dipole.mirrored * dipole.mirrored);
    if (dipole.sigma_tr * dipole.sigma_tr * pair.squared_distance > underflow * underflow)
        return result;
    result.s_d = ray_source(dipole, pair.along, pair.facing, pair.outward, result.d_r) -
                 ray_source(dipole, pair.along + dipole.mirrored * pair.down,
                            pair.facing - 2 * pair.down * pair.agreement,
                            pair.outward - dipole.mirrored * pair.agreement, result.d_v);
    return result;
}

double bssrdf(const DirectionalDipole& dipole, const SurfacePoint& entry, Vec3 to_light,
              const SurfacePoint& exit, Vec3 to_viewer) {
    const double let_through = transmittance(dot(to_light, entry.normal), dipole.eta) *
                               transmittance(dot(to_viewer, exit.normal), dipole.eta);
    if (let_through <= 0) return 0;
    const Vec3 inward = refracted(to_light, entry.normal, dipole.eta);
    return let_through *
           std::max(0.0, diffused(dipole, ray_pair(entry, inward, exit, dipole.touching)).s_d);
}

double symmetric_bssrdf(const DirectionalDipole& dipole, const SurfacePoint& entry, Vec3 to_light,
                        const SurfacePoint& exit, Vec3 to_viewer) {
    return 0.5 * (bssrdf(dipole, entry, to_light, exit, to_viewer) +
                  bssrdf(dipole, exit, to_viewer, entry, to_light));
}

double half_space_total(const DirectionalDipole& dipole) {
    const auto nodes = hemisphere::nodes(16);
    const double end = underflow / dipole.sigma_tr;
    double sum = 0;
    // Rings that double, from well within the source's depth.
    for (double from = 0, to = dipole.diffusion / 8; from < end; from = to, to *= 2)
        for (const hemisphere::Node& node : nodes) {
            const double r = from + (to - from) * node.z;
            const RayPair pair{.squared_distance = r * r, .facing = -1, .down = -1, .agreement = 1};
            sum += (to - from) * node.weight * r * std::max(0.0, diffused(dipole, pair).s_d);
        }
    return pi * diffuse_transmittance(dipole.eta) * 2 * pi * sum;
}

}  // namespace relit::scatter
