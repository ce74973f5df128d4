#include "core/io/jpeg_writer.h"

#include <algorithm>
#include <cassert>
#include <memory>
#include <new>
#include <stdexcept>
#include <string_view>
#include <utility>
#include <vector>

#include <turbojpeg.h>

#include "core/io/quantise.h"
#include "core/io/strips.h"

namespace relit {
namespace {

constexpr int block_side = 8;  // of the unit that a scan without subsampling is made of

std::string big_endian(int value) { return {char(value >> 8 & 0xff), char(value & 0xff)}; }

// A file of its own of some rows.
std::string whole_file(const Image& picture, RowRange rows, int quality) {
    const std::size_t row_size = picture.row(0).size();
    const auto samples = std::make_unique_for_overwrite<std::uint8_t[]>(
        row_size * std::size_t(rows.end - rows.begin));
    for (int y = rows.begin; y < rows.end; ++y)
        quantise_row(picture.row(y), samples.get() + row_size * std::size_t(y - rows.begin));

    const std::unique_ptr<void, decltype(&tjDestroy)> compressor(tjInitCompress(), tjDestroy);
    if (!compressor) throw std::bad_alloc();
    const bool grey = picture.channels == 1;
    unsigned char* bytes = nullptr;
    unsigned long size = 0;
    const int failed =
        tjCompress2(compressor.get(), samples.get(), picture.width, 0, rows.end - rows.begin,
                    grey ? TJPF_GRAY : TJPF_RGB, &bytes, &size, grey ? TJSAMP_GRAY : TJSAMP_444,
                    quality, TJFLAG_ACCURATEDCT);
    const std::unique_ptr<unsigned char, decltype(&tjFree)> owner(bytes, tjFree);
    if (failed)
        throw std::runtime_error(std::string("the JPEG encoder failed: ") +
                                 tjGetErrorStr2(compressor.get()));
    return {reinterpret_cast<const char*>(bytes), size};
}

// Where the first marker `type` of a file's head begins (ITU-T T.81, B.1.1).
std::size_t find_marker(std::string_view file, unsigned char type) {
    const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(file.at(i)); };
    std::size_t at = 2;  // behind SOI
    while (byte(at + 1) != type) at += 2 + std::size_t(byte(at + 2) << 8 | byte(at + 3));
    return at;
}

std::string_view scan_of(std::string_view file) {
    const std::size_t start = find_marker(file, 0xda);
    const std::size_t begin = start + 2 + static_cast<unsigned char>(file[start + 3]);
    return file.substr(begin, file.size() - begin - 2);  // without EOI
}

// The head of the first strip, made that of the whole picture.
std::string joined_head(std::string_view first, int height, int restart_interval) {
    const std::size_t scan = find_marker(first, 0xda);
    std::string head(first.substr(0, scan));
    head.replace(find_marker(head, 0xc0) + 5, 2, big_endian(height));  // baseline frame
    head += std::string("\xff\xdd\0\4", 4) + big_endian(restart_interval);
    return head.append(first.substr(scan, std::size_t(scan_of(first).data() - &first[scan])));
}

std::string joined(const std::vector<std::string>& strips, int height, int restart_interval) {
    std::string file = joined_head(strips.front(), height, restart_interval);
    std::size_t size = file.size();
    for (const std::string& strip : strips) size += strip.size();
    file.reserve(size);
    for (std::size_t i = 0; i < strips.size(); ++i) {
        file += scan_of(strips[i]);
        file += '\xff';
        file += i + 1 < strips.size() ? char(0xd0 + i % 8) : '\xd9';  // RST0 to RST7, EOI
    }
    return file;
}

}  // namespace

JpegWriter::JpegWriter(int width, int height, int channels, int quality)
    : width_(width), height_(height), channels_(channels), quality_(quality) {
    assert(channels == 1 || channels == 3);
    const int blocks_high = (height - 1) / block_side + 1;
    const std::size_t row_bytes = std::size_t(width) * std::size_t(channels);
    // An interval of 65535 units is the longest there is: no strip comes near, nor one row of units.
    strip_rows_ =
        block_side * relit::strip_rows(blocks_high, strip_bytes / (row_bytes * block_side));
}

void JpegWriter::add(const Image& rows, const EncodeControl& control) {
    assert(rows.width == width_ && rows.channels == channels_);
    assert(rows.height % strip_rows_ == 0 || done_ + rows.height == height_);
    add_strips(strips_, rows.height, strip_rows_, control,
               [&](RowRange strip) { return whole_file(rows, strip, quality_); });
    done_ += rows.height;
}

std::string JpegWriter::finished() {
    assert(done_ == height_);
    if (strips_.size() == 1) return std::move(strips_.front());
    const int blocks_wide = (width_ - 1) / block_side + 1;
    return joined(strips_, height_, strip_rows_ / block_side * blocks_wide);
}

}  // namespace relit
