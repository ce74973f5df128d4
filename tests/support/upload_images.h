// Images as clients upload them: real ones made by our encoder, and hostile ones made by hand.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "core/image/image.h"
#include "tests/support/encoded.h"

namespace relit::test {

/// A grey 16-bit PNG; another one for each `seed` from 0 to 65535.
inline std::string small_png(int seed = 0, int width = 16, int height = 12) {
    Image image(width, height, 1);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            image.at(x, y) = float((x * 7 + y * 13 + seed * 31) % 251) / 251.0f;
    image.at(0, 0) = float(seed) / 65535.0f;  // no two seeds have the same bytes
    return encoded(image, {.format = PictureFormat::png, .bit_depth = 16, .srgb = false});
}

inline std::string big_endian(std::uint32_t number) {
    return {char(number >> 24), char(number >> 16), char(number >> 8), char(number)};
}

inline std::string png_chunk(const std::string& type, const std::string& data) {
    std::uint32_t crc = 0xffffffff;
    for (const char c : type + data) {
        crc ^= static_cast<unsigned char>(c);
        for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ (crc & 1 ? 0xedb88320u : 0);
    }
    return big_endian(std::uint32_t(data.size())) + type + data + big_endian(~crc);
}

/// A PNG of a few bytes that claims to be so large.
inline std::string lying_png(std::uint32_t width, std::uint32_t height, bool interlaced) {
    const std::string header = big_endian(width) + big_endian(height) +
                               std::string("\x08\x00\x00\x00", 4) + (interlaced ? '\1' : '\0');
    const std::string nothing("\x78\x9c\x03\x00\x00\x00\x00\x01", 8);  // zlib: no bytes at all
    return "\x89PNG\r\n\x1a\n" + png_chunk("IHDR", header) + png_chunk("IDAT", nothing) +
           png_chunk("IEND", "");
}

}  // namespace relit::test
