// Bytes that nobody should have sent: cut off, flipped, lying. What is asked of decode is that it
// answers with a picture or an Error, soon and in little memory.
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <functional>
#include <limits>
#include <optional>
#include <random>

#include <gtest/gtest.h>

#include "core/base/error.h"
#include "core/base/sanitized.h"
#include "core/io/decode.h"
#include "tests/core/io/fixtures.h"
#include "tests/support/encoded.h"

namespace relit {
namespace {

using namespace relit::test;

Image picture(int channels) {
    Image image(24, 20, channels);
    for (std::size_t i = 0; i < image.values.size(); ++i)
        image.values[i] = 0.5f + 0.4f * std::sin(0.05f * float(i));
    return image;
}

struct Fixture {
    std::string name;
    std::string bytes;
};

std::string with_oiio(const char* plugin, OIIO::TypeDesc type, int channels, int tile,
                      const char* compression) {
    OIIO::ImageSpec spec(24, 20, channels, type);
    spec.attribute("compression", compression);
    spec.attribute("ImageDescription", "a description that is longer than one word");
    spec.tile_width = spec.tile_height = tile;
    spec.tile_depth = tile ? 1 : 0;
    return write_with_oiio(plugin, spec, OIIO::TypeDesc::FLOAT, picture(channels).values.data());
}

std::string progressive_jpeg() {
    OIIO::ImageSpec spec(24, 20, 3, OIIO::TypeDesc::UINT8);
    spec.attribute("jpeg:progressive", 1);
    spec.attribute("ImageDescription", "a comment");
    return write_with_oiio("jpeg", spec, OIIO::TypeDesc::FLOAT, picture(3).values.data());
}

std::string tiff_with_no_data() {
    TiffFile file{.order = std::endian::big};
    file.width = 24;
    file.height = 20;
    file.bits = 16;
    file.format = 2;
    file.more = {{42113, {}, "-9999"}};
    for (int i = 0; i < 480; ++i) file.append(std::int16_t(i - 9999));
    return file.bytes();
}

std::string palette_png() {
    const std::string chunks = png_chunk("PLTE", std::string(48, 'p')) + png_chunk("tRNS", "abc");
    return make_png({.width = 24, .height = 20, .depth = 4, .colour_type = 3},
                    std::vector<std::string>(20, std::string(12, '\x5a')), chunks);
}

const std::vector<Fixture>& fixtures() {
    using OIIO::TypeDesc;
    const auto made = [](PictureFormat format, int bit_depth, int channels) {
        return encoded(picture(channels),
                       {.format = format, .bit_depth = bit_depth, .text = {{"Software", "Relit"}}});
    };
    static const std::vector<Fixture> all{
        {"png rgb", made(PictureFormat::png, 8, 3)},
        {"png grey 16", made(PictureFormat::png, 16, 1)},
        {"png palette", palette_png()},
        {"jpeg", made(PictureFormat::jpeg, 8, 3)},
        {"jpeg progressive", progressive_jpeg()},
        {"webp", made(PictureFormat::webp, 8, 3)},
        {"webp alpha", made(PictureFormat::webp, 8, 4)},
        {"exr half zip", made(PictureFormat::exr, 16, 4)},
        {"exr piz tiles", with_oiio("openexr", TypeDesc::HALF, 3, 16, "piz")},
        {"tiff strips", with_oiio("tiff", TypeDesc::FLOAT, 1, 0, "zip")},
        {"tiff tiles lzw", with_oiio("tiff", TypeDesc::UINT16, 3, 16, "lzw")},
        {"tiff double", with_oiio("tiff", TypeDesc::DOUBLE, 1, 0, "zip")},
        {"tiff no data", tiff_with_no_data()},
        {"hdr", with_oiio("hdr", TypeDesc::FLOAT, 3, 0, "none")},
    };
    return all;
}

// A picture or an Error; anything else is for the test to fail on.
std::optional<Image> attempt(const std::string& bytes) {
    try {
        return decode(bytes).image;
    } catch (const Error& error) {
        const std::string words = error.what();
        EXPECT_EQ(words.find("upload"), std::string::npos) << words;
        EXPECT_EQ(words.find("OpenImageIO"), std::string::npos) << words;
        return std::nullopt;
    }
}

bool same_bits(const Image& a, const Image& b) {
    return a.values.size() == b.values.size() &&
           std::memcmp(a.values.data(), b.values.data(), a.values.size() * sizeof(float)) == 0;
}

double seconds(const std::function<void()>& work) {
    const auto start = std::chrono::steady_clock::now();
    work();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// The line `name` of /proc/self/status, in MB.
double status_mb(const std::string& name) {
    std::ifstream status("/proc/self/status");
    for (std::string line; std::getline(status, line);)
        if (line.starts_with(name)) return std::stod(line.substr(name.size() + 1)) / 1024;
    return 0;
}

// Growth of the peak resident set over the time before, in MB; below zero where the kernel does not
// say.
double peak_growth_mb(const std::function<void()>& work) {
    std::ofstream("/proc/self/clear_refs") << 5;  // resets VmHWM
    const double before = status_mb("VmRSS:");
    work();
    return status_mb("VmHWM:") - before;
}

std::string error_words(const std::string& bytes) {
    try {
        (void)decode(bytes);
        return "accepted";
    } catch (const Error& error) {
        return std::string(error.code) + ": " + error.what();
    }
}

// Read as floats they take more room than in the file.
TEST(Hostile, ChannelsOfSeveralTypesAreReadAndHaveRoom) {
    for (const int tile : {0, 16}) {
        SCOPED_TRACE(tile);
        OIIO::ImageSpec spec(24, 20, 2, OIIO::TypeDesc::FLOAT);
        spec.channelnames = {"Y", "A"};
        spec.channelformats = {OIIO::TypeDesc::HALF, OIIO::TypeDesc::FLOAT};
        spec.tile_width = spec.tile_height = tile;
        spec.tile_depth = tile ? 1 : 0;
        Image image(24, 20, 2);
        for (std::size_t i = 0; i < image.values.size(); ++i) image.values[i] = float(i) / 1024;
        const std::string file =
            write_with_oiio("openexr", spec, OIIO::TypeDesc::FLOAT, image.values.data());
        const DecodedImage decoded = decode(file);
        EXPECT_EQ(decoded.info.type, SampleType::float32);
        EXPECT_EQ(decoded.image.values, image.values);
    }
}

TEST(Hostile, EveryFixtureIsSoundToBeginWith) {
    for (const Fixture& fixture : fixtures()) EXPECT_TRUE(attempt(fixture.bytes)) << fixture.name;
}

TEST(Hostile, AFileCutOffAnywhereIsRefusedOrHasLostNoTexel) {
    testing::internal::CaptureStderr();
    for (const Fixture& fixture : fixtures()) {
        const std::optional<Image> whole = attempt(fixture.bytes);
        ASSERT_TRUE(whole) << fixture.name;
        for (std::size_t length = 0; length < fixture.bytes.size(); length += sanitized ? 7 : 1) {
            const std::optional<Image> cut = attempt(fixture.bytes.substr(0, length));
            ASSERT_TRUE(!cut || same_bits(*cut, *whole)) << fixture.name << " at " << length;
        }
    }
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(Hostile, FlippedBytesGiveAPictureOrAnErrorSoonAndInLittleMemory) {
    constexpr int rounds = sanitized ? 400 : 3000;
    double slowest = 0;
    testing::internal::CaptureStderr();
    const double growth = peak_growth_mb([&] {
        for (const Fixture& fixture : fixtures()) {
            std::mt19937 random(42);
            for (int round = 0; round < rounds; ++round) {
                std::string bytes = fixture.bytes;
                const int flips = 1 + int(random() % 4);
                for (int i = 0; i < flips; ++i) {
                    // Headers are where it hurts: half of the flips go there.
                    const std::size_t reach =
                        random() % 2 ? bytes.size() : std::min<std::size_t>(bytes.size(), 200);
                    bytes[random() % reach] = char(random());
                }
                SCOPED_TRACE(testing::Message() << fixture.name << ", round " << round);
                slowest = std::max(slowest, seconds([&] { (void)attempt(bytes); }));
            }
        }
    });
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
    EXPECT_LT(slowest, sanitized ? 20 : 3);
    EXPECT_LT(growth, sanitized ? 1e9 : 1000);
    RecordProperty("slowest_ms", int(1000 * slowest));
    RecordProperty("growth_mb", int(growth));
}

// Flips with the chunk's checksum repaired get past it, to the decompressor. libpng has a word to
// say then: OpenImageIO leaves its messages on.
TEST(Hostile, FlippedPngDataWithRightChecksumsIsSurvived) {
    testing::internal::CaptureStderr();
    std::mt19937 random(7);
    int refused = 0;
    const std::vector<Chunk> chunks = chunks_of(encoded(picture(3)));
    for (int round = 0; round < (sanitized ? 400 : 3000); ++round) {
        std::string bytes = png_signature;
        for (const Chunk& chunk : chunks) {
            std::string data = chunk.data;
            if (!data.empty() && random() % 2) data[random() % data.size()] = char(random());
            bytes += png_chunk(chunk.type, data);
        }
        refused += !attempt(bytes);
    }
    (void)testing::internal::GetCapturedStderr();
    EXPECT_GT(refused, 100);
}

void expect_quick_refusal(const std::string& bytes, const std::string& words) {
    std::string answer;
    double time = 0;
    const double growth =
        peak_growth_mb([&] { time = seconds([&] { answer = error_words(bytes); }); });
    EXPECT_NE(answer.find(words), std::string::npos) << answer;
    EXPECT_LT(time, sanitized ? 1.0 : 0.1) << words;
    EXPECT_LT(growth, sanitized ? 1e9 : 20) << words;
}

TEST(Hostile, APngThatClaimsTenThousandMillionPixelsIsRefusedAtOnce) {
    expect_quick_refusal(
        make_png({.width = 100000, .height = 100000}, {"abc"}),
        "image-too-large: the image is 100000 x 100000 pixels; the limit is 67108864 pixels "
        "(max-image-pixels)");
}

TEST(Hostile, AnInterlacedPngThatClaimsSixtyThousandSquaredIsRefusedAtOnce) {
    expect_quick_refusal(make_png({.width = 60000, .height = 60000, .interlace = 1}, {"abc"}),
                         "image-too-large: the image is 60000 x 60000");
    expect_quick_refusal(make_png({.width = 8000, .height = 8000, .interlace = 1}, {"abc"}),
                         "interlaced");
}

TEST(Hostile, FilesTooShortForTheirClaimAreRefusedAtOnce) {
    const std::string words = "image-broken: ";
    expect_quick_refusal(make_png({.width = 8000, .height = 8000}, {"abc"}), words);
    TiffFile tiff;
    tiff.width = tiff.height = 8000;
    tiff.texels = "abc";
    expect_quick_refusal(tiff.bytes(), words);
    expect_quick_refusal("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 8000 +X 8000\nabcd", words);
}

TEST(Hostile, ATiffTileOfThirtyThousandSquaredIsRefusedAtOnce) {
    TiffFile tiff;
    tiff.width = tiff.height = 64;
    tiff.tile = 30000;
    tiff.texels = "abc";
    expect_quick_refusal(tiff.bytes(), "a tile of the image is larger than the limit");
    tiff.more = {{322, {0x7ffffff0}, {}}, {323, {0x7ffffff0}, {}}};
    expect_quick_refusal(tiff.bytes(), "a tile of the image is larger than the limit");
}

TEST(Hostile, AnExrWindowOfABillionPixelsIsRefusedBeforeItsDecoderSeesIt) {
    std::string bytes = encoded(picture(1), {.format = PictureFormat::exr, .bit_depth = 32});
    const std::string name = std::string("dataWindow\0box2i\0", 17);
    const std::size_t window = bytes.find(name) + name.size() + 4;
    bytes.replace(window + 8, 8,
                  number(99999, 4, std::endian::little) + number(99999, 4, std::endian::little));
    expect_quick_refusal(bytes, "the image is 100000 x 100000");
}

// OpenImageIO's own reader of memory gave bytes from before the file; seen by AddressSanitizer.
TEST(Hostile, RowsOfAnExrThatAreSaidToLieOutsideOfItAreNotRead) {
    using std::endian;
    std::string bytes = with_oiio("openexr", OIIO::TypeDesc::FLOAT, 1, 0, "none");
    std::size_t table = 0;  // of the rows' places: the first is right behind it
    while (table < bytes.size() &&
           bytes.substr(table, 8) != number(table + 20 * 8, 8, endian::little))
        ++table;
    ASSERT_LT(table, bytes.size());
    for (const std::int64_t place :
         {std::int64_t(-1), std::int64_t(-3), std::int64_t(-4), std::int64_t(-1000),
          std::numeric_limits<std::int64_t>::min(), std::numeric_limits<std::int64_t>::max(),
          std::int64_t(bytes.size()) - 1, std::int64_t(bytes.size()), std::int64_t(1) << 40}) {
        bytes.replace(table, 8, number(std::uint64_t(place), 8, endian::little));
        EXPECT_NE(error_words(bytes).find("image-broken: "), std::string::npos) << place;
    }
}

// A true bomb, within the limits: what it costs is the result, once, and not twice.
TEST(Hostile, ALargeGreyPngCostsLittleMoreThanItsFloats) {
    if (sanitized) GTEST_SKIP() << "the sanitizer's own memory is counted";
    const std::string bytes = encoded(Image(4096, 4096, 1, 0.25f));
    const double growth = peak_growth_mb([&] { EXPECT_TRUE(attempt(bytes)); });
    EXPECT_GT(growth, 60) << "MB: the measurement has lost sight of the result";
    EXPECT_LT(growth, 64 + 16) << "MB; the result has 64";
}

}  // namespace
}  // namespace relit
