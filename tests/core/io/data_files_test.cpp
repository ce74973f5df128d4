// Files that people made, by programs that are not ours.
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "core/io/decode.h"
#include "tests/support/data.h"

namespace relit {
namespace {

using namespace relit::test;

struct Range {
    float min = std::numeric_limits<float>::infinity();
    float max = -std::numeric_limits<float>::infinity();
};

Range range_of(const Image& image) {
    Range range;
    for (const float value : image.values) {
        range.min = std::fmin(range.min, value);
        range.max = std::fmax(range.max, value);
    }
    return range;
}

bool is_image(const std::filesystem::path& path) {
    const std::string extension = path.extension();
    return extension == ".png" || extension == ".jpg" || extension == ".tif" ||
           extension == ".hdr" || extension == ".exr";
}

TEST(DataFiles, AreAllReadAndFinite) {
    RELIT_SKIP_WITHOUT_DATA("index.json");
    int files = 0;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(data_folder())) {
        if (!is_image(entry.path())) continue;
        SCOPED_TRACE(entry.path().filename());
        DecodedImage decoded;
        ASSERT_NO_THROW(decoded = decode(read_file(entry.path())));
        const Image& image = decoded.image;
        ASSERT_EQ(image.values.size(), image.texels() * std::size_t(image.channels));
        EXPECT_EQ(image.width, decoded.info.width);
        const Range range = range_of(image);
        EXPECT_TRUE(std::isfinite(range.min) && std::isfinite(range.max));
        EXPECT_LT(range.min, range.max);
        ++files;
    }
    EXPECT_GE(files, 50);
}

// `dem/README`: the 16-bit maps are the float ones scaled linearly from their minimum to their
// maximum.
TEST(DataFiles, TerrainInFloatsAndInSixteenBitsAgree) {
    for (const std::string name : {"st_helens", "jacksboro", "monterey_bay"}) {
        RELIT_SKIP_WITHOUT_DATA("dem/" + name + "_f32.tif");
        SCOPED_TRACE(name);
        const Image metres = decode(read_data("dem/" + name + "_f32.tif")).image;
        const Image scaled = decode(read_data("dem/" + name + "_u16.png")).image;
        ASSERT_EQ(metres.values.size(), scaled.values.size());
        const auto [min, max] = range_of(metres);
        for (std::size_t i = 0; i < metres.values.size(); ++i)
            ASSERT_NEAR(scaled.values[i], (metres.values[i] - min) / (max - min), 0.51 / 65535)
                << i;
    }
}

// The .exr is the map before its numbers were rounded to the 8-bit mantissas of the .hdr.
TEST(DataFiles, TheSameEnvironmentInHdrAndExrAgreesToTheSharedExponent) {
    RELIT_SKIP_WITHOUT_DATA("env/studio_small_03.exr");
    const Image hdr = decode(read_data("env/studio_small_03.hdr")).image;
    const Image exr = decode(read_data("env/studio_small_03.exr")).image;
    ASSERT_EQ(hdr.values.size(), exr.values.size());
    for (std::size_t i = 0; i < exr.values.size(); i += 3) {
        const float largest = std::max({exr.values[i], exr.values[i + 1], exr.values[i + 2]});
        for (std::size_t c = 0; c < 3; ++c)
            ASSERT_NEAR(hdr.values[i + c], exr.values[i + c], largest / 100) << "texel " << i / 3;
    }
}

TEST(DataFiles, HeightMapsAreSixteenBitGreyAndReachOne) {
    RELIT_SKIP_WITHOUT_DATA("heights/bunny_512_height.png");
    const DecodedImage bunny = decode(read_data("heights/bunny_512_height.png"));
    EXPECT_EQ(bunny.info.type, SampleType::uint16);
    EXPECT_EQ(bunny.info.channels, 1);
    EXPECT_EQ(range_of(bunny.image).min, 0.0f);
    EXPECT_NEAR(range_of(bunny.image).max, 1.0f, 0.01f);
}

}  // namespace
}  // namespace relit
