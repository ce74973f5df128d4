// Rows of a picture as PNG files hold them: numbers quantised, big-endian, and filtered (W3C PNG,
// 9.2), straight from the floats. For png_writer.cpp.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "core/base/parallel.h"
#include "core/image/image.h"

namespace relit {

enum class PngFilter : std::uint8_t { up = 2, average = 3 };

/// Bytes of one row, its filter's number among them.
[[nodiscard]] std::size_t png_row_bytes(int width, int channels, int bit_depth);

/// Writes the rows `rows` of `picture`, each after its filter's number.
///
/// @param above      the row above row 0 of `picture`; empty: that is the first of all
/// @param bit_depth  8 or 16
/// @param out        room for png_row_bytes() for each of the rows
void filter_rows(const Image& picture, std::span<const float> above, int bit_depth,
                 PngFilter filter, RowRange rows, std::uint8_t* out);

}  // namespace relit
