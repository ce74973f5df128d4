// PNG chunks (W3C PNG, 5 and 11): the size from IHDR, and the file without its ancillary chunks.
#include <array>

#include <libdeflate.h>

#include "core/io/byte_reader.h"
#include "core/io/header.h"

namespace relit {
namespace {

constexpr std::size_t signature_size = 8;

struct Ihdr {
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    int bit_depth = 0;
    int colour_type = 0;
    bool interlaced = false;
};

int samples_of(int colour_type) {
    switch (colour_type) {
        case 0:
        case 3:
            return 1;
        case 2:
            return 3;
        case 4:
            return 2;
        case 6:
            return 4;
        default:
            return 0;
    }
}

bool is_legal_depth(int colour_type, int depth) {
    switch (colour_type) {
        case 0:
            return depth == 1 || depth == 2 || depth == 4 || depth == 8 || depth == 16;
        case 3:
            return depth == 1 || depth == 2 || depth == 4 || depth == 8;
        case 2:
        case 4:
        case 6:
            return depth == 8 || depth == 16;
        default:
            return false;
    }
}

Ihdr parse_ihdr(std::string_view data) {
    if (data.size() != 13) throw_broken(FileFormat::png, "its header has the wrong length");
    ByteReader reader(data, FileFormat::png, std::endian::big);
    Ihdr ihdr;
    ihdr.width = reader.u32();
    ihdr.height = reader.u32();
    ihdr.bit_depth = reader.u8();
    ihdr.colour_type = reader.u8();
    const int compression = reader.u8(), filter = reader.u8(), interlace = reader.u8();
    ihdr.interlaced = interlace == 1;
    if (!is_legal_depth(ihdr.colour_type, ihdr.bit_depth) || compression != 0 || filter != 0 ||
        interlace > 1)
        throw_broken(FileFormat::png, "its header says nothing that PNG knows");
    return ihdr;
}

bool is_critical(std::string_view type) { return (type[0] & 0x20) == 0; }

void check_crc(std::string_view type_and_data, std::uint32_t stored) {
    if (libdeflate_crc32(0, type_and_data.data(), type_and_data.size()) != stored)
        throw_broken(FileFormat::png, "a checksum in it is wrong");
}

}  // namespace

FileHeader read_png_header(std::string_view bytes) {
    ByteReader reader(bytes, FileFormat::png, std::endian::big);
    Ihdr ihdr;
    bool first = true, palette = false, transparency = false, ended = false;
    std::int64_t compressed_bytes = 0;
    FileHeader header;
    header.stripped = reader.take(signature_size);
    while (!ended) {
        const std::size_t start = reader.position();
        const std::uint32_t length = reader.u32();
        const std::string_view type = reader.take(4);
        const std::string_view data = reader.take(length);
        const std::uint32_t crc = reader.u32();
        if (first != (type == "IHDR"))
            throw_broken(FileFormat::png, "its header is not where it belongs");
        if (first) ihdr = parse_ihdr(data);
        first = false;
        ended = type == "IEND";
        palette |= type == "PLTE";
        transparency |= type == "tRNS";
        if (type == "IDAT") compressed_bytes += length;
        if (ended && compressed_bytes == 0) throw_broken(FileFormat::png, "it has no texels");
        if (type == "IDAT" && ihdr.colour_type == 3 && !palette)
            throw_broken(FileFormat::png, "its palette is missing");
        // Also of what is skipped below: one wrong bit makes an IDAT a chunk that may be.
        check_crc(bytes.substr(start + 4, 4 + std::size_t(length)), crc);
        // Unknown ancillary chunks may be skipped by anybody (PNG 5.4), unknown critical ones by
        // nobody.
        if (!is_critical(type) && type != "tRNS") continue;
        if (type != "IHDR" && type != "PLTE" && type != "IDAT" && type != "IEND" && type != "tRNS")
            throw_broken(FileFormat::png, "it has a critical chunk of an unknown kind");
        header.stripped += bytes.substr(start, 12 + std::size_t(length));
    }
    header.width = ihdr.width;
    header.height = ihdr.height;
    header.channels = ihdr.colour_type == 3 ? 3 : samples_of(ihdr.colour_type);
    if (transparency && header.channels % 2 == 1) ++header.channels;
    header.held_whole = ihdr.interlaced;
    const std::int64_t raw_bits =
        capped_product({ihdr.width, ihdr.height, ihdr.bit_depth, samples_of(ihdr.colour_type)});
    const std::int64_t other_bytes = std::int64_t(bytes.size()) - compressed_bytes;
    header.least_bytes = other_bytes + raw_bits / 8 / deflate_expansion;
    return header;
}

}  // namespace relit
