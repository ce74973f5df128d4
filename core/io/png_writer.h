// A PNG file from a picture: the container by hand, the compression by libdeflate.
//
// Written here over OpenImageIO's writer because that one adds chunks of its own (oFFs, a tEXt with
// its colour space, gAMA and cHRM beside sRGB), puts UTF-8 into Latin-1 text, and takes about twice
// the time for the same bytes; over libpng because what is left of it beside the compression is
// fewer lines than its error handling by longjmp. zlib and libdeflate give the same bytes on every
// processor; ISA-L, faster still, does not.
#pragma once

#include <string>

#include "core/io/encode.h"

namespace relit {

/// Chunks: IHDR, sRGB if `options.srgb` (and nothing else about colour), one tEXt per ASCII or
/// Latin-1 text and one iTXt per other text, one IDAT, IEND.
///
/// @param options  `text` holds UTF-8; keywords and texts without zero bytes (asserted)
/// @throws std::runtime_error when the picture does not fit into a chunk (2 GB)
[[nodiscard]] std::string encode_png(const Image& picture, const EncodeOptions& options);

}  // namespace relit
