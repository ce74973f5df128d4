// What an image file claims, read by bounded parsers of our own before any decoder sees the file:
// several decoders allocate for the claimed size when they open a file, so limits have to be held
// against the claim first. For decode.cpp alone; the formats' specifications are named in the .cpp
// files.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <limits>
#include <optional>
#include <string>
#include <string_view>

#include "core/io/decode.h"

namespace relit {

struct FileHeader {
    std::int64_t width = 0;
    std::int64_t height = 0;
    std::int64_t channels = 0;     ///< as stored, palettes expanded
    std::int64_t tile_bytes = 0;   ///< one tile as its decoder holds it; 0 for files without tiles
    std::int64_t least_bytes = 0;  ///< a file with fewer bytes cannot hold the whole picture
    bool held_whole = false;    ///< the decoder needs the whole picture at once besides the result
    bool min_is_white = false;  ///< TIFF: the largest number is black
    std::optional<double> no_data;  ///< TIFF: GDAL_NODATA, as the reader hands out its texels
    /// The file without the parts that do not matter to the texels (colour profiles, Exif, XMP,
    /// comments, thumbnails), whose parsers are the part of a decoder with the longest list of
    /// bugs. Empty: use the file.
    std::string stripped;
};

/// Parses as much of `bytes` as it takes; sizes may be anything, zero included: limits are the
/// caller's.
/// @throws Error image_broken, image_not_supported (a variant that decode does not read)
[[nodiscard]] FileHeader read_header(std::string_view bytes, FileFormat format);

[[nodiscard]] FileHeader read_png_header(std::string_view bytes);
[[nodiscard]] FileHeader read_jpeg_header(std::string_view bytes);
[[nodiscard]] FileHeader read_webp_header(std::string_view bytes);
[[nodiscard]] FileHeader read_tiff_header(std::string_view bytes);
[[nodiscard]] FileHeader read_exr_header(std::string_view bytes);
[[nodiscard]] FileHeader read_hdr_header(std::string_view bytes);

/// The product of numbers that are not negative, or the largest number if it is larger: claims may
/// be anything.
[[nodiscard]] inline std::int64_t capped_product(std::initializer_list<std::int64_t> factors) {
    std::int64_t product = 1;
    for (const std::int64_t factor : factors)
        product = factor != 0 && product > std::numeric_limits<std::int64_t>::max() / factor
                      ? std::numeric_limits<std::int64_t>::max()
                      : product * factor;
    return product;
}

/// Deflate's shortest code for its longest match: 2 bits for 258 bytes.
inline constexpr std::int64_t deflate_expansion = 1032;

/// The client's sentence for a file whose bytes make no sense: "the PNG file is broken: " + `why`.
[[noreturn]] void throw_broken(FileFormat format, const std::string& why);

/// ... and for a sound file of a kind that decode does not read.
[[noreturn]] void throw_unsupported(FileFormat format, const std::string& what);

}  // namespace relit
