#include "core/transport/radial_kernel.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/scatter/normalised_diffusion.h"
#include "tests/support/transport.h"

namespace relit::test {
namespace {

using std::numbers::pi;

// Far from the cells, where nothing is averaged.
TEST(RadialKernel, HoldsItsProfileToFiveDigits) {
    const auto profiles = dipoles("marble", 80);
    const double spacing = 1.0 / 1024;
    const RadialKernel kernel(profiles, spacing, 1.5);
    for (int c = 0; c < 3; ++c)
        for (double r = 8 * spacing; r < 0.3; r *= 1.003) {
            const double exact = profiles[c].at(r);
            ASSERT_NEAR(kernel.at(c, r) / exact, 1, 1e-5) << "channel " << c << " at " << r;
        }
}

TEST(RadialKernel, OfSmallCellsIsTheProfile) {
    const auto profiles = dipoles("marble", 80);  // mean free path of red: 0.0057
    const RadialKernel kernel(profiles, 0.0057 / 16, 1.5);
    for (double r = 0; r < 0.1; r += 0.0003)
        ASSERT_NEAR(kernel.at(0, r) / profiles[0].at(r), 1, 0.002) << "at " << r;
}

// Whatever the cells: what the samples of a plane get from one of them adds up to what leaves.
TEST(RadialKernel, OverAGridSumsUpToItsTotal) {
    for (const double mm_per_width : {10.0, 80.0, 1000.0, 1e5}) {
        const auto profiles = dipoles("skin1", mm_per_width);
        const double h = 1.0 / 512;
        const RadialKernel kernel(profiles, h, 1.5);
        for (int c = 0; c < 3; ++c) {
            double sum = 0;
            for (int v = -511; v <= 511; ++v)
                for (int u = -511; u <= 511; ++u)
                    if (u * u + v * v < 511 * 511)
                        sum += h * h * kernel.at_squared(c, float(h * h * (u * u + v * v)));
            const double exact = profiles[c].within(511 * h);
            EXPECT_NEAR(sum / exact, 1, 0.003) << mm_per_width << " mm, channel " << c;
        }
    }
}

TEST(RadialKernel, TakesAProfileThatIsInfiniteAtZero) {
    const scatter::NormalisedDiffusion profile(0.8, 0.002);
    const double h = 1.0 / 256;
    const RadialProfile of_channel = radial_profile(profile);
    const RadialKernel kernel({&of_channel, 1}, h, 1);
    EXPECT_NEAR(kernel.at(0, 0) * h * h, profile.within(h / std::sqrt(pi)), 0.005);
    double sum = 0;
    for (int v = -100; v <= 100; ++v)
        for (int u = -100; u <= 100; ++u)
            sum += h * h * kernel.at_squared(0, float(h * h * (u * u + v * v)));
    EXPECT_NEAR(sum, profile.total(), 0.02);
}

// A strong medium on a steep slope: light leaves where it enters, and no more than enters.
TEST(RadialKernel, CountsASteepSamplesOwnFluxByItsArea) {
    const auto profiles = dipoles("skin1", 1e6);
    const double h = 1.0 / 64;
    const RadialKernel kernel(profiles, h, 1.5);
    for (const double steepness : {1.0, 3.0, 20.0, 5000.0})
        for (int c = 0; c < 3; ++c) {
            const double area = steepness * h * h;
            const double own = (kernel.at(c, 0) + kernel.at_own_place(c, area)) * area;
            EXPECT_NEAR(own / profiles[c].total, 1, 0.005) << steepness << ", channel " << c;
        }
}

TEST(RadialKernel, IsZeroFromWhereAMillionthIsLeft) {
    const auto profiles = dipoles("ketchup", 300);
    const RadialKernel kernel(profiles, 1.0 / 256, 0.6);
    ASSERT_LT(kernel.range(), 0.6);
    for (int c = 0; c < 3; ++c) {
        EXPECT_EQ(kernel.at(c, 1.01 * kernel.range()), 0);
        EXPECT_EQ(kernel.at(c, 1e10), 0);
        EXPECT_LE(profiles[c].total - profiles[c].within(kernel.range()),
                  1.1e-6 * profiles[c].total);
    }
}

}  // namespace
}  // namespace relit::test
