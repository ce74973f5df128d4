// What the tests of scatter share: media, random directions, plain quadrature.
#pragma once

#include <cmath>
#include <numbers>
#include <random>
#include <string_view>

#include "core/base/hemisphere.h"
#include "core/base/vec.h"
#include "core/scatter/medium.h"

namespace relit::test {

inline constexpr double pi = std::numbers::pi;

/// Of a measured medium, in 1/mm.
inline scatter::Coefficients measured(std::string_view name, int c) {
    return scatter::channel(scatter::find_medium(name)->medium, c);
}

class Random {
public:
    explicit Random(unsigned seed) : engine_(seed) {}

    double between(double least, double most) {
        return least + (most - least) * (double(engine_()) + 0.5) / 0x1p64;
    }
    /// Uniform over the sphere.
    Vec3 direction() {
        const double z = between(-1, 1), phi = between(0, 2 * pi), flat = std::sqrt(1 - z * z);
        return {flat * std::cos(phi), flat * std::sin(phi), z};
    }
    /// Uniform over the half of it around `normal`.
    Vec3 direction_above(Vec3 normal) {
        const Vec3 d = direction();
        return dot(d, normal) < 0 ? -d : d;
    }

private:
    std::mt19937_64 engine_;
};

/// Of f over [from, to], by Gauss and Legendre.
template <typename Function>
double integral(double from, double to, Function f) {
    static const auto nodes = hemisphere::nodes(32);
    double sum = 0;
    for (const hemisphere::Node& node : nodes) sum += node.weight * f(from + (to - from) * node.z);
    return (to - from) * sum;
}

/// Of f(r) over a disc of radius `to`, in rings that double from `scale`/8 on.
template <typename Function>
double disc_integral(double scale, double to, Function f) {
    double sum = 0;
    for (double from = 0, next = scale / 8; from < to; from = next, next = std::min(2 * from, to)) {
        next = std::min(next, to);
        sum += integral(from, next, [&](double r) { return 2 * pi * r * f(r); });
    }
    return sum;
}

/// Rotations about an axis and mirrors, which no light should notice.
struct Turn {
    Vec3 x, y, z;  // images of the axes

    Vec3 operator()(Vec3 v) const { return v.x * x + v.y * y + v.z * z; }
};

inline Turn random_turn(Random& random, bool mirrored) {
    const Vec3 z = random.direction();
    const Vec3 x = normalized(cross(random.direction(), z));
    const Vec3 y = cross(z, x);
    return {x, mirrored ? -y : y, z};
}

}  // namespace relit::test
