#include "core/scatter/highlight.h"

#include <gtest/gtest.h>

#include "tests/core/scatter/support.h"

namespace relit::test {
namespace {

using namespace scatter;

TEST(HighlightFalloff, DiscsAreItsIntegrals) {
    for (const double sigma : {1e-6, 0.4, 3.0, 1e4}) {
        const HighlightFalloff falloff{sigma};
        const auto at = [&](double r) { return falloff.at(r); };
        for (const double reach : {1e-6, 1e-4, 1e-3, 1.1e-3, 0.1, 1.0, 10.0}) {
            const double a = reach / sigma;
            EXPECT_NEAR(disc_integral(a, a, at) / falloff.within(a), 1, 1e-9)
                << sigma << ' ' << reach;
        }
        EXPECT_NEAR(falloff.within(60 / sigma) / falloff.total(), 1, 1e-12);
        EXPECT_EQ(falloff.within(INFINITY), falloff.total());
        EXPECT_EQ(falloff.within(0), 0);
        EXPECT_NEAR(falloff.normalisation() * falloff.total(), 1, 1e-14);
    }
    EXPECT_EQ(HighlightFalloff{0}.at(1e9), 1);  // no extinction: the whole surface alike
    EXPECT_NEAR(HighlightFalloff{0}.within(2), 4 * pi, 1e-12);
}

// On a plane every sample weighs the same, and the sum is the integral over the plane.
TEST(HighlightFalloff, SamplesOfAPlaneAreItsDensity) {
    const HighlightFalloff falloff{2.5};
    Random random(61);
    constexpr int samples = 100'000;
    int near = 0;
    for (int i = 0; i < samples; ++i) {
        const double rho = falloff.sample(random.between(0, 1), random.between(0, 1));
        EXPECT_NEAR(falloff.weight(rho, rho, 1), falloff.total(), 1e-12);
        near += rho < 0.6;
    }
    const double share = falloff.within(0.6) / falloff.total();
    EXPECT_NEAR(double(near) / samples, share, 3 * std::sqrt(share * (1 - share) / samples));
    // A point half as far again in space and on a slope of 60 degrees.
    EXPECT_NEAR(falloff.weight(1, 1.5, 0.5), 2 * falloff.total() * std::exp(-2.5 * 0.5), 1e-12);
}

}  // namespace
}  // namespace relit::test
