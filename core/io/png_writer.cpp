#include "core/io/png_writer.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include <libdeflate.h>

#include "core/io/deflate.h"
#include "core/io/png_rows.h"
#include "core/io/strips.h"

namespace relit {
namespace {

void append_u32(std::string& out, std::uint32_t value) {
    for (int shift = 24; shift >= 0; shift -= 8) out += char(value >> shift & 0xff);
}

void append_chunk(std::string& out, std::string_view type, std::string_view data) {
    assert(data.size() <= 0x7fffffff);
    append_u32(out, std::uint32_t(data.size()));
    const std::size_t start = out.size();
    out += type;
    out += data;
    append_u32(out, libdeflate_crc32(0, out.data() + start, out.size() - start));
}

std::string ihdr(int width, int height, int channels, int bit_depth) {
    constexpr std::array<char, 5> colour_type{0, 0, 4, 2, 6};  // by channels
    std::string data;
    append_u32(data, std::uint32_t(width));
    append_u32(data, std::uint32_t(height));
    data += char(bit_depth);
    data += colour_type[std::size_t(channels)];
    data.append(3, '\0');  // deflate, adaptive filters, not interlaced
    return data;
}

// UTF-8 -> Latin-1, if every character has a place there.
std::optional<std::string> latin1(std::string_view utf8) {
    std::string out;
    for (std::size_t i = 0; i < utf8.size(); ++i) {
        const auto byte = static_cast<unsigned char>(utf8[i]);
        if (byte < 0x80) {
            out += char(byte);
            continue;
        }
        const bool two_bytes =
            (byte == 0xc2 || byte == 0xc3) && i + 1 < utf8.size() && (utf8[i + 1] & 0xc0) == 0x80;
        if (!two_bytes) return std::nullopt;
        out += char((byte & 0x03) << 6 | (utf8[++i] & 0x3f));
    }
    return out;
}

void append_text(std::string& out, const TextEntry& entry) {
    assert(!entry.keyword.empty() && entry.keyword.size() <= 79);
    assert(entry.keyword.find('\0') == std::string::npos &&
           entry.text.find('\0') == std::string::npos);
    const std::string head = entry.keyword + '\0';
    if (const std::optional<std::string> text = latin1(entry.text))
        append_chunk(out, "tEXt", head + *text);
    else
        append_chunk(out, "iTXt",
                     head + std::string(4, '\0') + entry.text);  // not compressed, no language
}

// --- Texels: strips, each filtered and deflated by itself ----------------------------------------

struct Method {
    PngFilter filter;
    std::size_t strip_bytes;  // about
};

Method method_of(Effort effort) {
    // Up is the filter that costs nothing. Average for every row gives smaller files of relit
    // pictures than Up (+ 8 %) and than choosing per row (+ 1 %). Strips of small are as long as
    // pictures of 1024 x 1024, since each but the last has its price.
    if (effort == Effort::fast) return {PngFilter::up, strip_bytes};
    return {PngFilter::average, std::size_t(1) << 22};
}

}  // namespace

PngWriter::PngWriter(int width, int height, int channels, EncodeOptions options)
    : width_(width),
      height_(height),
      channels_(channels),
      options_(std::move(options)),
      strip_rows_(relit::strip_rows(height, method_of(options_.effort).strip_bytes /
                                                png_row_bytes(width, channels, options_.bit_depth))),
      file_("\x89PNG\r\n\x1a\n") {
    assert(options_.bit_depth == 8 || options_.bit_depth == 16);
    append_chunk(file_, "IHDR", ihdr(width, height, channels, options_.bit_depth));
    if (options_.srgb) append_chunk(file_, "sRGB", std::string_view("\0", 1));  // perceptual intent
    for (const TextEntry& entry : options_.text) append_text(file_, entry);
}

PngWriter::Strip PngWriter::strip_of(const Image& picture, RowRange rows) const {
    const std::size_t size =
        std::size_t(rows.end - rows.begin) * png_row_bytes(width_, channels_, options_.bit_depth);
    const auto filtered = std::make_unique_for_overwrite<std::uint8_t[]>(size);
    filter_rows(picture, above_, options_.bit_depth, method_of(options_.effort).filter, rows,
                filtered.get());
    const std::span<const std::uint8_t> bytes(filtered.get(), size);

    const auto deflated = std::make_unique_for_overwrite<char[]>(2 + deflate_bound(size));
    const std::size_t head = done_ + rows.begin == 0 ? 2 : 0;
    std::copy_n(zlib_header, head, deflated.get());
    const std::size_t tail = deflate_strip(options_.effort, bytes, done_ + rows.end == height_,
                                           reinterpret_cast<std::uint8_t*>(deflated.get()) + head);
    Strip strip{.chunk = {}, .checksum = adler32(bytes), .size = size};
    append_chunk(strip.chunk, "IDAT", {deflated.get(), head + tail});
    return strip;
}

void PngWriter::add(const Image& rows, const EncodeControl& control) {
    assert(rows.width == width_ && rows.channels == channels_);
    assert(rows.height % strip_rows_ == 0 || done_ + rows.height == height_);
    add_strips(strips_, rows.height, strip_rows_, control,
               [&](RowRange strip) { return strip_of(rows, strip); });
    done_ += rows.height;
    const std::span<const float> last = rows.row(rows.height - 1);
    above_.assign(last.begin(), last.end());
}

void PngWriter::append_strips() {
    std::size_t size = file_.size() + 64;
    for (const Strip& strip : strips_) size += strip.chunk.size();
    file_.reserve(size);
    std::uint32_t checksum = 1;
    for (Strip& strip : strips_) {
        file_ += std::exchange(strip.chunk, {});  // not all texels twice in memory
        checksum = adler32_joined(checksum, strip.checksum, strip.size);
    }
    std::string end;
    append_u32(end, checksum);
    append_chunk(file_, "IDAT", end);
}

std::string PngWriter::finished() {
    assert(done_ == height_);
    append_strips();
    append_chunk(file_, "IEND", {});
    return std::move(file_);
}

}  // namespace relit
