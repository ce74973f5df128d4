#include "core/image/colour.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace relit::test {
namespace {

// IEC 61966-2-1, in double.
double encoded(double v) {
    return v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055;
}

TEST(Colour, SrgbCurveIsTheStandardsWithin1e6) {
    for (int k = 0; k <= 100000; ++k) {
        const double v = k / 100000.0;
        ASSERT_NEAR(linear_to_srgb(float(v)), encoded(v), 1e-6) << v;
    }
}

TEST(Colour, EveryByteComesBackFromLinearLight) {
    for (int byte = 0; byte < 256; ++byte)
        EXPECT_EQ(std::lround(linear_to_srgb(srgb_to_linear(float(byte) / 255)) * 255), byte);
}

TEST(Colour, NumbersOutsideTheCurveAreClipped) {
    EXPECT_EQ(linear_to_srgb(-1), 0);
    EXPECT_EQ(linear_to_srgb(7), 1);
    EXPECT_EQ(linear_to_srgb(std::numeric_limits<float>::quiet_NaN()), 0);
}

TEST(Colour, HexIsDecodedForLinearShadingAndKeptAsItIsWithoutTransfer) {
    const Colour bronze = hex_colour(0x8a, 0x5a, 0x2b);
    EXPECT_NEAR(shading_colour(bronze, Transfer::srgb).r, 0.25415, 1e-5);
    EXPECT_NEAR(shading_colour(bronze, Transfer::none).r, 138.0 / 255, 1e-6);
    const Colour numbers{{0.5, 2, 0}, false};
    EXPECT_EQ(shading_colour(numbers, Transfer::srgb), (Rgb{0.5f, 2, 0}));
}

TEST(Colour, LuminanceOfAGreyIsItself) {
    for (const float v : {0.1f, 0.333333f, 1.0f, 65504.0f}) EXPECT_EQ(luminance({v, v, v}), v);
    EXPECT_NEAR(luminance({1, 0, 0}), 0.2126, 1e-7);
}

}  // namespace
}  // namespace relit::test
