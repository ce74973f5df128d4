#include "core/io/decode.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <Imath/half.h>
#include <gtest/gtest.h>

#include "core/base/error.h"
#include "tests/core/io/fixtures.h"

namespace relit {
namespace {

using namespace relit::test;
using Floats = Texels;

constexpr float nan = std::numeric_limits<float>::quiet_NaN();

// Equal, with NaN equal to NaN.
void expect_values(const Image& image, const Floats& expected) {
    ASSERT_EQ(image.values.size(), expected.size());
    for (std::size_t i = 0; i < expected.size(); ++i) {
        SCOPED_TRACE(testing::Message() << "value " << i);
        EXPECT_EQ(std::isnan(image.values[i]), std::isnan(expected[i]));
        if (!std::isnan(expected[i])) {
            EXPECT_EQ(image.values[i], expected[i]);
        }
    }
}

void expect_info(const ImageInfo& info, FileFormat format, SampleType type, int channels,
                 bool alpha) {
    EXPECT_EQ(name_of(info.format), name_of(format));
    EXPECT_EQ(name_of(info.type), name_of(type));
    EXPECT_EQ(info.channels, channels);
    EXPECT_EQ(info.has_alpha, alpha);
}

void expect_refused(const std::string& bytes, std::string_view code, const std::string& words,
                    const DecodeLimits& limits = {}) {
    try {
        (void)decode(bytes, limits);
        FAIL() << "accepted";
    } catch (const Error& error) {
        EXPECT_EQ(error.code, code);
        EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
    }
}

// --- Formats by their first bytes ----------------------------------------------------------------

TEST(Sniff, KnowsEveryFormatByItsFirstBytes) {
    using namespace std::string_literals;
    EXPECT_EQ(sniff_format("\x89PNG\r\n\x1a\n"), FileFormat::png);
    EXPECT_EQ(sniff_format("\xff\xd8\xff\xdb"), FileFormat::jpeg);
    EXPECT_EQ(sniff_format("RIFF\x10\x00\x00\x00WEBPVP8 "s), FileFormat::webp);
    for (const std::string& tiff : {"II*\0"s, "MM\0*"s, "II+\0"s, "MM\0+"s})
        EXPECT_EQ(sniff_format(tiff), FileFormat::tiff);
    EXPECT_EQ(sniff_format("\x76\x2f\x31\x01"), FileFormat::exr);
    EXPECT_EQ(sniff_format("#?RADIANCE\n"), FileFormat::hdr);
    EXPECT_EQ(sniff_format("#?RGBE\n"), FileFormat::hdr);
}

TEST(Sniff, RefusesWhatIsNotOnTheList) {
    for (const std::string bytes :
         {"", "GIF89a", "BM", "<svg/>", "RIFF\x10\x01\x01\x01WAVE", "P6 1 1 255"})
        expect_refused(bytes, error_code::image_not_supported, "PNG, JPEG, WebP, TIFF, OpenEXR");
}

// --- PNG -----------------------------------------------------------------------------------------

TEST(DecodePng, EveryByteIsTheNearestFloatToItsFraction) {
    std::vector<std::string> rows(16);
    Floats expected;
    for (int i = 0; i < 256; ++i) {
        rows[std::size_t(i / 16)] += char(i);
        expected.push_back(float(double(i) / 255.0));
    }
    const DecodedImage decoded = decode(make_png({.width = 16, .height = 16}, rows));
    expect_info(decoded.info, FileFormat::png, SampleType::uint8, 1, false);
    expect_values(decoded.image, expected);
}

TEST(DecodePng, EverySixteenBitNumberIsTheNearestFloatToItsFraction) {
    std::vector<std::string> rows(256);
    Floats expected;
    for (int i = 0; i < 65536; ++i) {
        rows[std::size_t(i / 256)] += big(std::uint64_t(i), 2);
        expected.push_back(float(double(i) / 65535.0));
    }
    const DecodedImage decoded = decode(make_png({.width = 256, .height = 256, .depth = 16}, rows));
    expect_info(decoded.info, FileFormat::png, SampleType::uint16, 1, false);
    EXPECT_EQ(decoded.image.values, expected);
    EXPECT_EQ(decoded.image.values.back(), 1.0f);
}

TEST(DecodePng, GreyOfOneTwoAndFourBitsReachesFromBlackToWhite) {
    for (const int depth : {1, 2, 4}) {
        SCOPED_TRACE(depth);
        const int max = (1 << depth) - 1;
        std::string row;
        Floats expected;
        for (int first = 0; first <= max; first += 8 / depth) {
            int packed = 0;
            for (int i = 0; i < 8 / depth; ++i) {
                const int value = (first + i) & max;
                packed = packed << depth | value;
                expected.push_back(float(double(value) / max));
            }
            row += char(packed);
        }
        const DecodedImage decoded =
            decode(make_png({.width = std::uint32_t(expected.size()), .depth = depth}, {row}));
        expect_info(decoded.info, FileFormat::png, SampleType::uint8, 1, false);
        expect_values(decoded.image, expected);
    }
}

TEST(DecodePng, ChannelsKeepTheirOrderAndAlphaDoesNotTouchColour) {
    const std::string rgba{'\x33', '\x66', '\x00', '\x00', '\x99', '\xcc', '\xff', '\x33'};
    const DecodedImage decoded = decode(make_png({.width = 2, .colour_type = 6}, {rgba}));
    expect_info(decoded.info, FileFormat::png, SampleType::uint8, 4, true);
    expect_values(decoded.image, {0.2f, 0.4f, 0.0f, 0.0f, 0.6f, 0.8f, 1.0f, 0.2f});

    const DecodedImage grey =
        decode(make_png({.depth = 16, .colour_type = 4}, {"\x33\x33\x66\x66"}));
    expect_info(grey.info, FileFormat::png, SampleType::uint16, 2, true);
    expect_values(grey.image, {0.2f, 0.4f});

    const DecodedImage rgb = decode(make_png({.colour_type = 2}, {"\x33\x66\x99"}));
    expect_info(rgb.info, FileFormat::png, SampleType::uint8, 3, false);
    expect_values(rgb.image, {0.2f, 0.4f, 0.6f});
}

TEST(DecodePng, PalettesAreExpandedWithTheirTransparency) {
    const std::string palette = png_chunk("PLTE", "\x33\x66\x99\xff\xcc\xff");
    const std::string indices{'\x10'};  // 0, 1 in two bits each
    const PngHeader header{.width = 2, .depth = 2, .colour_type = 3};
    const DecodedImage opaque = decode(make_png(header, {indices}, palette));
    expect_info(opaque.info, FileFormat::png, SampleType::uint8, 3, false);
    expect_values(opaque.image, {0.2f, 0.4f, 0.6f, 1.0f, 0.8f, 1.0f});

    const DecodedImage clear =
        decode(make_png(header, {indices}, palette + png_chunk("tRNS", "\x33")));
    expect_info(clear.info, FileFormat::png, SampleType::uint8, 4, true);
    expect_values(clear.image, {0.2f, 0.4f, 0.6f, 0.2f, 1.0f, 0.8f, 1.0f, 1.0f});
}

TEST(DecodePng, ATransparentGreyBecomesAnAlphaChannel) {
    const std::string key = png_chunk("tRNS", big(0x1234, 2));
    const DecodedImage decoded =
        decode(make_png({.width = 2, .depth = 16}, {big(0x1234, 2) + big(0xffff, 2)}, key));
    expect_info(decoded.info, FileFormat::png, SampleType::uint16, 2, true);
    expect_values(decoded.image, {float(0x1234) / 65535.0f, 0.0f, 1.0f, 1.0f});
}

TEST(DecodePng, ColourProfilesAndGammaDoNotChangeTheNumbers) {
    const std::string before = png_chunk("gAMA", big(100000, 4)) +
                               png_chunk("sRGB", std::string(1, '\0')) + png_chunk("iCCP", "name") +
                               png_chunk("tEXt", std::string("a\0b", 3)) +
                               png_chunk("oFFs", big(7, 4) + big(7, 4) + '\0');
    const DecodedImage decoded = decode(make_png({.colour_type = 6}, {"\x33\x66\x99\xcc"}, before));
    expect_values(decoded.image, {0.2f, 0.4f, 0.6f, 0.8f});
}

// The seven passes of Adam7 over an 8 x 8 picture whose texel is its own number (PNG 8.2).
TEST(DecodePng, InterlacedTexelsComeBackInPlace) {
    constexpr int pass[7][4] = {{0, 0, 8, 8}, {4, 0, 8, 8}, {0, 4, 4, 8}, {2, 0, 4, 4},
                                {0, 2, 2, 4}, {1, 0, 2, 2}, {0, 1, 1, 2}};
    std::vector<std::string> rows;
    for (const auto& [x0, y0, dx, dy] : pass)
        for (int y = y0; y < 8; y += dy) {
            std::string row;
            for (int x = x0; x < 8; x += dx) row += char(8 * y + x);
            rows.push_back(row);
        }
    const DecodedImage decoded = decode(make_png({.width = 8, .height = 8, .interlace = 1}, rows));
    for (int i = 0; i < 64; ++i) EXPECT_EQ(decoded.image.values[std::size_t(i)], float(i) / 255.0f);
}

// --- TIFF ----------------------------------------------------------------------------------------

template <class T>
std::string tiff_of(const std::vector<T>& values, int format, std::endian order, bool big_tiff) {
    TiffFile file{.order = order, .big_tiff = big_tiff};
    file.width = std::uint32_t(values.size());
    file.bits = 8 * int(sizeof(T));
    file.format = format;
    for (const T value : values) file.append(value);
    return file.bytes();
}

template <class T>
void expect_tiff(int format, SampleType type, const std::vector<T>& values,
                 const Floats& expected) {
    for (const std::endian order : {std::endian::little, std::endian::big})
        for (const bool big_tiff : {false, true}) {
            SCOPED_TRACE(testing::Message()
                         << name_of(type) << (order == std::endian::big ? " big" : " little")
                         << " endian" << (big_tiff ? ", BigTIFF" : ""));
            const DecodedImage decoded = decode(tiff_of(values, format, order, big_tiff));
            expect_info(decoded.info, FileFormat::tiff, type, 1, false);
            expect_values(decoded.image, expected);
        }
}

TEST(DecodeTiff, UnsignedNumbersAreDividedByTheirMaximum) {
    expect_tiff<std::uint8_t>(1, SampleType::uint8, {0, 51, 255}, {0, 0.2f, 1});
    expect_tiff<std::uint16_t>(1, SampleType::uint16, {0, 13107, 65535}, {0, 0.2f, 1});
    expect_tiff<std::uint32_t>(1, SampleType::uint32, {0, 858993459, 4294967295}, {0, 0.2f, 1});
}

TEST(DecodeTiff, SignedNumbersAndFloatsAreAsStored) {
    expect_tiff<std::int8_t>(2, SampleType::int8, {-128, 0, 127}, {-128, 0, 127});
    expect_tiff<std::int16_t>(2, SampleType::int16, {-32768, 431, 32767}, {-32768, 431, 32767});
    expect_tiff<std::int32_t>(2, SampleType::int32, {-2147483647, 8848}, {-2147483647.0f, 8848});
    expect_tiff<float>(3, SampleType::float32, {-2805.53f, 1e30f, nan}, {-2805.53f, 1e30f, nan});
    expect_tiff<double>(3, SampleType::float64, {0.1, -1e-20, 8848.86}, {0.1f, -1e-20f, 8848.86f});
}

TEST(DecodeTiff, DoublesAreReadFromStripsAndTiles) {
    for (const int tile : {0, 16})
        for (const char* compression : {"none", "zip"}) {
            SCOPED_TRACE(testing::Message() << compression << ", tile " << tile);
            OIIO::ImageSpec spec(33, 40, 2, OIIO::TypeDesc::DOUBLE);
            spec.attribute("compression", compression);
            spec.alpha_channel = -1;
            spec.tile_width = spec.tile_height = tile;
            spec.tile_depth = tile ? 1 : 0;
            std::vector<double> values(33 * 40 * 2);
            for (std::size_t i = 0; i < values.size(); ++i) values[i] = double(i) / 7;
            const DecodedImage decoded =
                decode(write_with_oiio("tiff", spec, OIIO::TypeDesc::DOUBLE, values.data()));
            for (int y = 0; y < 40; ++y)
                for (int x = 0; x < 33; ++x)
                    ASSERT_EQ(decoded.image.at(x, y), float(values[std::size_t(y * 33 + x) * 2]));
        }
}

TEST(DecodeTiff, HalfFloatsAreAsStored) {
    for (const std::endian order : {std::endian::little, std::endian::big}) {
        TiffFile file{.order = order};
        file.width = 3;
        file.bits = 16;
        file.format = 3;
        for (const float value : {0.5f, -2.0f, 1024.0f}) file.append(half(value).bits());
        const DecodedImage decoded = decode(file.bytes());
        expect_info(decoded.info, FileFormat::tiff, SampleType::float16, 1, false);
        expect_values(decoded.image, {0.5f, -2.0f, 1024.0f});
    }
}

TEST(DecodeTiff, TilesComeBackInPlaceAndTheirMarginIsDropped) {
    TiffFile file;
    file.width = 40;
    file.height = 20;
    file.bits = 16;
    file.tile = 16;
    for (int tile_y = 0; tile_y < 2; ++tile_y)
        for (int tile_x = 0; tile_x < 3; ++tile_x)
            for (int y = 0; y < 16; ++y)
                for (int x = 0; x < 16; ++x)
                    file.append(std::uint16_t((16 * tile_y + y) * 100 + 16 * tile_x + x));
    const DecodedImage decoded = decode(file.bytes());
    ASSERT_EQ(decoded.image.width, 40);
    ASSERT_EQ(decoded.image.height, 20);
    for (int y = 0; y < 20; ++y)
        for (int x = 0; x < 40; ++x)
            ASSERT_EQ(decoded.image.at(x, y), float(y * 100 + x) / 65535.0f);
}

TEST(DecodeTiff, EveryCompressionGivesTheSameNumbers) {
    std::vector<std::uint16_t> values(50 * 70);
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = std::uint16_t(i * i / 3);
    for (const char* compression : {"none", "lzw", "zip", "packbits"})
        for (const int tile : {0, 16}) {
            SCOPED_TRACE(testing::Message() << compression << ", tile " << tile);
            OIIO::ImageSpec spec(50, 70, 1, OIIO::TypeDesc::UINT16);
            spec.attribute("compression", compression);
            spec.tile_width = spec.tile_height = tile;
            spec.tile_depth = tile ? 1 : 0;
            const std::string bytes =
                write_with_oiio("tiff", spec, OIIO::TypeDesc::UINT16, values.data());
            const DecodedImage decoded = decode(bytes);
            ASSERT_EQ(decoded.image.values.size(), values.size());
            for (std::size_t i = 0; i < values.size(); ++i)
                ASSERT_EQ(decoded.image.values[i], float(values[i]) / 65535.0f) << "texel " << i;
        }
}

TEST(DecodeTiff, ExtraSamplesSayWhichChannelIsAlphaAndWhetherColourHoldsIt) {
    TiffFile file;
    file.samples = 4;
    file.photometric = 2;
    for (const int value : {51, 102, 0, 51}) file.append(std::uint8_t(value));
    const std::uint16_t extra_samples = 338;
    file.more = {{extra_samples, {2}, {}}};
    const DecodedImage unassociated = decode(file.bytes());
    expect_info(unassociated.info, FileFormat::tiff, SampleType::uint8, 4, true);
    expect_values(unassociated.image, {0.2f, 0.4f, 0, 0.2f});

    file.more = {{extra_samples, {1}, {}}};
    const DecodedImage associated = decode(file.bytes());
    expect_info(associated.info, FileFormat::tiff, SampleType::uint8, 4, true);
    expect_values(associated.image, {0.2f, 0.4f, 0, 0.2f});
    EXPECT_TRUE(associated.info.associated);
    EXPECT_FALSE(unassociated.info.associated);

    file.more = {{extra_samples, {0}, {}}};  // of unknown meaning: skipped
    const DecodedImage unknown = decode(file.bytes());
    expect_info(unknown.info, FileFormat::tiff, SampleType::uint8, 3, false);
    expect_values(unknown.image, {0.2f, 0.4f, 0});
}

TEST(DecodeTiff, GreyMayHaveAlphaOrABandThatIsSkipped) {
    TiffFile file;
    file.samples = 2;
    for (const int value : {51, 102}) file.append(std::uint8_t(value));
    file.more = {{338, {2}, {}}};
    const DecodedImage alpha = decode(file.bytes());
    expect_info(alpha.info, FileFormat::tiff, SampleType::uint8, 2, true);
    expect_values(alpha.image, {0.2f, 0.4f});
    file.more = {{338, {0}, {}}};
    const DecodedImage band = decode(file.bytes());
    expect_info(band.info, FileFormat::tiff, SampleType::uint8, 1, false);
    expect_values(band.image, {0.2f});
}

TEST(DecodeTiff, WhiteIsZeroIsTurnedAround) {
    TiffFile file{.photometric = 0};
    file.append(std::uint8_t(51));
    expect_values(decode(file.bytes()).image, {0.8f});
    TiffFile deep{.bits = 16, .photometric = 0};
    deep.append(std::uint16_t(13107));
    expect_values(decode(deep.bytes()).image, {0.8f});
}

TEST(DecodeTiff, WhiteIsZeroIsTurnedAroundInTiles) {
    for (const int bits : {8, 16}) {
        TiffFile file{.bits = bits, .photometric = 0};
        file.width = file.height = file.tile = 16;
        for (int i = 0; i < 256 * bits / 8; ++i) file.append(std::uint8_t(51));
        EXPECT_EQ(decode(file.bytes()).image.at(7, 7), 0.8f) << bits;
    }
}

TEST(DecodeTiff, PlanesAreInterleaved) {
    TiffFile file;
    file.width = 2;
    file.samples = 3;
    file.photometric = 2;
    for (const int value : {0, 51, 102, 153, 204, 255}) file.append(std::uint8_t(value));
    file.more = {{284, {2}, {}}, {273, {8, 10, 12}, {}}, {279, {2, 2, 2}, {}}};
    expect_values(decode(file.bytes()).image, {0, 0.4f, 0.8f, 0.2f, 0.6f, 1});
}

// Deflated, every plane (or the one of interleaved channels) in one strip.
std::string one_strip(int side, bool planes) {
    TiffFile file;
    file.width = file.height = std::uint32_t(side);
    file.samples = 3;
    file.photometric = 2;
    std::string plane(std::size_t(side) * side * (planes ? 1 : 3), '\0');
    for (std::size_t i = 0; i < plane.size(); ++i) plane[i] = char(i * i % 251);
    const std::string strip = zlib_stored(plane);
    const std::uint64_t size = strip.size();
    file.texels = planes ? strip + strip + strip : strip;
    file.more = {{259, {8}}};
    if (planes) {
        file.more.push_back({284, {2}});
        file.more.push_back({273, {8, 8 + size, 8 + 2 * size}});
        file.more.push_back({279, {size, size, size}});
    }
    return file.bytes();
}

TEST(DecodeTiff, OneLargeStripIsReadRowByRow) {
    const Image image = decode(one_strip(1000, false)).image;
    for (std::size_t i = 0; i < image.values.size(); ++i)
        ASSERT_EQ(image.values[i], float(i * i % 251) / 255.0f) << i;
}

TEST(DecodeTiff, CompressedPlanesAreReadStripByStrip) {
    const Image image = decode(one_strip(100, true)).image;
    for (std::size_t i = 0; i < image.values.size(); ++i)
        ASSERT_EQ(image.values[i], float((i / 3) * (i / 3) % 251) / 255.0f) << i;
}

// Row by row, each would be decompressed from its start for every row and plane: time grows with
// the square.
TEST(DecodeTiff, CompressedPlanesInOneLargeStripAreRefused) {
    expect_refused(one_strip(1000, true), error_code::image_not_supported,
                   "separate planes in compressed strips of more than 1 MB");
}

TEST(DecodeTiff, OneBitIsBlackAndWhite) {
    TiffFile file;
    file.width = 8;
    file.bits = 1;
    file.append(std::uint8_t(0b01100001));
    const DecodedImage decoded = decode(file.bytes());
    expect_info(decoded.info, FileFormat::tiff, SampleType::uint8, 1, false);
    expect_values(decoded.image, {0, 1, 1, 0, 0, 0, 0, 1});
}

TEST(DecodeTiff, PalettesAreExpanded) {
    TiffFile file{.photometric = 3};
    file.width = 2;
    for (const int index : {0, 7}) file.append(std::uint8_t(index));
    std::vector<std::uint64_t> map(768, 0);
    map[7] = 51 * 257, map[256 + 7] = 102 * 257, map[512 + 7] = 255 * 257;
    file.more = {{320, map, {}}};
    const DecodedImage decoded = decode(file.bytes());
    expect_info(decoded.info, FileFormat::tiff, SampleType::uint8, 3, false);
    expect_values(decoded.image, {0, 0, 0, 0.2f, 0.4f, 1});
}

TEST(DecodeTiff, KindsThatAreNotReadAreNamed) {
    TiffFile file;
    file.samples = 4;
    file.photometric = 5;
    file.texels = "CMYK";
    expect_refused(file.bytes(), error_code::image_not_supported, "CMYK");
    file.photometric = 8;
    expect_refused(file.bytes(), error_code::image_not_supported, "colours other than");
    TiffFile wide_palette{.bits = 16, .photometric = 3};
    wide_palette.texels = "ab";
    wide_palette.more = {{320, std::vector<std::uint64_t>(3 * 65536, 0), {}}};
    expect_refused(wide_palette.bytes(), error_code::image_not_supported, "palettes");
    TiffFile wide{.bits = 64};
    wide.texels = "12345678";
    expect_refused(wide.bytes(), error_code::image_not_supported, "64-bit floats");
    TiffFile volume;
    volume.texels = "ab";
    volume.more = {{32997, {2}, {}}};
    expect_refused(volume.bytes(), error_code::image_not_supported, "depth");
}

TEST(DecodeTiff, ATagThatIsThereTwiceIsRefused) {
    TiffFile file;
    file.texels = "a";
    std::string bytes = file.bytes();
    const std::size_t height = bytes.find(std::string("\x01\x01\x04\x00", 4));  // tag 257, LONG
    ASSERT_NE(height, std::string::npos);
    bytes[height] = '\0';  // tag 256 again
    expect_refused(bytes, error_code::image_broken, "twice");
}

// --- GDAL_NODATA ---------------------------------------------------------------------------------

constexpr std::uint16_t gdal_nodata = 42113;

template <class T>
void expect_masked(int format, const std::vector<T>& values, const std::string& no_data,
                   const std::vector<bool>& masked) {
    for (const std::endian order : {std::endian::little, std::endian::big})
        for (const bool big_tiff : {false, true}) {
            SCOPED_TRACE(testing::Message()
                         << '"' << no_data << "\" in " << 8 * sizeof(T) << " bits, format "
                         << format << (big_tiff ? ", BigTIFF" : ""));
            TiffFile file{.order = order, .big_tiff = big_tiff};
            file.width = std::uint32_t(values.size());
            file.bits = 8 * int(sizeof(T));
            file.format = format;
            file.more = {{gdal_nodata, {}, no_data}};
            for (const T value : values) file.append(value);
            const DecodedImage decoded = decode(file.bytes());
            for (std::size_t i = 0; i < values.size(); ++i)
                EXPECT_EQ(std::isnan(decoded.image.values[i]), masked[i]) << "value " << i;
        }
}

TEST(NoData, MasksIntegersThatAreExactlyEqual) {
    expect_masked<std::uint8_t>(1, {0, 254, 255}, "255", {false, false, true});
    expect_masked<std::uint16_t>(1, {0, 65535, 1}, "0", {true, false, false});
    expect_masked<std::uint32_t>(1, {4294967295, 4294967294}, "4294967295", {true, false});
    expect_masked<std::int16_t>(2, {-9999, 9999}, "-9999", {true, false});
    expect_masked<std::int16_t>(2, {-9999, 9999}, " -9999.0 ", {true, false});
    expect_masked<std::int32_t>(2, {-2147483647 - 1, 5}, "-2147483648", {true, false});
    expect_masked<std::int8_t>(2, {-128, 5}, "-128", {true, false});
}

TEST(NoData, MasksFloatsThatAreEqualInTheFilesOwnType) {
    expect_masked<float>(3, {0.1f, 0.2f}, "0.1", {true, false});
    expect_masked<float>(3, {-std::numeric_limits<float>::max(), 0}, "-3.40282346638529e+38",
                         {true, false});
    expect_masked<float>(3, {-9999, 9999}, "-9999", {true, false});
    expect_masked<double>(3, {0.1, double(0.1f)}, "0.1", {true, false});
    expect_masked<float>(3, {nan, 1}, "nan", {true, false});
    expect_masked<float>(3, {std::numeric_limits<float>::infinity(), 1}, "inf", {true, false});
}

TEST(NoData, MasksNothingWhenTheTypeCannotHoldIt) {
    expect_masked<std::uint8_t>(1, {0, 255, 1}, "-9999", {false, false, false});
    expect_masked<std::uint8_t>(1, {0, 255, 1}, "256", {false, false, false});
    expect_masked<std::uint8_t>(1, {0, 255, 1}, "0.5", {false, false, false});
    expect_masked<std::int16_t>(2, {-32768, 0, 32767}, "nan", {false, false, false});
    expect_masked<float>(3, {std::numeric_limits<float>::infinity(), 0}, "1e40", {false, false});
    expect_masked<float>(3, {0, 1}, "none", {false, false});
    expect_masked<float>(3, {0, 1}, "", {false, false});
}

TEST(NoData, MasksEveryChannelOfATexelWhoseColoursAllEqualIt) {
    TiffFile file;
    file.width = 2;
    file.samples = 4;
    file.photometric = 2;
    file.more = {{338, {2}, {}}, {gdal_nodata, {}, "0"}};
    for (const int value : {0, 0, 0, 255, 0, 51, 0, 255}) file.append(std::uint8_t(value));
    expect_values(decode(file.bytes()).image, {nan, nan, nan, nan, 0, 0.2f, 0, 1});
}

TEST(NoData, IsComparedBeforeWhiteIsZeroIsTurnedAround) {
    TiffFile file{.bits = 16, .photometric = 0};
    file.width = 2;
    file.more = {{gdal_nodata, {}, "0"}};
    for (const int value : {0, 65535}) file.append(std::uint16_t(value));
    expect_values(decode(file.bytes()).image, {nan, 0});
    TiffFile bytes{.photometric = 0};
    bytes.width = 2;
    bytes.more = {{gdal_nodata, {}, "0"}};
    for (const int value : {0, 255}) bytes.append(std::uint8_t(value));
    expect_values(decode(bytes.bytes()).image, {nan, 0});
}

TEST(NoData, MasksTiles) {
    TiffFile file;
    file.width = file.height = 16;
    file.bits = 16;
    file.format = 2;
    file.tile = 16;
    file.more = {{gdal_nodata, {}, "-32768"}};
    for (int i = 0; i < 256; ++i) file.append(std::int16_t(i == 37 ? -32768 : i));
    const Image image = decode(file.bytes()).image;
    for (int i = 0; i < 256; ++i) EXPECT_EQ(std::isnan(image.values[std::size_t(i)]), i == 37);
}

// --- OpenEXR -------------------------------------------------------------------------------------

std::string make_exr(const std::vector<std::string>& channels, const Floats& texel,
                     OIIO::TypeDesc type = OIIO::TypeDesc::FLOAT, int tile = 0) {
    OIIO::ImageSpec spec(3, 2, int(channels.size()), type);
    spec.channelnames = channels;
    spec.alpha_channel = -1;
    spec.tile_width = spec.tile_height = tile;
    spec.tile_depth = tile ? 1 : 0;
    spec.x = -5;  // the window need not start at 0
    spec.y = 7;
    Floats values;
    for (int i = 0; i < 6; ++i) values.insert(values.end(), texel.begin(), texel.end());
    return write_with_oiio("openexr", spec, OIIO::TypeDesc::FLOAT, values.data());
}

void expect_exr(const std::vector<std::string>& channels, const Floats& stored,
                int expected_channels, bool alpha, const Floats& expected) {
    SCOPED_TRACE(testing::PrintToString(channels));
    const DecodedImage decoded = decode(make_exr(channels, stored));
    expect_info(decoded.info, FileFormat::exr, SampleType::float32, expected_channels, alpha);
    ASSERT_EQ(decoded.image.values.size(), 6 * expected.size());
    for (std::size_t i = 0; i < decoded.image.values.size(); ++i)
        EXPECT_EQ(decoded.image.values[i], expected[i % expected.size()]);
}

TEST(DecodeExr, ChannelsAreTakenByName) {
    expect_exr({"R", "G", "B"}, {1, 2, 3}, 3, false, {1, 2, 3});
    expect_exr({"B", "G", "R"}, {3, 2, 1}, 3, false, {1, 2, 3});
    expect_exr({"A", "B", "G", "R"}, {1, 3, 2, 1}, 4, true, {1, 2, 3, 1});
    expect_exr({"main.R", "main.G", "main.B"}, {1, 2, 3}, 3, false, {1, 2, 3});
    expect_exr({"Y"}, {0.5f}, 1, false, {0.5f});
    expect_exr({"Y", "A"}, {0.5f, 1}, 2, true, {0.5f, 1});
}

TEST(DecodeExr, OtherNamesComeInTheirOrderAndMissingColoursAreZero) {
    expect_exr({"height"}, {0.5f}, 1, false, {0.5f});
    expect_exr({"Z", "A"}, {0.5f, 1}, 2, true, {0.5f, 1});
    expect_exr({"X", "Y", "Z"}, {1, 2, 3}, 3, false, {1, 2, 3});
    expect_exr({"R", "G"}, {1, 2}, 3, false, {1, 2, 0});
    expect_exr({"u", "v"}, {1, 2}, 3, false, {1, 2, 0});
    expect_exr({"A"}, {0.5f}, 1, false, {0.5f});
    expect_refused(make_exr({"a1", "a2", "a3", "a4"}, {1, 2, 3, 4}),
                   error_code::image_not_supported, "none of which is A");
}

TEST(DecodeExr, NumbersAreStoredOnesAlsoWhereColourHoldsItsAlpha) {
    expect_exr({"R", "G", "B", "A"}, {0.5f, 0.25f, 0, 0.5f}, 4, true, {0.5f, 0.25f, 0, 0.5f});
    expect_exr({"R", "G", "B", "A"}, {0.5f, 0.25f, 0, 0}, 4, true,
               {0.5f, 0.25f, 0, 0});  // it emits
}

TEST(DecodeExr, HalfAndIntegerChannelsAreRead) {
    const DecodedImage halves = decode(make_exr({"Y"}, {0.333251953125f}, OIIO::TypeDesc::HALF));
    expect_info(halves.info, FileFormat::exr, SampleType::float16, 1, false);
    EXPECT_EQ(halves.image.at(2, 1), 0.333251953125f);
    const DecodedImage integers = decode(make_exr({"Y"}, {1}, OIIO::TypeDesc::UINT32));
    expect_info(integers.info, FileFormat::exr, SampleType::uint32, 1, false);
    EXPECT_EQ(integers.image.at(2, 1), 1.0f);
}

TEST(DecodeExr, TilesAreRead) {
    const DecodedImage decoded =
        decode(make_exr({"R", "G", "B"}, {1, 2, 3}, OIIO::TypeDesc::FLOAT, 16));
    ASSERT_EQ(decoded.image.width, 3);
    ASSERT_EQ(decoded.image.height, 2);
    EXPECT_EQ(decoded.image.at(2, 1, 2), 3.0f);
}

// --- Radiance HDR, JPEG --------------------------------------------------------------------------

TEST(DecodeHdr, PowersOfTwoAreExactAndRowsComeFromTheTop) {
    const std::string flat =
        "#?RADIANCE\n# by hand\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 1\n"
        "\x80\x40\x20\x81"
        "\x80\x80\x80\x8a";
    const DecodedImage decoded = decode(flat);
    expect_info(decoded.info, FileFormat::hdr, SampleType::float32, 3, false);
    expect_values(decoded.image, {1, 0.5f, 0.25f, 512, 512, 512});
}

TEST(DecodeHdr, OtherOrdersAndEncodingsAreNamed) {
    expect_refused("#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\n\x80\x80\x80\x80",
                   error_code::image_not_supported, "RGBE");
    expect_refused("#?RADIANCE\n\n+X 1 -Y 1\n\x80\x80\x80\x80", error_code::image_not_supported,
                   "-Y +X");
}

std::string make_jpeg(int channels, bool progressive, int side = 32) {
    OIIO::ImageSpec spec(side, side, channels, OIIO::TypeDesc::UINT8);
    spec.attribute("jpeg:progressive", int(progressive));
    spec.attribute("CompressionQuality", 95);
    spec.attribute("ImageDescription", "a comment");
    std::vector<std::uint8_t> values;
    for (int i = 0; i < side * side; ++i)
        for (int c = 0; c < channels; ++c) values.push_back(std::uint8_t(51 * (c + 1)));
    return write_with_oiio("jpeg", spec, OIIO::TypeDesc::UINT8, values.data());
}

TEST(DecodeJpeg, FlatColoursComeBackWithinTwoSteps) {
    for (const int channels : {1, 3})
        for (const bool progressive : {false, true}) {
            SCOPED_TRACE(testing::Message()
                         << channels << " channels, progressive " << progressive);
            const DecodedImage decoded = decode(make_jpeg(channels, progressive));
            expect_info(decoded.info, FileFormat::jpeg, SampleType::uint8, channels, false);
            for (int c = 0; c < channels; ++c)
                EXPECT_NEAR(decoded.image.at(31, 31, c), 0.2f * float(c + 1), 2.0f / 255);
        }
}

TEST(DecodeJpeg, CmykIsRefused) {
    std::string bytes = make_jpeg(3, false);
    const std::size_t frame = bytes.find("\xff\xc0");
    ASSERT_NE(frame, std::string::npos);
    bytes[frame + 9] = 4;
    expect_refused(bytes, error_code::image_not_supported, "CMYK");
}

// A scan of a few bytes makes a decoder walk over the whole picture: a small file can hold
// thousands.
TEST(DecodeJpeg, ThousandsOfScansAreRefused) {
    std::string bytes = make_jpeg(1, true);
    const std::size_t last = bytes.rfind("\xff\xda"), end = bytes.rfind("\xff\xd9");
    const std::string scan = bytes.substr(last, end - last);
    std::string more;
    for (int i = 0; i < 2000; ++i) more += scan;
    bytes.insert(end, more);
    expect_refused(bytes, error_code::image_not_supported, "scans");
}

// --- Limits --------------------------------------------------------------------------------------

TEST(DecodeLimits, AreNamedWithTheirValue) {
    const std::string png = make_png({.width = 4, .height = 2, .colour_type = 2},
                                     {std::string(12, 'a'), std::string(12, 'b')});
    expect_refused(png, error_code::image_too_large,
                   "the image is 4 x 2 pixels; the limit is 7 pixels (max-image-pixels)",
                   {.max_pixels = 7});
    expect_refused(png, error_code::image_too_large, "3 pixels a side (max-image-side)",
                   {.max_side = 3});
    expect_refused(png, error_code::image_too_large,
                   "3 channels; the limit is 2 (max-image-channels)", {.max_channels = 2});
    expect_refused(png, error_code::image_too_large, "23 pixels times channels (max-image-values)",
                   {.max_values = 23});
    EXPECT_NO_THROW(
        (void)decode(png, {.max_pixels = 8, .max_values = 24, .max_side = 4, .max_channels = 3}));
}

TEST(DecodeLimits, FilesThatAreHeldWholeHaveTheirOwn) {
    const DecodeLimits limits{.max_interlaced_pixels = 1023};
    expect_refused(make_jpeg(1, true), error_code::image_too_large, "interlaced", limits);
    EXPECT_NO_THROW((void)decode(make_jpeg(1, false), limits));
}

TEST(DecodeLimits, ApplyToEveryFormat) {
    const DecodeLimits limits{.max_pixels = 5};
    TiffFile tiff;
    tiff.width = 6;
    tiff.texels = "123456";
    expect_refused(tiff.bytes(), error_code::image_too_large, "6 x 1", limits);
    expect_refused(make_exr({"Y"}, {1}), error_code::image_too_large, "3 x 2", limits);
    expect_refused(make_jpeg(1, false), error_code::image_too_large, "32 x 32", limits);
    expect_refused("#?RGBE\n\n-Y 2 +X 3\n", error_code::image_too_large, "3 x 2", limits);
}

}  // namespace
}  // namespace relit
