#include "core/base/hemisphere.h"

#include <cmath>
#include <numbers>

namespace relit::hemisphere {
namespace {

constexpr double pi = std::numbers::pi;

constexpr int radial_count = (degree + 2) * (degree + 2) / 4;

std::array<Radial, radial_count> made_radials() {
    std::array<Radial, radial_count> all;
    int n = 0;
    for (int order = 0; order <= degree; ++order)
        for (int k = order; k <= degree; k += 2) all[n++] = {k, order};
    return all;
}

double factorial(int n) { return n <= 1 ? 1 : n * factorial(n - 1); }

// A radial part is rho^order times a polynomial of rho^2, rho^2 = 1 - z: its coefficients, lowest
// first, normalised.
std::vector<double> made_polynomial(Radial radial) {
    const int n = radial.degree, m = radial.order;
    const double norm = std::sqrt((n + 1) / (m == 0 ? 2 * pi : pi));
    std::vector<double> polynomial((n - m) / 2 + 1);
    for (int k = 0; k <= (n - m) / 2; ++k)
        polynomial[(n - m) / 2 - k] =
            norm * (k % 2 == 0 ? 1 : -1) * factorial(n - k) /
            (factorial(k) * factorial((n + m) / 2 - k) * factorial((n - m) / 2 - k));
    return polynomial;
}

double evaluated(std::span<const double> polynomial, double x) {
    double sum = 0;
    for (std::size_t k = polynomial.size(); k-- > 0;) sum = sum * x + polynomial[k];
    return sum;
}

}  // namespace

std::span<const Radial> radials() {
    static const auto all = made_radials();
    return all;
}

double radial_value(Radial radial, double z) {
    const double squared = 1 - z;
    return std::pow(squared, 0.5 * radial.order) * evaluated(made_polynomial(radial), squared);
}

std::array<double, functions> values(Vec3 direction) {
    static const auto polynomials = [] {
        std::vector<std::vector<double>> all;
        for (const Radial radial : radials()) all.push_back(made_polynomial(radial));
        return all;
    }();
    // The direction's place on the disc; its powers carry rho^order and the angles.
    const double shrink = 1 / std::sqrt(1 + direction.z);
    const double x = shrink * direction.x, y = shrink * direction.y;
    double cosine = 1, sine = 0;
    std::array<double, functions> result{};
    int order = 0, f = 0;
    for (std::size_t n = 0; n < polynomials.size(); ++n) {
        for (; order < radials()[n].order; ++order) {
            const double next = cosine * x - sine * y;
            sine = cosine * y + sine * x;
            cosine = next;
        }
        const double radial = evaluated(polynomials[n], 1 - direction.z);
        result[f++] = radial * cosine;
        if (order > 0) result[f++] = radial * sine;
    }
    return result;
}

std::vector<Node> nodes(int n) {
    std::vector<Node> all;
    for (int k = n; k-- > 0;) {
        double x = std::cos(pi * (k + 0.75) / (n + 0.5)), slope = 0;
        for (int iteration = 0; iteration < 100; ++iteration) {
            double p = 1, before = 0;  // Legendre's polynomials at x
            for (int i = 0; i < n; ++i) {
                const double next = ((2 * i + 1) * x * p - i * before) / (i + 1);
                before = p;
                p = next;
            }
            slope = n * (x * p - before) / (x * x - 1);
            const double by = p / slope;
            x -= by;
            if (std::abs(by) < 1e-15) break;
        }
        all.push_back({0.5 * (1 + x), 1 / ((1 - x * x) * slope * slope)});
    }
    return all;
}

}  // namespace relit::hemisphere
