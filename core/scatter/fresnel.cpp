#include "core/scatter/fresnel.h"

#include <vector>

#include "core/base/hemisphere.h"

namespace relit::scatter {
namespace {

constexpr double fits_from = 1.2;  // below, 3 C_2 is off by 5 % and more
constexpr double fits_to = 2;      // what they were made for; polynomials run away beyond

bool has_boundary(double n) { return std::abs(n - 1) >= no_boundary; }

bool is_fitted(double n) {
    const double above_one = std::max(n, 1 / n);
    return above_one >= fits_from && above_one <= fits_to;
}

const std::vector<hemisphere::Node>& nodes() {
    static const auto all = hemisphere::nodes(64);
    return all;
}

// From the denser side everything beyond the critical angle is reflected. The rest is integrated
// over the cosine on the other side, where F has no root to end in: mu dmu = c dc / n^2.
Moments moments_from_inside(double n) {
    const double critical = std::sqrt(1 - 1 / (n * n));
    Moments m{critical * critical / 2, critical * critical * critical / 3};
    for (const hemisphere::Node& node : nodes()) {
        const double part = node.weight * fresnel(node.z, n) * node.z / (n * n);
        m.c1 += part;
        m.c2 += part * refracted_cosine(node.z, n);
    }
    return m;
}

// F falls steeply from grazing light where the indices are close: mu = z^2 puts the nodes there.
Moments moments_from_outside(double n) {
    Moments m;
    for (const hemisphere::Node& node : nodes()) {
        const double mu = node.z * node.z;
        const double part = node.weight * 2 * node.z * fresnel(mu, 1 / n) * mu;
        m.c1 += part;
        m.c2 += part * mu;
    }
    return m;
}

}  // namespace

Moments fitted_moments(double n) {
    const double n2 = n * n, n3 = n2 * n, n4 = n3 * n, n5 = n4 * n;
    if (n < 1)
        return {
            (0.919317 - 3.4793 * n + 6.75335 * n2 - 7.80989 * n3 + 4.98554 * n4 - 1.36881 * n5) / 2,
            (0.828421 - 2.62051 * n + 3.36231 * n2 - 1.95284 * n3 + 0.236494 * n4 + 0.145787 * n5) /
                3};
    return {
        (-9.23372 + 22.2272 * n - 20.9292 * n2 + 10.2291 * n3 - 2.54396 * n4 + 0.254913 * n5) / 2,
        (-1641.1 + 135.926 / n3 - 656.175 / n2 + 1376.53 / n + 1213.67 * n - 568.556 * n2 +
         164.798 * n3 - 27.0181 * n4 + 1.91826 * n5) /
            3};
}

Moments exact_moments(double n) {
    if (!has_boundary(n)) return {};
    return n > 1 ? moments_from_inside(n) : moments_from_outside(n);
}

Moments moments(double n) { return is_fitted(n) ? fitted_moments(n) : exact_moments(n); }

double fitted_diffuse_reflectance(double n) {
    return n < 1 ? -0.4399 + 0.7099 / n - 0.3319 / (n * n) + 0.0636 / (n * n * n)
                 : -1.440 / (n * n) + 0.710 / n + 0.668 + 0.0636 * n;
}

double diffuse_reflectance(double n) {
    if (!has_boundary(n)) return 0;
    return std::max(n, 1 / n) <= fits_to ? fitted_diffuse_reflectance(n) : 2 * exact_moments(n).c1;
}

double diffuse_transmittance(double eta) { return 1 - 2 * moments(1 / eta).c1; }

double standard_boundary(double eta) {
    const double reflected = diffuse_reflectance(eta);
    return (1 + reflected) / (1 - reflected);
}

double moment_boundary(double eta) {
    const Moments m = moments(eta);
    return (1 + 3 * m.c2) / (1 - 2 * m.c1);
}

}  // namespace relit::scatter
