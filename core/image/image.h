// A picture or a map in memory: rows of interleaved float texels. Everything that is an image in
// Relit (height, alpha, albedo, environment, layer, finished picture) is this one plain struct.
#pragma once

#include <cassert>
#include <cstddef>
#include <span>

#include "core/image/large_pages.h"

namespace relit {

/// `height` rows of `width` texels of `channels` floats each, row 0 at the top, no padding.
///
/// What the numbers mean (linear light, sRGB-encoded, data) is said by whoever passes the image on.
struct Image {
    int width = 0;
    int height = 0;
    int channels = 1;
    Texels values;  ///< width * height * channels

    Image() = default;
    Image(int w, int h, int c, float fill = 0.0f)
        : width(w), height(h), channels(c), values(texels() * std::size_t(c), fill) {
        assert(w >= 0 && h >= 0 && c > 0);
    }

    [[nodiscard]] bool empty() const { return values.empty(); }
    [[nodiscard]] std::size_t texels() const { return std::size_t(width) * std::size_t(height); }

    /// The `width * channels` numbers of row `y`.
    [[nodiscard]] std::span<float> row(int y) {
        return {values.data() + offset(0, y), std::size_t(width) * channels};
    }
    [[nodiscard]] std::span<const float> row(int y) const {
        return {values.data() + offset(0, y), std::size_t(width) * channels};
    }

    [[nodiscard]] float& at(int x, int y, int c = 0) { return values[offset(x, y) + c]; }
    [[nodiscard]] float at(int x, int y, int c = 0) const { return values[offset(x, y) + c]; }

private:
    [[nodiscard]] std::size_t offset(int x, int y) const {
        return (std::size_t(y) * width + x) * std::size_t(channels);
    }
};

}  // namespace relit
