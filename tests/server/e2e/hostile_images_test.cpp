// Images made to hurt, sent to the real program: bombs of every format, files cut off and changed,
// texels that are no numbers.
#include <zlib.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <limits>
#include <random>
#include <vector>

#include "core/io/decode.h"
#include "tests/core/io/fixtures.h"
#include "tests/server/e2e/hostile_client.h"
#include "tests/support/encoded.h"

namespace relit::test {
namespace {

using namespace std::chrono_literals;

class HostileImage : public HostileClient {
protected:
    static HttpReply upload(const std::string& bytes) { return send("POST", "/v1/images", bytes); }

    // The most that a process which decodes has ever had; 0 of one that has just ended.
    static long decoders_peak_mib() {
        long peak = 0;
        for (const ProcessFacts& worker : decoding_processes_of(relitd->pid()).workers)
            peak = std::max(peak, std::atol(status_of(worker.pid, "VmHWM").c_str()) / 1024);
        return peak;
    }
};

// 20,000 x 20,000 grey texels, all there: 400 MB in 389 kB.
std::string twenty_thousand_squared_png() {
    const std::string strip(20'001 * 50, '\0');
    std::string packed(compressBound(strip.size()), '\0');
    z_stream stream{};
    deflateInit(&stream, 6);
    std::string data;
    for (int i = 0; i < 400; ++i) {  // every strip is packed to the same bytes, for it begins anew
        if (i < 2) {
            stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(strip.data()));
            stream.avail_in = uInt(strip.size());
            stream.next_out = reinterpret_cast<Bytef*>(packed.data());
            stream.avail_out = uInt(packed.size());
            deflate(&stream, Z_FULL_FLUSH);
        }
        data.append(packed.data(), packed.size() - stream.avail_out);
    }
    deflateEnd(&stream);
    const std::string last("\x03\x00", 2);  // an empty block; then the sum, which is that of zeros
    const auto zeros = std::uint64_t(20'001) * 20'000;
    data += last + big((zeros % 65521) << 16 | 1, 4);
    return png_signature +
           png_chunk("IHDR", big(20'000, 4) + big(20'000, 4) + "\x08" + std::string(4, '\0')) +
           png_chunk("IDAT", data) + png_chunk("IEND", "");
}

std::string tiff_with_tiles_of(std::uint64_t side) {
    TiffFile tiff;
    tiff.width = tiff.height = 64;
    tiff.tile = 64;
    tiff.texels = std::string(64 * 64, 'x');
    tiff.more = {{322, {side}, {}}, {323, {side}, {}}};
    return tiff.bytes();
}

std::string tiff_of_size(std::uint32_t side, bool big_tiff) {
    TiffFile tiff{.big_tiff = big_tiff};
    tiff.width = tiff.height = side;
    tiff.texels = "abc";
    return tiff.bytes();
}

std::string exr_with_window(std::int32_t low, std::int32_t high) {
    std::string bytes =
        encoded(Image(8, 8, 1, 0.5f), {.format = PictureFormat::exr, .bit_depth = 32});
    const auto corner = [](std::int32_t value) {
        const std::string axis = number(std::uint32_t(value), 4, std::endian::little);
        return axis + axis;
    };
    const std::string name("dataWindow\0box2i\0", 17);
    bytes.replace(bytes.find(name) + name.size() + 4, 16, corner(low) + corner(high));
    return bytes;
}

std::string jpeg_of_size(std::uint32_t side, bool progressive) {
    std::string bytes = encoded(Image(16, 16, 3, 0.5f), {.format = PictureFormat::jpeg});
    const std::size_t frame = bytes.find("\xff\xc0");
    if (progressive) bytes[frame + 1] = '\xc2';
    return bytes.replace(frame + 5, 4, big(side, 2) + big(side, 2));
}

std::string webp_of_size(std::uint32_t side) {  // VP8L: 14 bits each
    const std::uint32_t bits = (side - 1) | (side - 1) << 14;
    const std::string data = "\x2f" + number(bits, 4, std::endian::little) + std::string(11, '\0');
    const auto size = [](std::size_t value) { return number(value, 4, std::endian::little); };
    return "RIFF" + size(data.size() + 12) + "WEBPVP8L" + size(data.size()) + data;
}

std::string hdr_of_size(const std::string& side) {
    return "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y " + side + " +X " + side + "\n\2\2\xff\xff";
}

TEST_F(HostileImage, BombsOfEveryFormatAreRefusedByWhatTheyClaim) {
    EXPECT_EQ(upload(encoded(Image(8, 8, 1, 0.5f))).status / 100, 2)
        << "so that a decoder is awake";
    const long decoders_before = decoders_peak_mib();
    EXPECT_LT(twenty_thousand_squared_png().size(), 400'000u);
    const struct {
        const char* what;
        int status;
        std::string bytes;
    } bombs[] = {
        {"interlaced PNG", 413, make_png({.width = 60'000, .height = 60'000, .interlace = 1}, {})},
        {"interlaced PNG within max-image-pixels", 413,
         make_png({.width = 7000, .height = 7000, .interlace = 1}, {})},
        {"PNG that is all there", 413, twenty_thousand_squared_png()},
        {"PNG of 2^31", 413, make_png({.width = 0x7fffffff, .height = 0x7fffffff}, {})},
        {"TIFF tile", 413, tiff_with_tiles_of(30'000)},
        {"TIFF tile of 2^31", 413, tiff_with_tiles_of(0x7ffffff0)},
        {"TIFF", 413, tiff_of_size(0xffffffff, false)},
        {"BigTIFF", 413, tiff_of_size(0xffffffff, true)},
        {"TIFF too short for its claim", 422, tiff_of_size(8000, false)},
        {"OpenEXR window of 2^31", 413,
         exr_with_window(std::numeric_limits<std::int32_t>::min(),
                         std::numeric_limits<std::int32_t>::max())},
        {"OpenEXR window from 0", 413, exr_with_window(0, std::numeric_limits<std::int32_t>::max())},
        {"OpenEXR window inside out", 422, exr_with_window(5, -5)},
        {"JPEG", 413, jpeg_of_size(65'500, false)},
        {"progressive JPEG", 413, jpeg_of_size(65'500, true)},
        {"progressive JPEG within max-image-pixels", 413, jpeg_of_size(7000, true)},
        {"WebP", 413, webp_of_size(16'383)},
        {"HDR", 413, hdr_of_size("100000")},
        {"HDR of 2^31", 413, hdr_of_size("2147483647")},
        {"HDR of more than a number holds", 422, hdr_of_size(std::string(100, '9'))},
        {"HDR too short for its claim", 422, hdr_of_size("8000")},
        {"GIF", 415, "GIF89a\xff\xff\xff\xff"},
        {"BMP", 415, "BM" + std::string(100, '\xff')},
        {"SVG", 415, "<svg xmlns='http://www.w3.org/2000/svg' width='1e9' height='1e9'/>"},
        {"gzip", 415, "\x1f\x8b\x08" + std::string(100, '\0')},
        {"script", 415, "%!PS-Adobe-3.0\n(/etc/passwd) (r) file"},
    };
    for (const auto& bomb : bombs) {
        SCOPED_TRACE(bomb.what);
        const auto start = std::chrono::steady_clock::now();
        expect_refused(upload(bomb.bytes), bomb.status, "/problems/image-");
        EXPECT_LT(std::chrono::steady_clock::now() - start, 2s);
    }
    if (!sanitized) {
        EXPECT_LT(decoders_peak_mib(), decoders_before + 30);
    }
}

std::vector<std::pair<std::string, std::string>> one_of_every_format() {
    const Image picture(12, 9, 3, 0.4f);
    const auto made = [&](PictureFormat format, int bit_depth) {
        return encoded(picture, {.format = format, .bit_depth = bit_depth});
    };
    const auto by_oiio = [&](const char* plugin, OIIO::TypeDesc type) {
        return write_with_oiio(plugin, OIIO::ImageSpec(12, 9, 3, type), OIIO::TypeDesc::FLOAT,
                               picture.values.data());
    };
    return {{"png", made(PictureFormat::png, 16)},
            {"jpeg", made(PictureFormat::jpeg, 8)},
            {"webp", made(PictureFormat::webp, 8)},
            {"exr", made(PictureFormat::exr, 16)},
            {"tiff", by_oiio("tiff", OIIO::TypeDesc::FLOAT)},
            {"hdr", by_oiio("hdr", OIIO::TypeDesc::FLOAT)}};
}

// At every length and with many more changes: Hostile.* of core/io. Here: through the server, and what
// is left behind.
TEST_F(HostileImage, FilesCutOffOrChangedAreStoredWholeOrNotAtAll) {
    std::mt19937 random(1);
    for (const auto& [name, bytes] : one_of_every_format()) {
        SCOPED_TRACE(name);
        EXPECT_EQ(upload(bytes).status, 201);
        for (int i = 0; i < 24; ++i) {
            std::string broken = bytes;
            if (i % 2) broken.resize(random() % bytes.size());
            else
                broken[random() % std::min<std::size_t>(bytes.size(), 200)] ^=
                    char(1 + random() % 255);
            const HttpReply reply = upload(broken);
            if (reply.status / 100 == 2) {
                EXPECT_EQ(send("GET", reply.header("location") + "/content").body, broken);
            } else if (broken.empty()) {
                EXPECT_EQ(reply.status / 100, 4) << reply.body;
            } else {
                expect_refused(reply, reply.status, "/problems/image-");
                EXPECT_TRUE(reply.status == 413 || reply.status == 415 || reply.status == 422);
            }
        }
    }
    EXPECT_TRUE(std::filesystem::is_empty(relitd->data_dir() / "incoming"));
}

constexpr float inf = std::numeric_limits<float>::infinity();
constexpr float nan = std::numeric_limits<float>::quiet_NaN();

// Half of it ordinary texels, half of it `value`.
std::string map_with(float value, int channels) {
    Image image(16, 8, channels, 0.4f);
    for (std::size_t i = 0; i < image.values.size(); i += 2) image.values[i] = value;
    image.at(3, 3) = 0.6f;
    return encoded(image, {.format = PictureFormat::exr, .bit_depth = 32});
}

TEST_F(HostileImage, TexelsThatAreNoNumbersGiveAPictureOfNumbersOrARefusalThatNamesTheImage) {
    const std::string sound = map_with(0.3f, 1);
    const std::string output = R"("output": {"format": "exr"})";
    const std::pair<const char*, std::string> roles[] = {
        {"height", R"({"height": {"part": "x"}, )"},
        {"alpha", R"({"height": {"part": "sound"}, "alpha": {"part": "x"}, )"},
        {"albedo", R"({"height": {"part": "sound"}, "albedo": {"part": "x"}, )"},
        {"light",
         R"({"height": {"part": "sound"}, "light": {"type": "environment", "image": {"part": "x"}}, )"},
    };
    for (const auto& [role, scene] : roles)
        for (const float value : {nan, inf, -inf, 1e38f, -1e38f, 3.4e38f, 1e-45f, -0.f})
            for (const int channels : {1, 3}) {
                SCOPED_TRACE(testing::Message() << role << " " << value << " x " << channels);
                std::vector<FormFile> files{{"scene", "", scene + output + "}"},
                                            {"x", "x.exr", map_with(value, channels)}};
                if (std::string_view(role) != "height") files.push_back({"sound", "s", sound});
                const auto [form, type] = form_of(files);
                const HttpReply reply = send("POST", "/v1/render", form, {{"Content-Type", type}});
                if (reply.status == 200) {
                    for (const float number : decode(reply.body).image.values)
                        ASSERT_TRUE(std::isfinite(number)) << number;
                } else {
                    expect_refused(reply, 422, std::string(R"("pointer":"/)") + role);
                }
            }
}

}  // namespace
}  // namespace relit::test
