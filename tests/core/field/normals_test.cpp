#include "core/field/normals.h"

#include <gtest/gtest.h>

#include "tests/support/maps.h"

namespace relit::test {
namespace {

TEST(Normals, OfATiltedPlaneAreItsNormalEverywhereAlsoAtTheBorder) {
    const HeightField plane = tilted_plane(20, 12, 0.5, 0.3, -0.2);
    for (const auto& [i, j] : {std::pair{0, 0}, {19, 11}, {10, 6}, {0, 5}, {7, 11}}) {
        const Slopes slopes = slopes_at(plane, 0.5, i, j);
        EXPECT_NEAR(slopes.x, 0.3, 1e-5) << i << ", " << j;
        EXPECT_NEAR(slopes.y, -0.2, 1e-5) << i << ", " << j;
    }
    const Vec3 n = normal_from(slopes_at(plane, 0.5, 3, 3));
    EXPECT_NEAR(n.x, -0.3 / std::sqrt(1.13), 1e-6);
    EXPECT_NEAR(n.y, 0.2 / std::sqrt(1.13), 1e-6);
}

TEST(Normals, LookAwayFromMaskedTexels) {
    HeightField field =
        field_of(3, 3, [](int i, int j) { return i == 2 ? 1.0 : 0.1 * i + 0.01 * j; });
    field.alpha = Image(3, 3, 1, 1);
    for (int j = 0; j < 3; ++j) field.alpha.at(2, j) = 0.4f;  // not material
    EXPECT_NEAR(slopes_at(field, 1, 1, 1).x, 0.1 * 3, 1e-6);  // one-sided, to the left
    field.alpha.at(0, 1) = 0;
    EXPECT_EQ(slopes_at(field, 1, 1, 1).x, 0);  // neither neighbour counts
}

TEST(Normals, AreTheThesissWhenReliefTimesScaleIsTwoTexels) {
    const HeightField field = hills(16, 16);
    const Vec3 n = normal_from(slopes_at(field, 0.25, 5, 7), 2.0 / (16 * 0.25));
    const auto h = [&](int i, int j) { return double(field.heights.at(i, j)); };
    const Vec3 thesis = normalized({h(4, 7) - h(6, 7), h(5, 8) - h(5, 6), 1});
    EXPECT_NEAR(n.x, thesis.x, 1e-9);
    EXPECT_NEAR(n.y, thesis.y, 1e-9);
}

}  // namespace
}  // namespace relit::test
