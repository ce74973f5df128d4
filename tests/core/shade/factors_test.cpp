#include "core/shade/factors.h"

#include <gtest/gtest.h>

#include <limits>

#include "core/base/angle.h"

namespace relit::test {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

TEST(Factors, LengthIlluminationIsOneUpToTheDepthThenFalls) {
    EXPECT_EQ(length_illumination(0.01, 0), 1);
    EXPECT_EQ(length_illumination(0.01, 0.01), 1);
    EXPECT_DOUBLE_EQ(length_illumination(0.01, 0.04), 0.25);
    EXPECT_EQ(length_illumination(0.01, infinity), 0);
}

TEST(Factors, ExponentialIlluminationIsBeerLambertBeyondTheDepth) {
    EXPECT_EQ(exponential_illumination(0.01, 0.005, 20), 1);
    EXPECT_DOUBLE_EQ(exponential_illumination(0.01, 0.11, 20), std::exp(-2.0));
    EXPECT_EQ(exponential_illumination(0.01, infinity, 20), 0);
}

TEST(Factors, RampRisesFromLoToHi) {
    EXPECT_EQ(ramp(-0.6, {-0.5, 0.5}), 0);
    EXPECT_EQ(ramp(0, {-0.5, 0.5}), 0.5);
    EXPECT_EQ(ramp(0.7, {-0.5, 0.5}), 1);
}

TEST(Factors, HighlightIsFullWhereTheMirroredViewMeetsTheLight) {
    const Vec3 n = normalized({0.3, -0.2, 1});
    const Vec3 mirrored = 2 * n.z * n - Vec3{0, 0, 1};
    EXPECT_NEAR(specular_factor(n, mirrored, {0.5, 1}), 1, 1e-12);
    EXPECT_EQ(specular_factor({0, 0, 1}, direction_from(0, 20), {0.5, 1}), 0);
    EXPECT_NEAR(specular_factor({0, 0, 1}, direction_from(77, 30), {0, 1}), 0.5, 1e-12);
}

TEST(Factors, ScatteringIsFullWithTheLightStraightBehind) {
    EXPECT_EQ(scatter_factor({0, 0, -1}, {0, 1}), 1);
    EXPECT_EQ(scatter_factor({0, 0, 1}, {0, 1}), 0);
    EXPECT_NEAR(scatter_factor(direction_from(10, -30), {0, 1}), 0.5, 1e-12);
}

}  // namespace
}  // namespace relit::test
