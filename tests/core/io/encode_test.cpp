#include "core/io/encode.h"

#include <chrono>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <thread>

#include <gtest/gtest.h>

#include "core/base/error.h"
#include "core/io/decode.h"
#include "core/io/quantise.h"
#include "tests/core/io/fixtures.h"
#include "tests/support/encoded.h"
#include "tests/support/maps.h"

namespace relit {
namespace {

using namespace relit::test;

// Steps of the 8-bit scale, which are steps of the 16-bit scale too, different in every channel.
Image gradient(int width, int height, int channels) {
    Image image(width, height, channels);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            for (int c = 0; c < channels; ++c)
                image.at(x, y, c) = float((x * 7 + y * 3 + c * 50) % 256) / 255.0f;
    return image;
}

// No step between neighbours: what a lossy format keeps.
Image waves(int channels) {
    Image image(64, 48, channels);
    for (int y = 0; y < 48; ++y)
        for (int x = 0; x < 64; ++x)
            for (int c = 0; c < channels; ++c)
                image.at(x, y, c) =
                    0.5f + 0.4f * std::sin(0.1f * float(x) + 0.07f * float(y) + float(c));
    return image;
}

float largest_difference(const Image& a, const Image& b) {
    float largest = a.values.size() == b.values.size() ? 0 : std::numeric_limits<float>::infinity();
    for (std::size_t i = 0; std::isfinite(largest) && i < a.values.size(); ++i)
        largest = std::max(largest, std::abs(a.values[i] - b.values[i]));
    return largest;
}

std::string jpeg_by_openimageio(const Image& picture, int quality) {
    OIIO::ImageSpec spec(picture.width, picture.height, picture.channels, OIIO::TypeDesc::UINT8);
    spec.attribute("CompressionQuality", quality);
    spec.attribute("jpeg:subsampling", "4:4:4");
    std::vector<unsigned char> bytes;
    OIIO::Filesystem::IOVecOutput memory(bytes);
    OIIO::Filesystem::IOProxy* proxy = &memory;
    spec.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &proxy);
    const auto output = OIIO::ImageOutput::create("jpeg");
    const auto samples = quantised(picture, Executor(1), {});
    EXPECT_TRUE(output->open("picture", spec) &&
                output->write_image(OIIO::TypeDesc::UINT8, samples.data()) && output->close());
    return std::string(bytes.begin(), bytes.end());
}

std::string types_of(const std::vector<Chunk>& chunks) {
    std::string types;
    for (const Chunk& chunk : chunks) types += chunk.type + " ";
    return types;
}

// --- Quantising ----------------------------------------------------------------------------------

TEST(Quantise, RoundsToTheNearestStep) {
    for (int i = 0; i < 65536; ++i) {
        const double exact = i / 65535.0;
        ASSERT_EQ(quantised<std::uint16_t>(float(exact)), i);
        ASSERT_EQ(quantised<std::uint16_t>(float(exact + 0.49 / 65535)), i);
        ASSERT_EQ(quantised<std::uint16_t>(float(exact - 0.49 / 65535)), i);
    }
    EXPECT_EQ(quantised<std::uint8_t>(0.5f), 128);
    EXPECT_EQ(quantised<std::uint8_t>(0.49f / 255), 0);
    EXPECT_EQ(quantised<std::uint8_t>(0.51f / 255), 1);
}

TEST(Quantise, RowsHoldWhatTheirNumbersGive) {
    Random random(3);
    for (const int size : {1, 2, 127, 128, 129, 1000}) {
        std::vector<float> values(std::size_t(size), std::numeric_limits<float>::quiet_NaN());
        for (std::size_t i = 1; i < values.size(); ++i) values[i] = float(random() * 1.2 - 0.1);
        std::vector<std::uint8_t> row(values.size() + 1, 77);
        quantise_row(std::span<const float>(values), row.data());
        for (std::size_t i = 0; i < values.size(); ++i)
            ASSERT_EQ(row[i], quantised<std::uint8_t>(values[i]));
        EXPECT_EQ(row.back(), 77);
    }
}

TEST(Quantise, ClipsAndMakesNothingOfNaN) {
    const float inf = std::numeric_limits<float>::infinity();
    for (const float low : {-1.0f, -0.0f, -inf, -1e30f, std::numeric_limits<float>::quiet_NaN()})
        EXPECT_EQ(quantised<std::uint8_t>(low), 0) << low;
    for (const float high : {1.0f, 1.5f, 1e30f, inf})
        EXPECT_EQ(quantised<std::uint16_t>(high), 65535) << high;
}

// --- PNG -----------------------------------------------------------------------------------------

TEST(EncodePng, RoundTripsExactlyInEveryDepthAndNumberOfChannels) {
    for (const int depth : {8, 16})
        for (const int channels : {1, 2, 3, 4})
            for (const Effort effort : {Effort::fast, Effort::small})
                for (const bool srgb : {false, true}) {
                    SCOPED_TRACE(testing::Message()
                                 << depth << " bits, " << channels << " channels");
                    const Image picture = gradient(37, 29, channels);
                    const DecodedImage decoded = decode(
                        encoded(picture, {.bit_depth = depth, .effort = effort, .srgb = srgb}));
                    EXPECT_EQ(decoded.info.channels, channels);
                    EXPECT_EQ(decoded.info.has_alpha, channels % 2 == 0);
                    EXPECT_EQ(decoded.info.type,
                              depth == 8 ? SampleType::uint8 : SampleType::uint16);
                    EXPECT_EQ(decoded.image.width, 37);
                    EXPECT_EQ(decoded.image.height, 29);
                    EXPECT_EQ(decoded.image.values, picture.values);
                }
}

// Sides of one pixel, primes, strips of one row, many strips with a short last one.
TEST(EncodePng, RoundTripsExactlyInEverySize) {
    const std::pair<int, int> sizes[] = {{1, 1},     {1, 1009},  {1009, 1},  {2, 3},
                                         {127, 131}, {607, 733}, {32749, 2}, {1999, 2003}};
    for (const auto& [width, height] : sizes)
        for (const int channels : {1, 3, 4})
            for (const int depth : {8, 16})
                for (const Effort effort : {Effort::fast, Effort::small}) {
                    SCOPED_TRACE(testing::Message() << width << " x " << height << " x " << channels
                                                    << ", " << depth << " bits");
                    const Image picture = gradient(width, height, channels);
                    const DecodedImage decoded =
                        decode(encoded(picture, {.bit_depth = depth, .effort = effort}));
                    ASSERT_EQ(decoded.image.width, width);
                    ASSERT_EQ(decoded.image.height, height);
                    ASSERT_TRUE(decoded.image.values == picture.values);
                }
}

// Flat, nearly flat, without any order: what a compressor has its special cases for.
TEST(EncodePng, RoundTripsExactlyWhateverThePictureHolds) {
    Random random(7);
    std::vector<Image> pictures{Image(1500, 1000, 3, 0.0f), Image(1500, 1000, 3, 1.0f),
                                Image(1500, 1000, 3, 0.2f), Image(1500, 1000, 3, 0.0f)};
    pictures[2].at(1499, 999) = 0.4f;
    for (float& value : pictures[3].values) value = float(int(random() * 256)) / 255.0f;
    for (const Image& picture : pictures)
        for (const Effort effort : {Effort::fast, Effort::small}) {
            const std::string file = encoded(picture, {.effort = effort});
            EXPECT_TRUE(decode(file).image.values == picture.values);
            EXPECT_LE(file.size(), picture.values.size() * 101 / 100);
        }
}

TEST(EncodePng, EverySixteenBitNumberComesBack) {
    Image picture(256, 256, 1);
    for (int i = 0; i < 65536; ++i) picture.values[std::size_t(i)] = float(i / 65535.0);
    EXPECT_EQ(decode(encoded(picture, {.bit_depth = 16})).image.values, picture.values);
}

TEST(EncodePng, ColourUnderFullTransparencySurvives) {
    Image picture(1, 1, 4);
    picture.values = {0.2f, 0.4f, 0.6f, 0.0f};
    EXPECT_EQ(decode(encoded(picture)).image.values, picture.values);
}

TEST(EncodePng, ColourIsMarkedAsSrgbAndDataAsNothing) {
    const Image picture = gradient(4, 4, 3);
    const std::vector<Chunk> colour = chunks_of(encoded(picture, {.srgb = true}));
    EXPECT_EQ(types_of(colour), "IHDR sRGB IDAT IDAT IEND ");
    EXPECT_EQ(colour[1].data, std::string(1, '\0'));
    EXPECT_EQ(types_of(chunks_of(encoded(picture, {.srgb = false}))), "IHDR IDAT IDAT IEND ");
}

TEST(EncodePng, TextStandsUnderItsKeywordInTheNarrowestEncoding) {
    const std::string latin = "25 \xc2\xb0", wide = "\xe2\x82\xac";
    const std::vector<Chunk> chunks = chunks_of(encoded(
        gradient(2, 2, 1), {.text = {{"Software", "Relit"}, {"Angle", latin}, {"Price", wide}}}));
    ASSERT_EQ(types_of(chunks), "IHDR sRGB tEXt tEXt iTXt IDAT IDAT IEND ");
    EXPECT_EQ(chunks[2].data, std::string("Software\0Relit", 14));
    EXPECT_EQ(chunks[3].data, std::string("Angle\0"
                                          "25 \xb0",
                                          10));
    EXPECT_EQ(chunks[4].data, std::string("Price\0\0\0\0\0", 10) + wide);
}

TEST(EncodePng, TextOfMegabytesStaysWhole) {
    const std::string text(std::size_t(5) << 20, 'x');
    const std::vector<Chunk> chunks =
        chunks_of(encoded(gradient(2, 2, 1), {.text = {{"relit-scene", text}}}));
    ASSERT_EQ(types_of(chunks), "IHDR sRGB tEXt IDAT IDAT IEND ");
    EXPECT_TRUE(chunks[2].data == std::string("relit-scene\0", 12) + text);
}

TEST(EncodePng, HeaderSaysSizeDepthAndColour) {
    const std::map<int, int> colour_types{{1, 0}, {2, 4}, {3, 2}, {4, 6}};
    for (const auto& [channels, type] : colour_types) {
        const std::string ihdr =
            chunks_of(encoded(gradient(300, 2, channels), {.bit_depth = 16}))[0].data;
        EXPECT_EQ(ihdr, big(300, 4) + big(2, 4) + char(16) + char(type) + std::string(3, '\0'));
    }
}

TEST(EncodePng, SmallIsSmaller) {
    const Image picture = waves(3);
    EXPECT_LT(encoded(picture, {.effort = Effort::small}).size(), encoded(picture).size());
}

// --- JPEG ----------------------------------------------------------------------------------------

TEST(EncodeJpeg, IsBaselineWithFullResolutionColour) {
    for (const int channels : {1, 3}) {
        const std::string bytes = encoded(waves(channels), {.format = PictureFormat::jpeg});
        const std::size_t frame = bytes.find("\xff\xc0");
        ASSERT_NE(frame, std::string::npos);
        EXPECT_EQ(bytes[frame + 9], channels);
        for (int c = 0; c < channels; ++c) EXPECT_EQ(bytes[frame + 11 + 3 * std::size_t(c)], 0x11);
    }
}

TEST(EncodeJpeg, KeepsWavesWithinAFewSteps) {
    for (const int channels : {1, 3}) {
        const Image picture = waves(channels);
        const DecodedImage decoded =
            decode(encoded(picture, {.format = PictureFormat::jpeg, .quality = 95}));
        EXPECT_EQ(decoded.info.channels, channels);
        EXPECT_LE(largest_difference(decoded.image, picture), 8.0f / 255);
    }
}

// Strips end where blocks end, so whoever decodes the file cannot tell that there were any.
TEST(EncodeJpeg, HoldsWhatOpenImageIOWouldWriteInEverySize) {
    const std::pair<int, int> sizes[] = {{1, 1},     {1, 1009},  {1009, 1},
                                         {127, 131}, {607, 733}, {32749, 17}};
    for (const auto& [width, height] : sizes)
        for (const int channels : {1, 3})
            for (const int quality : {1, 85, 100}) {
                SCOPED_TRACE(testing::Message()
                             << width << " x " << height << " x " << channels << " at " << quality);
                const Image picture = gradient(width, height, channels);
                const std::string file =
                    encoded(picture, {.format = PictureFormat::jpeg, .quality = quality});
                ASSERT_TRUE(decode(file).image.values ==
                            decode(jpeg_by_openimageio(picture, quality)).image.values);
            }
}

TEST(EncodeJpeg, QualityBuysBytes) {
    const Image picture = gradient(64, 64, 3);
    const auto size = [&](int quality) {
        return encoded(picture, {.format = PictureFormat::jpeg, .quality = quality}).size();
    };
    EXPECT_LT(size(10), size(50));
    EXPECT_LT(size(50), size(95));
}

// --- WebP ----------------------------------------------------------------------------------------

TEST(EncodeWebp, KeepsWavesWithinAFewStepsAndAlphaExactly) {
    for (const Effort effort : {Effort::fast, Effort::small})
        for (const int channels : {1, 2, 3, 4}) {
            SCOPED_TRACE(testing::Message() << channels << " channels");
            const Image picture = waves(channels);
            const bool alpha = channels % 2 == 0;
            const DecodedImage decoded = decode(
                encoded(picture, {.format = PictureFormat::webp, .quality = 95, .effort = effort}));
            ASSERT_EQ(decoded.info.channels, alpha ? 4 : 3);
            ASSERT_EQ(decoded.info.has_alpha, alpha);
            for (int y = 0; y < picture.height; ++y)
                for (int x = 0; x < picture.width; ++x) {
                    for (int c = 0; c < 3; ++c)
                        ASSERT_NEAR(decoded.image.at(x, y, c),
                                    picture.at(x, y, channels > 2 ? c : 0), 0.1f);
                    if (!alpha) continue;
                    ASSERT_NEAR(decoded.image.at(x, y, 3), picture.at(x, y, channels - 1),
                                0.5001f / 255);
                }
        }
}

TEST(EncodeWebp, IsLossy) {
    const std::string bytes = encoded(waves(3), {.format = PictureFormat::webp});
    EXPECT_EQ(bytes.substr(12, 4), "VP8 ");
}

// --- OpenEXR -------------------------------------------------------------------------------------

TEST(EncodeExr, FloatsComeBackAsTheyAreInEveryNumberOfChannels) {
    for (const int channels : {1, 2, 3, 4}) {
        Image picture = gradient(33, 20, channels);
        for (float& value : picture.values) value = 1000 * value - 3.7f;
        if (channels % 2 == 0)
            for (std::size_t i = channels - 1; i < picture.values.size(); i += channels)
                picture.values[i] = 1;
        const DecodedImage decoded =
            decode(encoded(picture, {.format = PictureFormat::exr, .bit_depth = 32}));
        EXPECT_EQ(decoded.info.type, SampleType::float32);
        EXPECT_EQ(decoded.info.channels, channels);
        EXPECT_EQ(decoded.info.has_alpha, channels % 2 == 0);
        EXPECT_EQ(decoded.image.values, picture.values);
    }
}

TEST(EncodeExr, HalvesHaveElevenBitsAndMarkWhatIsNotFinite) {
    Image picture(4, 1, 1);
    picture.values = {1.0f / 3, 1e6f, std::numeric_limits<float>::quiet_NaN(), -0.25f};
    const DecodedImage decoded =
        decode(encoded(picture, {.format = PictureFormat::exr, .bit_depth = 16}));
    EXPECT_EQ(decoded.info.type, SampleType::float16);
    EXPECT_NEAR(decoded.image.values[0], 1.0f / 3, 1.0f / 8192);
    EXPECT_TRUE(std::isinf(decoded.image.values[1]));
    EXPECT_TRUE(std::isnan(decoded.image.values[2]));
    EXPECT_EQ(decoded.image.values[3], -0.25f);
}

TEST(EncodeExr, TextBecomesAttributes) {
    const std::string bytes =
        encoded(gradient(2, 2, 3), {.format = PictureFormat::exr,
                                    .bit_depth = 16,
                                    .text = {{"Relit-Scene", "{\"relief\":1}"}}});
    EXPECT_NE(bytes.find(std::string("Relit-Scene\0string\0", 19)), std::string::npos);
    EXPECT_NE(bytes.find("{\"relief\":1}"), std::string::npos);
}

// --- All -----------------------------------------------------------------------------------------

TEST(Encode, TheSamePictureGivesTheSameBytes) {
    for (const PictureFormat format :
         {PictureFormat::png, PictureFormat::jpeg, PictureFormat::webp, PictureFormat::exr})
        for (const Effort effort : {Effort::fast, Effort::small}) {
            const EncodeOptions options{.format = format,
                                        .bit_depth = format == PictureFormat::exr ? 16 : 8,
                                        .effort = effort};
            EXPECT_EQ(encoded(waves(3), options), encoded(waves(3), options))
                << media_type_of(format);
        }
}

TEST(Encode, AnyNumberOfThreadsGivesTheSameBytes) {
    const Image picture = gradient(607, 733, 3);
    for (const PictureFormat format :
         {PictureFormat::png, PictureFormat::jpeg, PictureFormat::webp, PictureFormat::exr})
        for (const Effort effort : {Effort::fast, Effort::small}) {
            const EncodeOptions options{.format = format,
                                        .bit_depth = format == PictureFormat::exr ? 16 : 8,
                                        .effort = effort};
            const std::string one = encode(picture, options, {Executor(1)});
            for (const int threads : {2, 3})
                EXPECT_TRUE(encode(picture, options, {Executor(threads)}) == one)
                    << media_type_of(format) << " by " << threads;
        }
}

TEST(Encode, IsCancelledBeforeAndInTheMiddle) {
    const Image picture = gradient(2048, 2048, 3);
    const Executor two(2);
    for (const PictureFormat format :
         {PictureFormat::png, PictureFormat::jpeg, PictureFormat::webp, PictureFormat::exr}) {
        const EncodeOptions options{.format = format,
                                    .bit_depth = format == PictureFormat::exr ? 16 : 8};
        const auto code_after = [&](std::stop_source& stop) -> std::string_view {
            try {
                (void)encode(picture, options, {two, stop.get_token()});
                return "written";
            } catch (const Error& error) {
                return error.code;
            }
        };
        std::stop_source before;
        before.request_stop();
        EXPECT_EQ(code_after(before), error_code::cancelled) << media_type_of(format);
        if (format == PictureFormat::exr) continue;  // its library cannot be stopped
        std::stop_source middle;
        const std::jthread stopper([&] {
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
            middle.request_stop();
        });
        EXPECT_EQ(code_after(middle), error_code::cancelled) << media_type_of(format);
    }
}

TEST(Encode, HoldsNoDateOfToday) {
    const std::string bytes = encoded(waves(3), {.format = PictureFormat::exr, .bit_depth = 16});
    EXPECT_EQ(bytes.find("capDate") == std::string::npos,
              bytes.find("1970:01:01") == std::string::npos);
}

TEST(Encode, OnePixelIsEnough) {
    for (const PictureFormat format :
         {PictureFormat::png, PictureFormat::jpeg, PictureFormat::webp, PictureFormat::exr}) {
        const std::string bytes =
            encoded(Image(1, 1, 3, 0.5f),
                    {.format = format, .bit_depth = format == PictureFormat::exr ? 32 : 8});
        const Image image = decode(bytes).image;
        ASSERT_EQ(image.values.size(), 3u) << media_type_of(format);
        EXPECT_NEAR(image.values[0], 0.5f, 3.0f / 255) << media_type_of(format);
    }
}

TEST(Encode, PicturesThatTheFormatCannotHoldAreRefusedByName) {
    const auto refused = [](PictureFormat format, int width, const std::string& words) {
        try {
            (void)encoded(Image(width, 1, 3), {.format = format});
            ADD_FAILURE() << "written";
        } catch (const Error& error) {
            EXPECT_EQ(error.code, error_code::invalid_value);
            EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
        }
    };
    refused(PictureFormat::webp, 16384, "WebP");
    refused(PictureFormat::jpeg, 65536, "JPEG");
}

}  // namespace
}  // namespace relit
