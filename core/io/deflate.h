// Bytes -> zlib streams (RFC 1950) in strips that know nothing of each other: fast by ISA-L, small
// by libdeflate. For png_writer.cpp.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "core/io/encode.h"

namespace relit {

/// What opens every zlib stream: deflate, a window of 32 kB, no dictionary, the fastest level.
inline constexpr char zlib_header[] = "\x78\x01";

/// Checksum of RFC 1950, and that of two ranges one behind the other from those of each.
[[nodiscard]] std::uint32_t adler32(std::span<const std::uint8_t> bytes);
[[nodiscard]] std::uint32_t adler32_joined(std::uint32_t first, std::uint32_t second,
                                           std::size_t second_size);

/// Checksum of PNG's chunks and of ZIP's files, over pieces: `so_far` is that of the bytes before.
[[nodiscard]] std::uint32_t crc32(std::span<const std::uint8_t> bytes, std::uint32_t so_far = 0);

/// What deflate_strip() writes of so many bytes at most.
[[nodiscard]] std::size_t deflate_bound(std::size_t size);

/// Deflates one strip of a stream. Strips end at a whole byte, so that any number of them, one
/// behind the other, are one stream.
///
/// @param effort  fast: ISA-L's level 1. small: libdeflate's level 6, as small as zlib's in a third
///                of its time; a strip that is not the last costs a third more than one that is
/// @param bytes   at least 1 and less than 4 GB (asserted)
/// @param last    ends the stream
/// @param out     room for deflate_bound() of the size
/// @return        how many bytes it wrote. Of small the same ones everywhere; of fast the same ones
///                on every x86-64 processor with SSE 4.2, others elsewhere, where ISA-L hashes by
///                other instructions
/// @throws std::runtime_error when the encoder fails, std::bad_alloc
[[nodiscard]] std::size_t deflate_strip(Effort effort, std::span<const std::uint8_t> bytes,
                                        bool last, std::uint8_t* out);

}  // namespace relit
