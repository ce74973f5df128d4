// A PNG file from a picture: the container by hand, the compression by ISA-L (fast) or libdeflate
// (small).
//
// Written here over OpenImageIO's writer because that one adds chunks of its own (oFFs, a tEXt with
// its colour space, gAMA and cHRM beside sRGB), puts UTF-8 into Latin-1 text, and takes many times
// the time; over libpng because what is left of it beside the compression is fewer lines than its
// error handling by longjmp.
#pragma once

#include <string>

#include "core/io/encode.h"

namespace relit {

/// Chunks: IHDR, sRGB if `options.srgb` (and nothing else about colour), one tEXt per ASCII or
/// Latin-1 text and one iTXt per other text, IDATs, IEND.
///
/// @param options  `text` holds UTF-8; keywords and texts without zero bytes (asserted)
/// @throws Error cancelled
[[nodiscard]] std::string encode_png(const Image& picture, const EncodeOptions& options,
                                     const EncodeControl& control);

}  // namespace relit
