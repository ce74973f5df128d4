#include "core/field/height_field.h"

#include <gtest/gtest.h>

#include <limits>

#include "core/base/error.h"
#include "tests/support/maps.h"

namespace relit::test {
namespace {

constexpr float nan = std::numeric_limits<float>::quiet_NaN();
constexpr float inf = std::numeric_limits<float>::infinity();

Image row_of(Texels values, int channels = 1) {
    Image image(int(values.size()) / channels, 1, channels);
    image.values = std::move(values);
    return image;
}

TEST(HeightField, KeepsNumbersThatAreFractionsAlready) {
    const HeightField field = height_field_from(row_of({0.25f, 0.5f, 1}), false, false);
    EXPECT_EQ(field.heights.values, (Texels{0.25f, 0.5f, 1}));
    EXPECT_FALSE(field.rescaled_from);
    EXPECT_TRUE(field.alpha.empty());
}

TEST(HeightField, RescalesOtherNumbersFromTheirFiniteRangeAndSaysSo) {
    const HeightField field = height_field_from(row_of({-100, 300, 100, nan, inf}), false, false);
    EXPECT_EQ(field.heights.values, (Texels{0, 1, 0.5f, 0, 0}));
    ASSERT_TRUE(field.rescaled_from);
    EXPECT_EQ(field.rescaled_from->min, -100);
    EXPECT_EQ(field.rescaled_from->max, 300);
}

TEST(HeightField, MasksTexelsThatAreNotFinite) {
    HeightField field = height_field_from(row_of({0.5f, nan, -inf}), false, false);
    EXPECT_EQ(field.alpha.values, (Texels{1, 0, 0}));
    // Also under a mask that came apart.
    set_alpha(field, row_of({0.7f, 1, 1}), false, executor());
    EXPECT_EQ(field.alpha.values, (Texels{0.7f, 0, 0}));
}

TEST(HeightField, OfOneFlatNumberOutsideTheRangeIsZero) {
    const HeightField field = height_field_from(row_of({7, 7, 7}), false, false);
    EXPECT_EQ(field.heights.values, (Texels{0, 0, 0}));
    ASSERT_TRUE(field.rescaled_from);
}

TEST(HeightField, WithoutAFiniteTexelIsRefused) {
    try {
        (void)height_field_from(row_of({nan, inf}), false, false);
        FAIL() << "accepted";
    } catch (const Error& e) {
        EXPECT_EQ(e.code, error_code::image_broken);
    }
}

TEST(HeightField, OfAColourImageIsItsLuminanceAndItsAlphaTheMask) {
    const HeightField field =
        height_field_from(row_of({1, 0, 0, 1, 0.5f, 0.5f, 0.5f, 0.25f}, 4), true, true);
    EXPECT_NEAR(field.heights.at(0, 0), 0.2126, 1e-6);
    EXPECT_EQ(field.heights.at(1, 0), 0.5f);
    EXPECT_EQ(field.alpha.values, (Texels{1, 0.25f}));
}

TEST(HeightField, TakesAnAlphaImagesOwnAlphaBeforeItsLuminance) {
    HeightField field = height_field_from(row_of({0.5f, 0.5f}), false, true);
    set_alpha(field, row_of({1, 0.2f, 1, 0.9f}, 2), true, executor());
    EXPECT_EQ(field.alpha.values, (Texels{0.2f, 0.9f}));
}

TEST(HeightField, ResamplesMaskAndAlbedoToItsSize) {
    HeightField field = height_field_from(Image(4, 2, 1, 0.5f), false, true);
    set_alpha(field, Image(8, 8, 1, 0.75f), false, executor());
    set_albedo(field, Image(3, 5, 3, 0.5f), false, true, executor());
    ASSERT_EQ(field.alpha.values.size(), 8u);
    ASSERT_EQ(field.albedo.values.size(), 24u);
    for (const float a : field.alpha.values) EXPECT_FLOAT_EQ(a, 0.75f);
    for (const float a : field.albedo.values)
        EXPECT_NEAR(a, 0.21404, 1e-5);  // sRGB 0.5 in linear light
}

}  // namespace
}  // namespace relit::test
