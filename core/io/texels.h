// Texels as a file stores them -> floats of an Image: which channel becomes which, what a number is
// worth, which texels hold no data. Knows no reader and no file.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "core/io/decode.h"

namespace relit {

/// Which stored channel becomes which: 1 grey, 2 grey + alpha, 3 RGB, 4 RGB + alpha.
struct ChannelMap {
    int count = 0;              // of the result
    std::array<int, 4> from{};  // stored channel, or -1: zero
    bool has_alpha = false;     // the last one

    void push(int stored) { from[std::size_t(count++)] = stored; }
};

/// OpenEXR knows channels by name only. R, G and B go where they belong, others in the order of
/// their names; a missing colour is 0, as viewers show it.
/// @throws Error image_not_supported (more than three besides alpha)
[[nodiscard]] ChannelMap map_named_channels(const std::vector<std::string>& names,
                                            FileFormat format);

/// The other formats know channels by place. TIFF may have further ones of unknown meaning, which a
/// reader is to skip (TIFF 6.0, ExtraSamples).
///
/// @param alpha  its stored channel, or -1
[[nodiscard]] ChannelMap map_ordered_channels(int channels, int alpha);

/// What happens to every stored texel on its way into the image.
struct Conversion {
    int stored_channels = 0;
    ChannelMap map;
    bool invert = false;            // the largest number is black
    std::optional<double> no_data;  // as written in the file
};

/// Converts `texels` texels of `conversion.stored_channels` numbers of `type` each; `out` takes
/// `conversion.map.count` floats for each. The meaning of the numbers is that of
/// DecodedImage::image.
void convert_texels(const std::byte* stored, SampleType type, std::size_t texels,
                    const Conversion& conversion, float* out);

}  // namespace relit
