#include "core/io/webp_animation.h"

#include <gtest/gtest.h>

#include <cstdlib>

#include "core/base/error.h"
#include "core/io/quantise.h"
#include "tests/support/shown_frames.h"

namespace relit {
namespace {

using namespace relit::test;

// A different picture for every `frame`; alpha from 64 on.
Image picture_of(int frame, int channels, int width = 23, int height = 17) {
    Image image(width, height, channels);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            for (int c = 0; c < channels; ++c) {
                const bool alpha = channels % 2 == 0 && c == channels - 1;
                const int step = (x * 5 + y * 3 + c * 40 + frame * 11) % (alpha ? 192 : 256);
                image.at(x, y, c) = float(alpha ? step + 64 : step) / 255.0f;
            }
    return image;
}

std::string animation_of(const std::vector<Image>& pictures, const AnimationOptions& options) {
    WebpAnimation animation(options);
    for (const Image& picture : pictures) animation.add(picture, Executor(1));
    return animation.finish();
}

std::vector<std::uint8_t> rgba_of(const Image& picture) {
    const int channels = picture.channels;
    const bool grey = channels < 3, alpha = channels % 2 == 0;
    std::vector<std::uint8_t> rgba;
    for (int y = 0; y < picture.height; ++y)
        for (int x = 0; x < picture.width; ++x) {
            for (int c = 0; c < 3; ++c)
                rgba.push_back(quantised<std::uint8_t>(picture.at(x, y, grey ? 0 : c)));
            rgba.push_back(alpha ? quantised<std::uint8_t>(picture.at(x, y, channels - 1))
                                 : std::uint8_t(255));
        }
    return rgba;
}

TEST(WebpAnimation, ShowsEveryPictureExactlyWhereItIsLossless) {
    std::vector<Image> pictures;
    for (int frame = 0; frame < 12; ++frame) pictures.push_back(picture_of(frame, frame % 4 + 1));
    const auto animation = shown(animation_of(pictures, {.quality = std::nullopt}));
    ASSERT_EQ(animation.frames.size(), pictures.size());
    EXPECT_EQ(animation.width, 23);
    EXPECT_EQ(animation.height, 17);
    for (std::size_t i = 0; i < pictures.size(); ++i)
        EXPECT_EQ(animation.frames[i].rgba, rgba_of(pictures[i])) << "frame " << i;
}

TEST(WebpAnimation, StaysCloseToPicturesWhereItIsLossy) {
    std::vector<Image> pictures;
    for (int frame = 0; frame < 5; ++frame) {
        Image& image = pictures.emplace_back(64, 48, 3);
        for (int y = 0; y < 48; ++y)
            for (int x = 0; x < 64; ++x)
                for (int c = 0; c < 3; ++c) image.at(x, y, c) = float(x + y + 20 * frame) / 255.0f;
    }
    const std::string fine = animation_of(pictures, {.quality = 95});
    EXPECT_LT(animation_of(pictures, {.quality = 20}).size(), fine.size());
    const auto animation = shown(fine);
    ASSERT_EQ(animation.frames.size(), pictures.size());
    for (std::size_t i = 0; i < pictures.size(); ++i) {
        const auto expected = rgba_of(pictures[i]);
        int largest = 0;
        for (std::size_t k = 0; k < expected.size(); ++k)
            largest = std::max(largest, std::abs(expected[k] - animation.frames[i].rgba[k]));
        EXPECT_LE(largest, 4) << "frame " << i;
    }
}

TEST(WebpAnimation, ShowsEachPictureForItsShareOfASecondAndBeginsAgainForEver) {
    std::vector<Image> pictures;
    for (int frame = 0; frame < 7; ++frame) pictures.push_back(picture_of(frame, 3));
    const auto animation = shown(animation_of(pictures, {.frames_per_second = 30}));
    ASSERT_EQ(animation.frames.size(), 7u);
    const int ends_ms[] = {33, 67, 100, 133, 167, 200, 233};
    for (std::size_t i = 0; i < 7; ++i) EXPECT_EQ(animation.frames[i].end_ms, ends_ms[i]);
    EXPECT_EQ(animation.loops, 0);
}

TEST(WebpAnimation, ShowsEqualPicturesOnceForLonger) {
    const Image first = picture_of(0, 3), second = picture_of(1, 3);
    const auto animation = shown(
        animation_of({first, first, first, second}, {.frames_per_second = 10, .quality = {}}));
    ASSERT_EQ(animation.frames.size(), 2u);
    EXPECT_EQ(animation.frames[0].end_ms, 300);
    EXPECT_EQ(animation.frames[1].end_ms, 400);
}

TEST(WebpAnimation, IsTheSameBytesForTheSamePictures) {
    const std::vector<Image> pictures = {picture_of(0, 4), picture_of(1, 4)};
    EXPECT_EQ(animation_of(pictures, {}), animation_of(pictures, {}));
}

std::string refusal_of(const std::vector<Image>& pictures) try {
    (void)animation_of(pictures, {});
    return "";
} catch (const Error& e) {
    EXPECT_EQ(e.code, error_code::invalid_value);
    return e.what();
}

TEST(WebpAnimation, RefusesPicturesOfAnotherSizeAndTooLargeOnes) {
    EXPECT_EQ(refusal_of({picture_of(0, 3), picture_of(1, 3, 17, 23)}),
              "it is 17 x 23, the frames before it are 23 x 17");
    EXPECT_EQ(refusal_of({Image(1, 16384, 1)}),
              "a WebP picture has at most 16383 pixels a side; this one is 1 x 16384");
    EXPECT_EQ(refusal_of({Image(1, 16383, 1)}), "");
}

}  // namespace
}  // namespace relit
