// Small image files made byte by byte, so that what a test expects does not come from the library
// that it tests.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

namespace relit::test {

/// `size` bytes of `value`.
inline std::string number(std::uint64_t value, int size, std::endian order) {
    std::string bytes;
    for (int i = 0; i < size; ++i)
        bytes += char(value >> 8 * (order == std::endian::big ? size - 1 - i : i) & 0xff);
    return bytes;
}

inline std::string big(std::uint64_t value, int size) {
    return number(value, size, std::endian::big);
}

// --- PNG -----------------------------------------------------------------------------------------

inline std::uint32_t crc32(std::string_view bytes) {
    std::uint32_t crc = ~0u;
    for (const char c : bytes) {
        crc ^= static_cast<unsigned char>(c);
        for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ (crc & 1 ? 0xedb88320u : 0u);
    }
    return ~crc;
}

inline std::string png_chunk(const std::string& type, const std::string& data) {
    return big(data.size(), 4) + type + data + big(crc32(type + data), 4);
}

/// A zlib stream of stored blocks.
inline std::string zlib_stored(const std::string& data) {
    std::string out = "\x78\x01";
    std::uint32_t a = 1, b = 0;
    for (const char c : data) {
        a = (a + static_cast<unsigned char>(c)) % 65521;
        b = (b + a) % 65521;
    }
    for (std::size_t at = 0; at == 0 || at < data.size(); at += 65535) {
        const std::string block = data.substr(at, 65535);
        out += char(at + 65535 >= data.size());
        out += number(block.size(), 2, std::endian::little) +
               number(block.size() ^ 0xffff, 2, std::endian::little) + block;
    }
    return out + big(b << 16 | a, 4);
}

struct PngHeader {
    std::uint32_t width = 1, height = 1;
    int depth = 8;
    int colour_type = 0;  // 0 grey, 2 RGB, 3 palette, 4 grey + alpha, 6 RGBA
    int interlace = 0;
};

inline const std::string png_signature = "\x89PNG\r\n\x1a\n";

/// @param packed  rows of packed samples, without filter bytes
/// @param before  chunks between header and texels
inline std::string make_png(const PngHeader& header, const std::vector<std::string>& packed,
                            const std::string& before = {}) {
    std::string rows;
    for (const std::string& row : packed) rows += '\0' + row;
    const std::string ihdr = big(header.width, 4) + big(header.height, 4) + char(header.depth) +
                             char(header.colour_type) + std::string(2, '\0') +
                             char(header.interlace);
    return png_signature + png_chunk("IHDR", ihdr) + before + png_chunk("IDAT", zlib_stored(rows)) +
           png_chunk("IEND", "");
}

struct Chunk {
    std::string type, data;
};

inline std::vector<Chunk> chunks_of(const std::string& png) {
    std::vector<Chunk> chunks;
    for (std::size_t at = 8; at + 12 <= png.size();) {
        std::uint32_t length = 0;
        for (int i = 0; i < 4; ++i) length = length << 8 | static_cast<unsigned char>(png[at + i]);
        if (length > png.size() - at - 12)
            throw std::runtime_error("a chunk is longer than the file");
        chunks.push_back({png.substr(at + 4, 4), png.substr(at + 8, length)});
        const std::string crc = big(crc32(png.substr(at + 4, 4 + length)), 4);
        if (png.substr(at + 8 + length, 4) != crc)
            throw std::runtime_error("a chunk's CRC is wrong");
        at += 12 + length;
    }
    return chunks;
}

// --- TIFF ----------------------------------------------------------------------------------------

struct TiffField {
    std::uint16_t tag = 0;
    std::vector<std::uint64_t> values = {};
    std::string text = {};  // instead of values: an ASCII field
};

/// Uncompressed, one strip or one row of equal tiles after the other.
struct TiffFile {
    std::endian order = std::endian::little;
    bool big_tiff = false;
    std::uint32_t width = 1, height = 1;
    int samples = 1;
    int bits = 8;
    int format = 1;          // 1 unsigned, 2 signed, 3 float
    int photometric = 1;     // 0 white is 0, 1 black is 0, 2 RGB, 3 palette
    std::uint32_t tile = 0;  // side; 0: one strip
    std::vector<TiffField> more = {};
    std::string texels = {};  // in the file's order

    void append(auto value) {
        using T = decltype(value);
        std::uint64_t raw = 0;
        if constexpr (std::is_same_v<T, float>) raw = std::bit_cast<std::uint32_t>(value);
        else if constexpr (std::is_same_v<T, double>) raw = std::bit_cast<std::uint64_t>(value);
        else raw = std::uint64_t(value);
        texels += number(raw, sizeof(T), order);
    }

    [[nodiscard]] std::string bytes() const {
        const int word = big_tiff ? 8 : 4;
        const auto put = [&](std::uint64_t value, int size) { return number(value, size, order); };
        std::string file = order == std::endian::big ? "MM" : "II";
        file += put(big_tiff ? 43 : 42, 2);
        if (big_tiff) file += put(8, 2) + put(0, 2);
        const std::uint64_t texels_at = file.size() + std::size_t(word);
        file += put(texels_at + texels.size(), word) + texels;

        std::vector<TiffField> fields{{256, {width}, {}},
                                      {257, {height}, {}},
                                      {258, std::vector<std::uint64_t>(samples, bits), {}},
                                      {259, {1}, {}},
                                      {262, {std::uint64_t(photometric)}, {}}};
        const std::uint64_t across = tile ? (width + tile - 1) / tile : 1;
        const std::uint64_t pieces = tile ? across * ((height + tile - 1) / tile) : 1;
        std::vector<std::uint64_t> offsets, sizes(pieces, texels.size() / pieces);
        for (std::uint64_t i = 0; i < pieces; ++i) offsets.push_back(texels_at + i * sizes[0]);
        if (!tile) fields.push_back({273, offsets, {}});
        fields.push_back({277, {std::uint64_t(samples)}, {}});
        if (!tile) fields.push_back({278, {height}, {}});
        if (!tile) fields.push_back({279, sizes, {}});
        if (tile) {
            fields.push_back({322, {tile}, {}});
            fields.push_back({323, {tile}, {}});
            fields.push_back({324, offsets, {}});
            fields.push_back({325, sizes, {}});
        }
        fields.push_back({339, std::vector<std::uint64_t>(samples, format), {}});
        for (const TiffField& field : more) {
            std::erase_if(fields, [&](const TiffField& f) { return f.tag == field.tag; });
            fields.push_back(field);
        }
        std::sort(fields.begin(), fields.end(), [](auto& a, auto& b) { return a.tag < b.tag; });

        const std::size_t entry_size = big_tiff ? 20 : 12;
        std::uint64_t after = file.size() + (big_tiff ? 8 : 2) + fields.size() * entry_size + word;
        file += put(fields.size(), big_tiff ? 8 : 2);
        std::string values;
        for (const TiffField& field : fields) {
            const bool text = field.values.empty();
            const bool wide =
                field.tag != 258 && field.tag != 320 && field.tag != 338 && field.tag != 339;
            std::string data = text ? field.text + '\0' : "";
            for (const std::uint64_t value : field.values) data += put(value, wide ? 4 : 2);
            file += put(field.tag, 2) + put(text ? 2 : (wide ? 4 : 3), 2) +
                    put(text ? data.size() : field.values.size(), word);
            if (data.size() <= std::size_t(word)) {
                file += data + std::string(word - data.size(), '\0');
            } else {
                file += put(after + values.size(), word);
                values += data;
            }
        }
        return file + put(0, word) + values;
    }
};

// --- Formats that take a library to write --------------------------------------------------------

/// What OpenImageIO writes for `spec` and `values`, which are of `type`.
inline std::string write_with_oiio(const char* plugin, OIIO::ImageSpec spec, OIIO::TypeDesc type,
                                   const void* values) {
    OIIO::attribute("threads", 1);
    const auto output = OIIO::ImageOutput::create(plugin);
    std::vector<unsigned char> bytes;
    OIIO::Filesystem::IOVecOutput memory(bytes);
    OIIO::Filesystem::IOProxy* proxy = &memory;
    spec.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &proxy);
    if (!output->open("fixture", spec) || !output->write_image(type, values) || !output->close())
        throw std::runtime_error(output->geterror());
    return {bytes.begin(), bytes.end()};
}

}  // namespace relit::test
