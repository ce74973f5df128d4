#include "core/io/png_rows.h"

#include <span>
#include <utility>
#include <vector>

#include "core/io/quantise.h"

namespace relit {
namespace {

using Bytes = std::span<const std::uint8_t>;

void big_endian_row(std::span<const float> values, int bit_depth, std::uint8_t* out) {
    if (bit_depth == 8) return quantise_row(values, out);
    for (std::size_t i = 0; i < values.size(); ++i) {
        const auto sample = quantised<std::uint16_t>(values[i]);
        out[2 * i] = std::uint8_t(sample >> 8);
        out[2 * i + 1] = std::uint8_t(sample & 0xff);
    }
}

void up_row(Bytes row, Bytes above, std::uint8_t* out) {
    for (std::size_t i = 0; i < row.size(); ++i) out[i] = std::uint8_t(row[i] - above[i]);
}

void average_row(Bytes row, Bytes above, std::size_t pixel_bytes, std::uint8_t* out) {
    for (std::size_t i = 0; i < pixel_bytes; ++i) out[i] = std::uint8_t(row[i] - above[i] / 2);
    for (std::size_t i = pixel_bytes; i < row.size(); ++i)
        out[i] = std::uint8_t(row[i] - (row[i - pixel_bytes] + above[i]) / 2);
}

}  // namespace

std::size_t png_row_bytes(int width, int channels, int bit_depth) {
    return 1 + std::size_t(width) * std::size_t(channels * bit_depth / 8);
}

void filter_rows(const Image& picture, std::span<const float> first_above, int bit_depth,
                 PngFilter filter, RowRange rows, std::uint8_t* out) {
    const std::size_t row_bytes = png_row_bytes(picture.width, picture.channels, bit_depth);
    std::vector<std::uint8_t> row(row_bytes - 1), above(row_bytes - 1);  // the first: below black
    if (rows.begin > 0) first_above = picture.row(rows.begin - 1);
    if (!first_above.empty()) big_endian_row(first_above, bit_depth, above.data());
    for (int y = rows.begin; y < rows.end; ++y, out += row_bytes) {
        big_endian_row(picture.row(y), bit_depth, row.data());
        out[0] = std::uint8_t(filter);
        if (filter == PngFilter::up) up_row(row, above, out + 1);
        else average_row(row, above, std::size_t(picture.channels * bit_depth / 8), out + 1);
        std::swap(row, above);
    }
}

}  // namespace relit
