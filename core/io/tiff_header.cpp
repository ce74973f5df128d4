// The first directory of a TIFF file (TIFF 6.0; BigTIFF; GDAL's tag 42113), classic and Big, in
// both byte orders. Kinds that OpenImageIO 2.4 or libtiff treat badly (16-bit palettes divide by
// zero, CMYK below 8 bits reads past its buffer) are refused here by an allow-list; OpenImageIO
// does not know the no-data tag at all.
#include <algorithm>
#include <charconv>
#include <set>
#include <vector>

#include "core/io/byte_reader.h"
#include "core/io/header.h"

namespace relit {
namespace {

constexpr std::uint64_t max_entries = 4096;
constexpr std::uint64_t max_no_data_text = 128;

enum Tag : std::uint16_t {
    image_width = 256,
    image_length = 257,
    bits_per_sample = 258,
    compression = 259,
    photometric = 262,
    samples_per_pixel = 277,
    planar_configuration = 284,
    tile_width = 322,
    tile_length = 323,
    sample_format = 339,
    image_depth = 32997,
    gdal_nodata = 42113
};

struct Directory {
    std::uint64_t width = 0, height = 0, depth = 1;
    std::uint64_t tile_width = 0, tile_height = 0;
    std::uint64_t samples = 1, planar = 1;
    std::uint64_t compression = 1;
    std::uint64_t photometric = 1;
    std::vector<std::uint64_t> bits{1};
    std::vector<std::uint64_t> formats{1};
    std::optional<double> no_data;
};

struct Entry {
    std::uint16_t tag = 0;
    std::uint16_t type = 0;
    std::uint64_t count = 0;
    std::uint64_t position = 0;  // of the values
};

std::uint64_t size_of(std::uint16_t type) {
    switch (type) {
        case 1:
        case 2:
        case 6:
        case 7:
            return 1;
        case 3:
        case 8:
            return 2;
        case 4:
        case 9:
        case 11:
        case 13:
            return 4;
        case 5:
        case 10:
        case 12:
        case 16:
        case 17:
        case 18:
            return 8;
        default:
            return 0;
    }
}

bool is_unsigned(std::uint16_t type) { return type == 1 || type == 3 || type == 4 || type == 16; }

class TiffReader {
public:
    explicit TiffReader(std::string_view bytes)
        : reader_(bytes, FileFormat::tiff,
                  bytes.starts_with("MM") ? std::endian::big : std::endian::little) {
        (void)reader_.take(2);
        big_ = reader_.u16() == 43;
        if (big_ && (reader_.u16() != 8 || reader_.u16() != 0))
            throw_broken(FileFormat::tiff, "its header makes no sense");
        reader_.seek(offset());
    }

    std::vector<Entry> entries() {
        const std::uint64_t count = big_ ? reader_.u64() : reader_.u16();
        if (count > max_entries) throw_broken(FileFormat::tiff, "its directory is too long");
        std::vector<Entry> all(count);
        for (Entry& entry : all) entry = next_entry();
        return all;
    }

    std::vector<std::uint64_t> numbers(const Entry& entry, std::uint64_t at_most) {
        if (!is_unsigned(entry.type) || entry.count == 0)
            throw_broken(FileFormat::tiff, "a tag of it has the wrong type");
        reader_.seek(entry.position);
        std::vector<std::uint64_t> values(std::min(entry.count, at_most));
        for (std::uint64_t& value : values) value = reader_.number(size_of(entry.type));
        return values;
    }

    std::uint64_t number(const Entry& entry) { return numbers(entry, 1)[0]; }

    std::string_view text(const Entry& entry) {
        if (entry.type != 2 || entry.count > max_no_data_text) return {};
        reader_.seek(entry.position);
        return reader_.take(entry.count);
    }

private:
    std::uint64_t offset() { return big_ ? reader_.u64() : reader_.u32(); }

    Entry next_entry() {
        Entry entry;
        entry.tag = reader_.u16();
        entry.type = reader_.u16();
        entry.count = offset();
        const std::size_t field = reader_.position(), field_size = big_ ? 8 : 4;
        const bool in_field =
            entry.count <= field_size && entry.count * size_of(entry.type) <= field_size;
        entry.position = in_field ? field : offset();
        reader_.seek(field + field_size);
        return entry;
    }

    ByteReader reader_;
    bool big_ = false;
};

std::optional<double> parse_number(std::string_view text) {
    text = text.substr(0, text.find('\0'));
    const std::size_t first = text.find_first_not_of(" \t+");
    if (first == std::string_view::npos) return std::nullopt;
    text.remove_prefix(first);
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    const std::string_view rest = text.substr(std::size_t(end - text.data()));
    if (error != std::errc() || rest.find_first_not_of(" \t\r\n") != std::string_view::npos)
        return std::nullopt;
    return value;
}

void apply(const Entry& entry, TiffReader& reader, Directory& directory) {
    switch (entry.tag) {
        case image_width:
            directory.width = reader.number(entry);
            break;
        case image_length:
            directory.height = reader.number(entry);
            break;
        case image_depth:
            directory.depth = reader.number(entry);
            break;
        case tile_width:
            directory.tile_width = reader.number(entry);
            break;
        case tile_length:
            directory.tile_height = reader.number(entry);
            break;
        case samples_per_pixel:
            directory.samples = reader.number(entry);
            break;
        case planar_configuration:
            directory.planar = reader.number(entry);
            break;
        case compression:
            directory.compression = reader.number(entry);
            break;
        case photometric:
            directory.photometric = reader.number(entry);
            break;
        case bits_per_sample:
            directory.bits = reader.numbers(entry, 16);
            break;
        case sample_format:
            directory.formats = reader.numbers(entry, 16);
            break;
        case gdal_nodata:
            directory.no_data = parse_number(reader.text(entry));
            break;
        default:
            break;
    }
}

bool all_equal(const std::vector<std::uint64_t>& values) {
    return std::all_of(values.begin(), values.end(),
                       [&](auto value) { return value == values[0]; });
}

bool is_known_type(std::uint64_t bits, std::uint64_t format) {
    switch (format) {
        case 1:
            return bits == 1 || bits == 2 || bits == 4 || bits == 8 || bits == 16 || bits == 32;
        case 2:
            return bits == 8 || bits == 16 || bits == 32;
        case 3:
            return bits == 16 || bits == 32 || bits == 64;
        default:
            return false;
    }
}

void check_kind(const Directory& d) {
    const auto unsupported = [](const char* what) { throw_unsupported(FileFormat::tiff, what); };
    const bool deflate = d.compression == 8 || d.compression == 32946;
    const bool palette = d.photometric == 3;
    if (d.depth != 1) unsupported("more than one layer of depth");
    if (d.photometric == 5) unsupported("CMYK colour");
    if (d.photometric > 3) unsupported("colours other than grey, RGB and palettes");
    if (!all_equal(d.bits) || !all_equal(d.formats)) unsupported("channels of different types");
    if (!is_known_type(d.bits[0], d.formats[0]))
        unsupported("other numbers than 8, 16 and 32-bit integers and 16, 32 and 64-bit floats");
    if (palette && (d.bits[0] > 8 || d.formats[0] != 1 || d.samples != 1))
        unsupported("palettes of more than 256 colours, or with alpha");
    if (!deflate && d.compression != 1 && d.compression != 5 && d.compression != 32773 &&
        d.compression != 50000)
        unsupported("other compression than LZW, Deflate, PackBits and Zstandard");
}

std::int64_t clamped(std::uint64_t value) {
    return std::int64_t(std::min<std::uint64_t>(value, UINT32_MAX));
}

// Of the strips. Tiles may share their bytes (deduplicating writers do that).
std::int64_t least_bytes(const Directory& d) {
    const bool deflate = d.compression == 8 || d.compression == 32946;
    const std::int64_t raw = capped_product({clamped(d.width), clamped(d.height),
                                             clamped(d.samples), std::int64_t(d.bits[0])}) /
                             8;
    if (d.tile_width != 0) return 0;
    if (d.compression == 1) return raw;
    return deflate ? raw / deflate_expansion : 0;
}

// The reader scales grey of few bits to bytes and turns white and black around in bytes; palettes
// have indices for it.
std::optional<double> no_data_as_read(const Directory& d) {
    if (!d.no_data || d.photometric == 3) return std::nullopt;
    const bool bytes = d.formats[0] == 1 && d.bits[0] <= 8;
    const double value = bytes ? *d.no_data * 255 / ((1 << d.bits[0]) - 1) : *d.no_data;
    return bytes && d.photometric == 0 ? 255 - value : value;
}

}  // namespace

FileHeader read_tiff_header(std::string_view bytes) {
    TiffReader reader(bytes);
    Directory d;
    std::set<std::uint16_t> seen;
    for (const Entry& entry : reader.entries()) {
        if (!seen.insert(entry.tag).second)
            throw_broken(FileFormat::tiff,
                         "a tag is there twice");  // which one counts differs between readers
        apply(entry, reader, d);
    }
    check_kind(d);
    if ((d.tile_width == 0) != (d.tile_height == 0))
        throw_broken(FileFormat::tiff, "its tiles have no size");
    FileHeader header;
    header.width = clamped(d.width);
    header.height = clamped(d.height);
    header.channels = d.photometric == 3 ? 3 : clamped(d.samples);
    header.tile_bytes = capped_product({clamped(d.tile_width), clamped(d.tile_height),
                                        header.channels, std::int64_t(d.bits[0] + 7) / 8});
    header.least_bytes = least_bytes(d);
    header.min_is_white = d.photometric == 0;
    header.no_data = no_data_as_read(d);
    return header;
}

}  // namespace relit
