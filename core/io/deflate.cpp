#include "core/io/deflate.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <memory>
#include <new>
#include <stdexcept>
#include <string>

#include <isa-l/igzip_lib.h>
#include <libdeflate.h>
#include <zlib.h>

namespace relit {
namespace {

using Bytes = std::span<const std::uint8_t>;

// --- Fast ----------------------------------------------------------------------------------------

// 0.4 MB in all: too much for a thread's stack. Needs no values of ours: isal_deflate_init() sets
// what is read.
struct FastDeflater {
    isal_zstream stream;
    std::array<std::uint8_t, ISAL_DEF_LVL1_DEFAULT> tokens;
};

// A stored block (RFC 1951, 3.2.4) that is not the last, of one byte.
std::uint8_t* append_stored_byte(std::uint8_t byte, std::uint8_t* out) {
    for (const int value : {0x00, 0x01, 0x00, 0xfe, 0xff, int(byte)}) *out++ = std::uint8_t(value);
    return out;
}

// The first byte is stored here and given to ISA-L as a dictionary, since ISA-L (2.30 on x86-64)
// without one begins differently from process to process: it files the third byte under a hash of
// its isal_zstream's address (.write_first_byte of igzip_icf_body_h1_gr_bt.asm shifts rcx where it
// means the input). Where that is the hash of another early byte, a match with what begins there is
// lost, and 1 of some thousand pictures differs. Costs some 30 bytes a strip, no time.
std::size_t fast_strip(Bytes bytes, bool last, std::uint8_t* out) {
    const auto deflater = std::make_unique_for_overwrite<FastDeflater>();
    auto* const first = const_cast<std::uint8_t*>(bytes.data());  // it only reads them
    isal_zstream& stream = deflater->stream;
    isal_deflate_init(&stream);
    stream.level = 1;
    stream.level_buf = deflater->tokens.data();
    stream.level_buf_size = std::uint32_t(deflater->tokens.size());
    stream.flush = FULL_FLUSH;
    stream.end_of_stream = last;
    stream.next_in = first + 1;
    stream.avail_in = std::uint32_t(bytes.size() - 1);
    stream.next_out = append_stored_byte(*first, out);
    stream.avail_out = std::uint32_t(out + deflate_bound(bytes.size()) - stream.next_out);
    int result = isal_deflate_set_dict(&stream, first, 1);
    if (result == COMP_OK) result = isal_deflate(&stream);
    if (result != COMP_OK)
        throw std::runtime_error("ISA-L's deflate failed with code " + std::to_string(result));
    // Input that waits for room is in the stream's own buffer and no longer counted.
    if (stream.avail_in != 0 || stream.avail_out == 0)
        throw std::runtime_error("ISA-L's deflate found no room for what it wrote");
    return std::size_t(stream.next_out - out);
}

// --- Small ---------------------------------------------------------------------------------------

struct BitRange {
    std::size_t begin = 0;
    std::size_t end = 0;
};

// The last block of a deflate stream. Where blocks begin is known to who inflates them.
BitRange last_block(Bytes deflated) {
    z_stream stream{};
    if (inflateInit2(&stream, -15) != Z_OK) throw std::bad_alloc();
    const std::unique_ptr<z_stream, decltype(&inflateEnd)> owner(&stream, inflateEnd);
    std::array<std::uint8_t, 32768> unwanted;
    stream.next_in = const_cast<std::uint8_t*>(deflated.data());  // it only reads them
    stream.avail_in = std::uint32_t(deflated.size());
    constexpr int unused_bits = 7, in_last_block = 64, at_block_end = 128;  // zlib.h, data_type
    for (std::size_t begin = 0;;) {
        stream.next_out = unwanted.data();
        stream.avail_out = std::uint32_t(unwanted.size());
        if (inflate(&stream, Z_BLOCK) != Z_OK)
            throw std::runtime_error("zlib cannot read what libdeflate wrote");
        if (!(stream.data_type & at_block_end)) continue;
        const std::size_t at =
            std::size_t(stream.total_in) * 8 - std::size_t(stream.data_type & unused_bits);
        if (stream.data_type & in_last_block) return {begin, at};
        begin = at;
    }
}

// Opens the end of a stream: its last block no longer says that it is, and an empty stored block
// (RFC 1951, 3.2.4) fills up the byte.
std::size_t open_end(std::uint8_t* out, std::size_t size) {
    const BitRange last = last_block({out, size});
    out[last.begin / 8] &= std::uint8_t(~(1u << last.begin % 8));
    std::uint8_t* to = out + size;
    const std::size_t padding = size * 8 - last.end;  // zeros
    if (padding < 3) *to++ = 0;                       // no room for the head of the empty block
    for (const std::uint8_t byte : {0x00, 0x00, 0xff, 0xff}) *to++ = byte;
    return std::size_t(to - out);
}

std::size_t small_strip(Bytes bytes, bool last, std::uint8_t* out) {
    const std::unique_ptr<libdeflate_compressor, decltype(&libdeflate_free_compressor)> compressor(
        libdeflate_alloc_compressor(6), libdeflate_free_compressor);
    if (!compressor) throw std::bad_alloc();
    const std::size_t size = libdeflate_deflate_compress(
        compressor.get(), bytes.data(), bytes.size(), out, deflate_bound(bytes.size()));
    if (size == 0) throw std::runtime_error("libdeflate found no room for what it wrote");
    return last ? size : open_end(out, size);
}

}  // namespace

std::uint32_t adler32(Bytes bytes) { return libdeflate_adler32(1, bytes.data(), bytes.size()); }

std::uint32_t adler32_joined(std::uint32_t first, std::uint32_t second, std::size_t second_size) {
    // The low half is 1 + the sum of the bytes, the high half the sum of the low halves after each.
    constexpr std::uint64_t modulus = 65521;
    const std::uint64_t sum = ((first & 0xffff) + modulus - 1) % modulus;  // of the first's bytes
    const std::uint64_t low = (sum + (second & 0xffff)) % modulus;
    const std::uint64_t high =
        ((first >> 16) + (second >> 16) + second_size % modulus * sum) % modulus;
    return std::uint32_t(high << 16 | low);
}

std::uint32_t crc32(std::span<const std::uint8_t> bytes, std::uint32_t so_far) {
    return libdeflate_crc32(so_far, bytes.data(), bytes.size());
}

std::size_t deflate_bound(std::size_t size) {
    // ISA-L ends a block at 64 k tokens and stores it where that is shorter, in pieces of 65535
    // bytes, each with a head of 5: two of them for 65535 bytes at worst. To that come the first
    // byte's block, the flush and what ISA-L wants to be left over when it stops. libdeflate needs
    // what it says and 5 for the open end.
    return std::max(size + (size / 65535 + 1) * 2 * 6 + 64,
                    libdeflate_deflate_compress_bound(nullptr, size) + 5);
}

std::size_t deflate_strip(Effort effort, Bytes bytes, bool last, std::uint8_t* out) {
    assert(!bytes.empty() && bytes.size() <= UINT32_MAX);
    return effort == Effort::fast ? fast_strip(bytes, last, out) : small_strip(bytes, last, out);
}

}  // namespace relit
