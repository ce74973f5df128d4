#include "core/io/decode.h"

#include <algorithm>
#include <cstring>
#include <memory>
#include <new>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include "core/base/error.h"
#include "core/image/channels.h"
#include "core/io/header.h"
#include "core/io/oiio.h"
#include "core/io/texels.h"
#include "core/io/tiff_float64.h"

namespace relit {
namespace {

constexpr std::size_t native_buffer_bytes = 1 << 20;

// --- Limits --------------------------------------------------------------------------------------

[[noreturn]] void throw_too_large(const FileHeader& header, std::int64_t limit, const char* unit,
                                  std::string_view setting) {
    throw Error(error_code::image_too_large,
                "the image is " + std::to_string(header.width) + " x " +
                    std::to_string(header.height) + " pixels; the limit is " +
                    std::to_string(limit) + unit + " (" + std::string(setting) + ")",
                {}, setting);
}

void check_limits(const FileHeader& header, const DecodeLimits& limits, FileFormat format) {
    if (header.width < 1 || header.height < 1 || header.channels < 1)
        throw_broken(format, "it has no pixels");
    const std::int64_t pixels = capped_product({header.width, header.height});
    if (pixels > limits.max_pixels)
        throw_too_large(header, limits.max_pixels, " pixels", "max-image-pixels");
    if (header.width > limits.max_side || header.height > limits.max_side)
        throw_too_large(header, limits.max_side, " pixels a side", "max-image-side");
    if (header.held_whole && pixels > limits.max_interlaced_pixels)
        throw_too_large(header, limits.max_interlaced_pixels,
                        " pixels for interlaced and progressive files and WebP",
                        "max-interlaced-pixels");
    if (header.channels > limits.max_channels)
        throw Error(error_code::image_too_large,
                    "the image has " + std::to_string(header.channels) +
                        " channels; the limit is " + std::to_string(limits.max_channels) +
                        " (max-image-channels)",
                    {}, "max-image-channels");
    if (capped_product({pixels, header.channels}) > limits.max_values)
        throw_too_large(header, limits.max_values, " pixels times channels", "max-image-values");
    if (header.tile_bytes > limits.max_tile_bytes)
        throw Error(error_code::image_too_large,
                    "a tile of the image is larger than the limit of " +
                        std::to_string(limits.max_tile_bytes) + " bytes (max-tile-bytes)",
                    {}, "max-tile-bytes");
}

// --- The reader ----------------------------------------------------------------------------------

std::unique_ptr<OIIO::ImageInput> reader_of(FileFormat format) {
    configure_openimageio();
    return OIIO::ImageInput::create(format == FileFormat::exr ? "openexr"
                                                              : std::string(name_of(format)));
}

// The file's bytes. OpenImageIO 2.4's own reader of memory adds an offset and a size without a look at
// what overflows: an OpenEXR that says its rows are before its beginning was given what lies there.
class FileInMemory final : public OIIO::Filesystem::IOMemReader {
public:
    explicit FileInMemory(std::string_view bytes) : IOMemReader(bytes.data(), bytes.size()) {}

    std::size_t read(void* buffer, std::size_t size) override {
        const std::size_t count = pread(buffer, size, m_pos);
        m_pos += std::int64_t(count);
        return count;
    }
    std::size_t pread(void* buffer, std::size_t size, std::int64_t offset) override {
        const auto whole = std::int64_t(m_buf.size());
        if (offset < 0 || offset >= whole) return 0;
        const std::size_t count = std::min(size, std::size_t(whole - offset));
        std::memcpy(buffer, m_buf.data() + offset, count);
        return count;
    }
};

// One opened file. Errors of OpenImageIO are taken from it and dropped: they name files and
// functions, and it prints what nobody fetched.
class Reader {
public:
    Reader(std::string_view bytes, FileFormat format) : format_(format), memory_(bytes) {
        input_ = reader_of(format);
        if (!input_) throw_unsupported(format_, "any content");  // built without that reader
        OIIO::ImageSpec config;
        OIIO::Filesystem::IOProxy* proxy = &memory_;
        config.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &proxy);
        config.attribute("oiio:UnassociatedAlpha", 1);
        const bool opened = input_->open("upload", spec_, config);
        if (!healthy(opened)) throw_broken(format_, "its header makes no sense");
        if (format == FileFormat::tiff && spec_.format == OIIO::TypeDesc::DOUBLE)
            doubles_ = std::make_unique<Float64Tiff>(bytes);
    }
    ~Reader() {
        input_->close();
        (void)healthy(true);
    }
    Reader(const Reader&) = delete;
    Reader& operator=(const Reader&) = delete;

    [[nodiscard]] const OIIO::ImageSpec& spec() const { return spec_; }

    // Rows `begin` to `end`, counted from the top, in spec().format: the file's own, or the one that
    // holds all of them where an OpenEXR's channels are of several types.
    void read_rows(int begin, int end, std::byte* out) {
        if (doubles_) {
            for (int y = begin; y < end; ++y, out += spec_.scanline_bytes())
                doubles_->read_row(y, out);
            return;
        }
        check(input_->read_scanlines(0, 0, spec_.y + begin, spec_.y + end, 0, 0, spec_.nchannels,
                                     spec_.format, out));
    }

    // The whole tile with its top left texel at (x, y), the part outside the picture included.
    void read_tile(int x, int y, std::byte* out) {
        if (doubles_) return doubles_->read_tile(x, y, out);
        check(input_->read_tile(spec_.x + x, spec_.y + y, 0, spec_.format, out));
    }

private:
    // A call may return true with an error pending: truncated JPEG and TIFF do.
    bool healthy(bool returned) {
        const bool pending = input_->has_error();
        if (pending || !returned) (void)input_->geterror();
        if (OIIO::has_error()) (void)OIIO::geterror();
        return returned && !pending;
    }
    void check(bool returned) {
        if (!healthy(returned)) throw_broken(format_, "its texels are cut off or damaged");
    }

    FileFormat format_;
    FileInMemory memory_;
    std::unique_ptr<OIIO::ImageInput> input_;
    OIIO::ImageSpec spec_;
    std::unique_ptr<Float64Tiff> doubles_;
};

SampleType sample_type_of(const OIIO::ImageSpec& spec, FileFormat format) {
    switch (spec.format.basetype) {
        case OIIO::TypeDesc::UINT8:
            return SampleType::uint8;
        case OIIO::TypeDesc::UINT16:
            return SampleType::uint16;
        case OIIO::TypeDesc::UINT32:
            return SampleType::uint32;
        case OIIO::TypeDesc::INT8:
            return SampleType::int8;
        case OIIO::TypeDesc::INT16:
            return SampleType::int16;
        case OIIO::TypeDesc::INT32:
            return SampleType::int32;
        case OIIO::TypeDesc::HALF:
            return SampleType::float16;
        case OIIO::TypeDesc::FLOAT:
            return SampleType::float32;
        case OIIO::TypeDesc::DOUBLE:
            return SampleType::float64;
        default:
            throw_unsupported(format, "numbers of this type");
    }
}

// What was checked against the limits has to be what the decoder is about to read.
void check_agreement(const OIIO::ImageSpec& spec, const FileHeader& header,
                     const DecodeLimits& limits, FileFormat format) {
    if (spec.deep || spec.depth > 1)
        throw_unsupported(format, "deep texels or more than one layer of depth");
    const std::int64_t tile_bytes =
        capped_product({spec.tile_width, spec.tile_height, std::int64_t(spec.pixel_bytes())});
    if (spec.width != header.width || spec.height != header.height ||
        spec.nchannels != header.channels || tile_bytes > limits.max_tile_bytes)
        throw_broken(format, "its header contradicts itself");
}

// --- Reading -------------------------------------------------------------------------------------

// Rows at a time: few enough that the buffer stays small, and whole strips where strips are small,
// which the TIFF reader hands out without a detour.
int rows_at_once(const OIIO::ImageSpec& spec) {
    const std::size_t row_bytes = std::max<std::size_t>(spec.scanline_bytes(), 1);
    const int rows = int(std::clamp<std::size_t>(native_buffer_bytes / row_bytes, 1, 256));
    const int strip = spec.get_int_attribute("tiff:RowsPerStrip", 32);  // OpenEXR packs up to 32
    return strip > 0 && strip <= rows ? rows / strip * strip : rows;
}

// Row by row out of several compressed planes, libtiff decompresses a strip from its start for
// every row: hours, for a large strip. Whole strips are read at once.
void check_planes(const OIIO::ImageSpec& spec, FileFormat format) {
    const bool separate =
        spec.get_string_attribute("planarconfig") == "separate" && spec.nchannels > 1;
    if (!separate || format != FileFormat::tiff) return;
    if (spec.format == OIIO::TypeDesc::DOUBLE)
        throw_unsupported(format, "64-bit floats in separate planes");
    const bool compressed = spec.get_int_attribute("tiff:Compression", 1) != 1;
    const std::int64_t strip = spec.get_int_attribute("tiff:RowsPerStrip", spec.height);
    if (compressed && spec.tile_width == 0 &&
        std::min<std::int64_t>(strip, spec.height) > rows_at_once(spec))
        throw_unsupported(format, "separate planes in compressed strips of more than 1 MB");
}

// The image grows as rows arrive, so that a file which claims much and holds little costs little.
class GrowingImage {
public:
    GrowingImage(const ImageInfo& info, const TexelRoom& room) : info_(info), room_(room) {}

    void grow_to(int rows) { first_ = room_(info_, row_values() * std::size_t(rows)); }
    [[nodiscard]] float* at(int x, int y) const {
        return first_ + row_values() * std::size_t(y) +
               std::size_t(x) * std::size_t(info_.channels);
    }
    [[nodiscard]] std::span<float> values() const {
        return {first_, row_values() * std::size_t(info_.height)};
    }

private:
    [[nodiscard]] std::size_t row_values() const {
        return std::size_t(info_.width) * std::size_t(info_.channels);
    }
    const ImageInfo& info_;
    const TexelRoom& room_;
    float* first_ = nullptr;
};

void read_all_rows(Reader& reader, SampleType type, const Conversion& conversion,
                   GrowingImage& image) {
    const OIIO::ImageSpec& spec = reader.spec();
    const int step = rows_at_once(spec);
    std::vector<std::byte> stored(spec.scanline_bytes() * std::size_t(step));
    for (int y = 0; y < spec.height; y += step) {
        const int end = std::min(y + step, spec.height);
        reader.read_rows(y, end, stored.data());
        image.grow_to(end);
        convert_texels(stored.data(), type, std::size_t(spec.width) * std::size_t(end - y),
                       conversion, image.at(0, y));
    }
}

void read_all_tiles(Reader& reader, SampleType type, const Conversion& conversion,
                    GrowingImage& image) {
    const OIIO::ImageSpec& spec = reader.spec();
    std::vector<std::byte> stored(spec.tile_bytes());
    for (int top = 0; top < spec.height; top += spec.tile_height) {
        const int rows = std::min(spec.tile_height, spec.height - top);
        for (int left = 0; left < spec.width; left += spec.tile_width) {
            const int columns = std::min(spec.tile_width, spec.width - left);
            reader.read_tile(left, top, stored.data());
            image.grow_to(top + rows);
            for (int y = 0; y < rows; ++y)
                convert_texels(
                    stored.data() + std::size_t(y) * spec.tile_width * spec.pixel_bytes(), type,
                    std::size_t(columns), conversion, image.at(left, top + y));
        }
    }
}

ImageInfo read_texels(std::string_view bytes, const FileHeader& header, const DecodeLimits& limits,
                      FileFormat format, const TexelRoom& room) {
    Reader reader(header.stripped.empty() ? bytes : header.stripped, format);
    const OIIO::ImageSpec& spec = reader.spec();
    check_agreement(spec, header, limits, format);
    check_planes(spec, format);
    const bool named = format == FileFormat::exr;
    const ChannelMap map = named ? map_named_channels(spec.channelnames, format)
                                 : map_ordered_channels(spec.nchannels, spec.alpha_channel);
    // The reader has already turned white and black around in 8-bit files.
    const bool invert = header.min_is_white && spec.format != OIIO::TypeDesc::UINT8;
    const Conversion conversion{spec.nchannels, map, invert, header.no_data};

    const bool associated = map.has_alpha && !spec.get_int_attribute("oiio:UnassociatedAlpha");
    // WebP stores plain colour; it is the reader that multiplies it, whatever it is told.
    const bool multiplied_by_reader = associated && format == FileFormat::webp;
    const ImageInfo info = {
        format,        sample_type_of(spec, format),       spec.width, spec.height, map.count,
        map.has_alpha, associated && !multiplied_by_reader};
    GrowingImage image(info, room);
    const auto read_all = spec.tile_width > 0 ? read_all_tiles : read_all_rows;
    read_all(reader, info.type, conversion, image);
    if (multiplied_by_reader) divide_by_alpha(image.values(), info.channels);
    return info;
}

}  // namespace

void prepare_decoders() {
    for (const FileFormat format : {FileFormat::png, FileFormat::jpeg, FileFormat::webp,
                                    FileFormat::tiff, FileFormat::exr, FileFormat::hdr})
        (void)reader_of(format);
}

DecodedImage decode(std::string_view bytes, const DecodeLimits& limits) {
    Image image;
    const ImageInfo info =
        decode_into(bytes, limits, [&](const ImageInfo& facts, std::size_t values) {
            if (image.values.empty()) image.values.reserve(facts.value_count());
            image.values.resize(values);
            return image.values.data();
        });
    image.width = info.width;
    image.height = info.height;
    image.channels = info.channels;
    return {info, std::move(image)};
}

ImageInfo decode_into(std::string_view bytes, const DecodeLimits& limits, const TexelRoom& room) {
    const FileFormat format = sniff_format(bytes);
    try {
        const FileHeader header = read_header(bytes, format);
        check_limits(header, limits, format);
        if (header.least_bytes > std::int64_t(bytes.size()))
            throw_broken(format, "it is too short for the size it claims");
        return read_texels(bytes, header, limits, format, room);
    } catch (const Error&) {
        throw;
    } catch (const std::bad_alloc&) {
        throw Error(error_code::image_too_large, "there is not enough memory for the image");
    } catch (const std::exception&) {
        throw_broken(format,
                     "its texels cannot be decoded");  // the decoder's own words name its internals
    }
}

}  // namespace relit
