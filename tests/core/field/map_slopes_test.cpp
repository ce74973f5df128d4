#include "core/field/map_slopes.h"

#include <gtest/gtest.h>

#include "tests/support/maps.h"

namespace relit::test {
namespace {

constexpr double relief = 0.2, bump_relief = 0.03;

void add_mask_and_bump(HeightField& field) {
    field.alpha = Image(field.width(), field.height(), 1, 1.0f);
    field.bump = Image(field.width(), field.height(), 1);
    for (int j = 0; j < field.height(); ++j)
        for (int i = 0; i < field.width(); ++i) {
            if (i % 97 < 5 || j % 89 == 0) field.alpha.at(i, j) = 0;
            field.bump.at(i, j) = float((i * 7 + j * 13) % 50) / 50;
        }
}

// Runs of all lengths, at borders and within.
void expect_slopes(const MapSlopes& slopes, const HeightField& field, bool bumped) {
    const Image all = slopes.image(field, executor());
    std::vector<float> x(field.width()), y(field.width());
    const int right = field.width(), below = field.height();
    for (const int j : {0, 1, 45, below / 2, below - 2, below - 1})
        for (const auto& [i, count] : {std::pair{0, right},
                                       {0, 16},
                                       {1, 16},
                                       {right / 3, 16},
                                       {right - 17, 16},
                                       {right - 16, 16},
                                       {right - 1, 1}}) {
            slopes.load(field, i, j, count, 2, x.data(), y.data());
            for (int n = 0; n < count; ++n) {
                Slopes exact = slopes_at(field, relief, i + n, j);
                const Slopes bump = slopes_at(field, field.bump, bump_relief, i + n, j);
                const float dx = float(exact.x) + (bumped ? float(bump.x) : 0);
                const float dy = float(exact.y) + (bumped ? float(bump.y) : 0);
                ASSERT_EQ(x[n], 2 * dx) << i + n << ", " << j;
                ASSERT_EQ(y[n], 2 * dy) << i + n << ", " << j;
                ASSERT_EQ(slopes.at(field, i + n, j).x, dx);
                ASSERT_EQ(all.at(i + n, j, 1), dy);
            }
        }
}

TEST(MapSlopes, AreKeptOfSmallMapsAloneAndTheSameNumbersEitherWay) {
    for (const int width : {300, 2100}) {  // 2100 x 2000: more than are kept
        HeightField field = hills(width, width == 300 ? 200 : 2000);
        field.bump = Image(field.width(), field.height(), 1);
        const MapSlopes plain(field, relief, 0, executor());
        EXPECT_EQ(plain.bytes() > 0, width == 300);
        expect_slopes(plain, field, false);
        add_mask_and_bump(field);
        expect_slopes(MapSlopes(field, relief, 0, executor()), field, false);
        expect_slopes(MapSlopes(field, relief, bump_relief, executor()), field, true);
    }
    EXPECT_TRUE(MapSlopes().empty());
}

}  // namespace
}  // namespace relit::test
