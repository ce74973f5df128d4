#include "core/base/hemisphere.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace relit::test {
namespace {

TEST(Hemisphere, FunctionsAreOrthonormalOverSolidAngle) {
    constexpr int azimuths = 32;
    constexpr int n = hemisphere::functions;
    std::vector<double> products(n * n);
    for (const hemisphere::Node& node : hemisphere::nodes(12))
        for (int a = 0; a < azimuths; ++a) {
            const double phi = 2 * std::numbers::pi * a / azimuths;
            const double flat = std::sqrt(1 - node.z * node.z);
            const auto values =
                hemisphere::values({flat * std::cos(phi), flat * std::sin(phi), node.z});
            for (int f = 0; f < n; ++f)
                for (int g = 0; g < n; ++g)
                    products[f * n + g] +=
                        node.weight * 2 * std::numbers::pi / azimuths * values[f] * values[g];
        }
    for (int f = 0; f < n; ++f)
        for (int g = 0; g < n; ++g)
            EXPECT_NEAR(products[f * n + g], f == g ? 1 : 0, 1e-9) << f << ' ' << g;
}

TEST(Hemisphere, ValuesAreTheRadialPartsTimesCosinesAndSines) {
    const double z = 0.3, phi = 0.7, flat = std::sqrt(1 - z * z);
    const auto values = hemisphere::values({flat * std::cos(phi), flat * std::sin(phi), z});
    int f = 0;
    for (const hemisphere::Radial radial : hemisphere::radials()) {
        const double r = hemisphere::radial_value(radial, z);
        EXPECT_NEAR(values[f++], r * std::cos(radial.order * phi), 1e-12);
        if (radial.order > 0) {
            EXPECT_NEAR(values[f++], r * std::sin(radial.order * phi), 1e-12);
        }
    }
    EXPECT_EQ(f, hemisphere::functions);
}

TEST(Hemisphere, NodesIntegratePolynomialsExactly) {
    for (const int n : {1, 4, 12, 16}) {
        double volume = 0, power = 0;
        for (const hemisphere::Node& node : hemisphere::nodes(n)) {
            volume += node.weight;
            power += node.weight * std::pow(node.z, 2 * n - 1);
        }
        EXPECT_NEAR(volume, 1, 1e-13);
        EXPECT_NEAR(power, 1.0 / (2 * n), 1e-13);
    }
}

}  // namespace
}  // namespace relit::test
