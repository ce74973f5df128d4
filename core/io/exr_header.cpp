// OpenEXR headers ("OpenEXR File Layout"): the data window of every part, because the decoder
// allocates for all of them.
#include <algorithm>

#include "core/io/byte_reader.h"
#include "core/io/header.h"

namespace relit {
namespace {

constexpr std::size_t max_name = 255;
constexpr std::uint32_t deep_flag = 0x800;
constexpr std::uint32_t multipart_flag = 0x1000;

struct Part {
    std::int64_t width = 0;
    std::int64_t height = 0;
    std::int64_t channels = 0;
    std::int64_t texel_bytes = 0;
    std::int64_t tile_width = 0;
    std::int64_t tile_height = 0;
    int compression = 0;
};

void read_channels(std::string_view data, Part& part) {
    ByteReader reader(data, FileFormat::exr, std::endian::little);
    while (!reader.c_string(max_name).empty()) {
        const std::int32_t type = reader.i32();
        (void)reader.take(4);
        const std::int32_t x_sampling = reader.i32(), y_sampling = reader.i32();
        if (type < 0 || type > 2)
            throw_broken(FileFormat::exr, "a channel of it has an unknown type");
        if (x_sampling != 1 || y_sampling != 1)
            throw_unsupported(FileFormat::exr, "channels of different resolution");
        part.texel_bytes += type == 1 ? 2 : 4;
        ++part.channels;
    }
}

void read_window(std::string_view data, Part& part) {
    ByteReader reader(data, FileFormat::exr, std::endian::little);
    const std::int64_t left = reader.i32(), top = reader.i32();
    part.width = reader.i32() - left + 1;
    part.height = reader.i32() - top + 1;
    if (part.width < 1 || part.height < 1) throw_broken(FileFormat::exr, "its window is empty");
}

void read_tiles(std::string_view data, Part& part) {
    ByteReader reader(data, FileFormat::exr, std::endian::little);
    part.tile_width = reader.u32();
    part.tile_height = reader.u32();
    if (part.tile_width < 1 || part.tile_height < 1)
        throw_broken(FileFormat::exr, "its tiles are empty");
}

Part read_part(ByteReader& reader, std::string_view first_name) {
    Part part;
    for (std::string_view name = first_name; !name.empty(); name = reader.c_string(max_name)) {
        const std::string_view type = reader.c_string(max_name);
        const std::string_view data = reader.take(reader.u32());
        if (name == "channels" && type == "chlist") read_channels(data, part);
        if (name == "dataWindow" && type == "box2i") read_window(data, part);
        if (name == "tiles" && type == "tiledesc") read_tiles(data, part);
        if (name == "compression" && !data.empty()) part.compression = data[0];
        if (name == "type" && data.starts_with("deep"))
            throw_unsupported(FileFormat::exr, "deep texels");
    }
    if (part.width == 0 || part.channels == 0)
        throw_broken(FileFormat::exr, "its header lacks a size");
    return part;
}

std::int64_t rows_per_chunk(int compression) {
    switch (compression) {
        case 3:
        case 5:
            return 16;  // zip, pxr24
        case 4:
        case 6:
        case 7:
        case 8:
            return 32;  // piz, b44, b44a, dwaa
        case 9:
            return 256;  // dwab
        default:
            return 1;
    }
}

std::int64_t divided_up(std::int64_t a, std::int64_t b) { return (a + b - 1) / b; }

std::int64_t least_bytes(const Part& part) {
    if (part.compression == 0) return capped_product({part.width, part.height, part.texel_bytes});
    const std::int64_t chunks = part.tile_width
                                    ? capped_product({divided_up(part.width, part.tile_width),
                                                      divided_up(part.height, part.tile_height)})
                                    : divided_up(part.height, rows_per_chunk(part.compression));
    return capped_product({chunks, 16});  // an offset, a position and a length
}

}  // namespace

FileHeader read_exr_header(std::string_view bytes) {
    ByteReader reader(bytes, FileFormat::exr, std::endian::little);
    (void)reader.take(4);
    const std::uint32_t version = reader.u32();
    if ((version & 0xff) != 2) throw_unsupported(FileFormat::exr, "a version other than 2");
    if (version & deep_flag) throw_unsupported(FileFormat::exr, "deep texels");

    const Part first = read_part(reader, reader.c_string(max_name));
    FileHeader header;
    header.width = first.width;
    header.height = first.height;
    header.channels = first.channels;
    header.tile_bytes = capped_product({first.tile_width, first.tile_height, first.texel_bytes});
    header.least_bytes = least_bytes(first);
    // Further parts are not read, but the decoder opens them. An empty name ends the list.
    while (version & multipart_flag) {
        const std::string_view name = reader.c_string(max_name);
        if (name.empty()) break;
        const Part part = read_part(reader, name);
        if (part.width > first.width || part.height > first.height ||
            part.channels > first.channels)
            throw_unsupported(FileFormat::exr, "parts larger than the first");
    }
    return header;
}

}  // namespace relit
