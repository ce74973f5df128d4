#include "core/image/resample.h"

#include <gtest/gtest.h>

#include <limits>

#include "tests/support/maps.h"

namespace relit::test {
namespace {

Image noise(int width, int height, int channels) {
    Random random(5);
    Image image(width, height, channels);
    for (float& v : image.values) v = float(random());
    return image;
}

TEST(Resample, ToTheSameSizeIsACopy) {
    const Image image = noise(7, 5, 3);
    EXPECT_EQ(resample(image, 7, 5, executor()).values, image.values);
}

TEST(Resample, DownIsTheExactAreaAverage) {
    const Image image = noise(6, 5, 1);
    const Image small = resample(image, 4, 2, executor());  // 1.5 x 2.5 texels each
    double expected = 0;
    for (int y = 0; y < 3; ++y)
        for (int x = 1; x < 3; ++x) {
            const double wx = x == 1 ? 0.5 : 1.0, wy = y == 2 ? 0.5 : 1.0;
            expected += wx * wy * image.at(x, y);
        }
    EXPECT_NEAR(small.at(1, 0), expected / (1.5 * 2.5), 1e-6);
}

TEST(Resample, KeepsTheMeanWhenItAveragesDown) {
    const Image image = noise(97, 61, 1);
    const Image small = resample(image, 13, 7, executor());
    const auto mean = [](const Image& i) {
        double sum = 0;
        for (const float v : i.values) sum += v;
        return sum / double(i.values.size());
    };
    EXPECT_NEAR(mean(small), mean(image), 1e-6);
}

TEST(Resample, UpGoesThroughSlopesWithoutBendingThem) {
    Image ramp(8, 1, 1);
    for (int x = 0; x < 8; ++x) ramp.at(x, 0) = float(x);
    const Image wide = resample(ramp, 24, 1, executor());
    for (int x = 6; x < 18; ++x) EXPECT_NEAR(wide.at(x, 0), (x + 0.5) / 3 - 0.5, 1e-5) << x;
}

TEST(Resample, OfAWindowReadsBeyondItSoThatTilesJoin) {
    const Image image = noise(32, 20, 1);
    const Image whole = resample(image, 96, 60, executor());
    const Image tile = resample(image, {8, 5, 16, 10}, 48, 30, executor());
    for (int y = 0; y < 30; ++y)
        for (int x = 0; x < 48; ++x) EXPECT_NEAR(tile.at(x, y), whole.at(x + 24, y + 15), 1e-6);
}

TEST(Resample, SupportIsWhatAWindowReads) {
    EXPECT_EQ(resample_support({8, 5, 16, 10}, 48, 30, 32, 20), (Rect{6, 3, 20, 14}));
    EXPECT_EQ(resample_support({0, 5, 32, 15}, 64, 10, 32, 20), (Rect{0, 5, 32, 15}));
}

TEST(Resample, KeepsInfinityInfiniteAndMakesNoNan) {
    Image image(6, 6, 1, 1);
    image.at(2, 2) = std::numeric_limits<float>::infinity();
    for (const Image& result :
         {resample(image, 17, 13, executor()), resample(image, 3, 3, executor())}) {
        int infinite = 0;
        for (const float v : result.values) {
            EXPECT_FALSE(std::isnan(v));
            infinite += std::isinf(v);
        }
        EXPECT_GT(infinite, 0);
    }
}

}  // namespace
}  // namespace relit::test
