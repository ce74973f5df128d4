// Pictures that are made while they are written.
#include <gtest/gtest.h>

#include <algorithm>

#include "core/io/encode.h"
#include "tests/core/io/fixtures.h"
#include "tests/support/maps.h"

namespace relit::test {
namespace {

// Hands out an image and keeps how.
struct Source {
    const Image& image;
    int next = 0;
    int most = 0;  // rows at a time

    PictureRows rows() {
        return {image.width, image.height, image.channels, [this](RowRange wanted) {
                    EXPECT_EQ(wanted.begin, next);
                    next = wanted.end;
                    most = std::max(most, wanted.end - wanted.begin);
                    Image some(image.width, wanted.end - wanted.begin, image.channels);
                    std::copy_n(image.row(wanted.begin).data(), some.values.size(),
                                some.values.data());
                    return some;
                }};
    }
};

TEST(EncodeRows, WritesTheFileOfTheWholePicture) {
    // 9000 wide: some 220 rows of colour at a time.
    for (const int channels : {1, 3, 4}) {
        Image picture(9000, 700, channels);
        Random random(channels);
        for (std::size_t n = 0; n < picture.values.size(); ++n)
            picture.values[n] = float(n % 4096) / 4096 + 0.01f * float(random());
        for (const PictureFormat format : {PictureFormat::png, PictureFormat::jpeg})
            for (const Effort effort : {Effort::fast, Effort::small}) {
                if (format == PictureFormat::jpeg && (channels == 4 || effort == Effort::small))
                    continue;
                SCOPED_TRACE(testing::Message() << media_type_of(format) << ", " << channels);
                const EncodeOptions options{.format = format, .effort = effort};
                Source source{picture};
                EXPECT_TRUE(encode(source.rows(), options, {executor()}) ==
                            encode(picture, options, {executor()}));
                EXPECT_EQ(source.next, picture.height);
                EXPECT_LE(std::size_t(source.most) * picture.row(0).size_bytes(), std::size_t(24)
                                                                                      << 20);
            }
    }
}

TEST(EncodeRows, OtherFormatsTakeThePictureAtOnce) {
    const Image picture(300, 200, 3, 0.5f);
    for (const PictureFormat format : {PictureFormat::webp, PictureFormat::exr}) {
        const EncodeOptions options{.format = format,
                                    .bit_depth = format == PictureFormat::exr ? 16 : 8};
        Source source{picture};
        EXPECT_TRUE(encode(source.rows(), options, {executor()}) ==
                    encode(picture, options, {executor()}));
        EXPECT_EQ(source.most, picture.height);
    }
}

}  // namespace
}  // namespace relit::test
