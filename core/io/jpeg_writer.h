// A JPEG file from a picture: strips compressed side by side by TurboJPEG, joined by restart
// markers. For encode().
//
// Over OpenImageIO, which writes with the same library: that one takes whole pictures of finished
// bytes on one thread. Decoded numbers are the same for both.
#pragma once

#include <string>

#include "core/io/encode.h"

namespace relit {

/// Baseline, all components in full resolution.
/// @pre 1 or 3 channels, at most 65500 pixels a side (asserted)
/// @throws Error cancelled; std::runtime_error when the encoder fails
[[nodiscard]] std::string encode_jpeg(const Image& picture, const EncodeOptions& options,
                                      const EncodeControl& control);

}  // namespace relit
