// How encoders divide a picture into strips that are compressed by themselves: by its size alone,
// so that the bytes of the file are the same for any number of threads.
#pragma once

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <vector>

#include "core/image/picture_rows.h"
#include "core/io/encode.h"

namespace relit {

/// About how many bytes of quantised numbers a fast strip has: with its floats it fits into a
/// core's second cache, and a picture of 512 x 512 still makes four.
inline constexpr std::size_t strip_bytes = std::size_t(1) << 18;

/// Rows of each strip but the last, which may be shorter: strips as equal as they can be with at
/// most `most` rows, and one at least.
[[nodiscard]] constexpr int strip_rows(int rows, std::size_t most) {
    const int largest = int(std::clamp<std::size_t>(most, 1, std::size_t(rows)));
    const int count = (rows - 1) / largest + 1;
    return (rows - 1) / count + 1;
}

/// Adds the strips of so many more rows: what `compress` makes of each strip's, counted from the first
/// of these. @throws Error cancelled; what `compress` throws
template <class Strip, class Compress>
void add_strips(std::vector<Strip>& strips, int rows, int rows_of_strip,
                const EncodeControl& control, const Compress& compress) {
    const std::size_t before = strips.size();
    const int count = (rows - 1) / rows_of_strip + 1;
    strips.resize(before + std::size_t(count));
    parallel_rows(control.executor, count, control.stop, [&](RowRange range) {
        for (int i = range.begin; i < range.end; ++i)
            strips[before + std::size_t(i)] =
                compress(RowRange{i * rows_of_strip, std::min((i + 1) * rows_of_strip, rows)});
    });
}

/// Rows of a picture to be taken at a time, some strips of them: so few that their floats stay in
/// memory that is used again for the next ones, and if possible whole squares of texels.
[[nodiscard]] inline int band_rows(const PictureRows& picture, int strip) {
    constexpr std::size_t band_bytes = std::size_t(24) << 20;
    constexpr int square_side = 16;  // that a map is shaded in
    const std::size_t row_bytes =
        std::size_t(picture.width) * std::size_t(picture.channels) * sizeof(float);
    const int most =
        int(std::min<std::size_t>(band_bytes / row_bytes, std::size_t(picture.height)));
    const int whole = std::lcm(strip, square_side);
    return whole <= most ? most / whole * whole : std::max(1, most / strip) * strip;
}

}  // namespace relit
