#include "core/transport/directional_cell.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/base/hemisphere.h"

namespace relit {
namespace {

using Mean = DirectionalCell::Mean;
using scatter::DirectionalDipole;
using scatter::RayPair;
using std::numbers::pi;

void add(Mean& sum, const Mean& term, double weight) {
    sum.constant += weight * term.constant;
    sum.normal += weight * term.normal;
    sum.along += weight * term.along;
}

// S_d with d_r and d_v as given: linear in what is said of the exit's normal.
double with_distances(const DirectionalDipole& dipole, const RayPair& pair,
                      const scatter::Diffused& at) {
    return ray_source(dipole, pair.along, pair.facing, pair.outward, at.d_r) -
           ray_source(dipole, pair.along + dipole.mirrored * pair.down,
                      pair.facing - 2 * pair.down * pair.agreement,
                      pair.outward - dipole.mirrored * pair.agreement, at.d_v);
}

// At (r, angle) from the entry; N = z, light goes down and along x.
Mean mean_at(const DirectionalDipole& dipole, double down, double r, double angle) {
    const double sideways = std::sqrt(1 - down * down), x = r * std::cos(angle);
    RayPair pair{.squared_distance = r * r,
                 .along = x * sideways,
                 .outward = 0,
                 .facing = -down,
                 .down = -down,
                 .agreement = 1};
    const scatter::Diffused at = diffused(dipole, pair);
    if (!(at.s_d > 0)) return {};
    pair.facing = 0;
    pair.agreement = 0;
    const double constant = with_distances(dipole, pair, at);
    pair.facing = sideways;
    pair.outward = x;
    return {constant, at.s_d - constant, (with_distances(dipole, pair, at) - constant) / sideways};
}

// Integral over a ring.
Mean ring(const DirectionalDipole& dipole, double down, double from, double to) {
    static const std::vector<hemisphere::Node> nodes = hemisphere::nodes(4);
    constexpr int angles = 8;  // of the half: the other one is its mirror image
    Mean sum;
    for (const hemisphere::Node& node : nodes)
        for (int k = 0; k < angles; ++k) {
            const double r = from + (to - from) * node.z;
            add(sum, mean_at(dipole, down, r, pi * (k + 0.5) / angles),
                (to - from) * node.weight * 2 * pi * r / angles);
        }
    return sum;
}

}  // namespace

DirectionalCell::DirectionalCell(const DirectionalDipole& dipole, double least_area)
    : least_area_(least_area) {
    for (int m = 0; m < cosines; ++m) {
        const double down = std::clamp(double(m) / (cosines - 1), 1e-3, 1 - 1e-6);
        Mean sum;
        double from = 0, to = dipole.diffusion / 8;
        for (int a = 0; a < areas; ++a) {
            const double area = least_area * std::exp2(double(a) / per_doubling);
            const double end = std::sqrt(area / pi);
            for (; to < end; from = to, to *= 2) add(sum, ring(dipole, down, from, to), 1);
            add(sum, ring(dipole, down, from, end), 1);
            from = end;
            means_[m][a] = {};
            add(means_[m][a], sum, 1 / area);
        }
    }
}

DirectionalCell::Mean DirectionalCell::at(double down, double area, double stretch) const {
    if (stretch < 1.1) return of_disk(down, area);
    constexpr int angles = 4;  // of a quarter
    Mean mean;
    for (int k = 0; k < angles; ++k) {
        const double s = std::sin(pi / 2 * (k + 0.5) / angles);
        const double larger = 1 / ((1 - s * s) / stretch + s * s * stretch);  // that radius' disk
        add(mean, of_disk(down, larger * area), larger / angles);
    }
    return mean;
}

DirectionalCell::Mean DirectionalCell::of_disk(double down, double area) const {
    const double step = std::max(0.0, per_doubling * std::log2(area / least_area_));
    const double column = std::min(step, areas - 1.0);
    const double row = std::clamp(down, 0.0, 1.0) * (cosines - 1);
    const int a = std::min(int(column), areas - 2), m = std::min(int(row), cosines - 2);
    Mean mean;
    add(mean, means_[m][a], (1 - (row - m)) * (1 - (column - a)));
    add(mean, means_[m][a + 1], (1 - (row - m)) * (column - a));
    add(mean, means_[m + 1][a], (row - m) * (1 - (column - a)));
    add(mean, means_[m + 1][a + 1], (row - m) * (column - a));
    const double beyond = std::exp2((column - step) / per_doubling);
    return {beyond * mean.constant, beyond * mean.normal, beyond * mean.along};
}

}  // namespace relit
