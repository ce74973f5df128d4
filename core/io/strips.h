// How encoders divide a picture into strips that are compressed by themselves: by its size alone,
// so that the bytes of the file are the same for any number of threads.
#pragma once

#include <algorithm>
#include <cstddef>

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

}  // namespace relit
