// Bytes of an image file -> floats, for whatever a client uploads: height maps, masks, albedo,
// environments. Hostile input is the normal case: formats by magic bytes from an allow-list, every
// limit checked before the memory it limits is asked for. OpenImageIO does the reading and is
// included in this folder alone.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string_view>

#include "core/image/image.h"

namespace relit {

enum class FileFormat { png, jpeg, webp, tiff, exr, hdr };

/// How the file stores a number. Names as in the API: "uint8", ... "float64".
enum class SampleType { uint8, uint16, uint32, int8, int16, int32, float16, float32, float64 };

/// What is known of an image file without its texels.
struct ImageInfo {
    FileFormat format = FileFormat::png;
    SampleType type = SampleType::uint8;
    int width = 0;
    int height = 0;
    int channels = 0;         ///< 1 grey, 2 grey + alpha, 3 RGB, 4 RGB + alpha
    bool has_alpha = false;   ///< the last channel is alpha
    bool associated = false;  ///< the file's colour is multiplied by its alpha (OpenEXR, some TIFF)

    /// Of the decoded image: width * height * channels.
    [[nodiscard]] std::size_t value_count() const {
        return std::size_t(width) * std::size_t(height) * std::size_t(channels);
    }
};

struct DecodedImage {
    ImageInfo info;
    /// `info.channels` channels. Unsigned integers are divided by their type's maximum; signed
    /// integers and floats are the stored numbers, also where they are associated with alpha. Texels that equal the
    /// file's no-data value (GDAL_NODATA in TIFF) in all their colours are NaN in every channel.
    Image image;
};

/// Caps on what a file may claim or hold; each is named in the error it causes.
struct DecodeLimits {
    std::int64_t max_pixels = 64LL << 20;  ///< width * height
    /// ... for files whose decoder holds them whole: interlaced PNG, progressive JPEG, WebP.
    std::int64_t max_interlaced_pixels = 32LL << 20;
    std::int64_t max_values = 192LL << 20;     ///< width * height * channels: 768 MB as floats
    int max_side = 32768;                      ///< width, height
    int max_channels = 4;                      ///< as stored
    std::int64_t max_tile_bytes = 64LL << 20;  ///< of a tiled file's tile, uncompressed
};

/// The format that the first bytes announce.
/// @throws Error image_not_supported (none of the allow-list)
[[nodiscard]] FileFormat sniff_format(std::string_view bytes);

/// Reads a whole image: the first picture of a multi-image file, the data window of an OpenEXR.
///
/// Orientation tags and colour profiles are not applied. OpenEXR channels are taken by name: R, G,
/// B, A; others in the order of their names, two or three of them as R, G, B with 0 for what is
/// missing. Bands of a TIFF beyond grey or RGB that are not alpha are skipped. Where colour is
/// stored multiplied by alpha (OpenEXR, some TIFF) it is divided by it, except where alpha is 0.
/// Deterministic; safe from any thread. Memory grows as texels arrive; its peak is the result, a
/// third of it more for files that are held whole: under 1 GB with the default limits.
/// @throws Error image_not_supported, image_too_large (names the limit), image_broken
[[nodiscard]] DecodedImage decode(std::string_view bytes, const DecodeLimits& limits = {});

/// Memory for the first `values` numbers of an image: where its first one is. Asked for again as
/// texels arrive, with more values up to width * height * channels; what was written stays.
using TexelRoom = std::function<float*(const ImageInfo& info, std::size_t values)>;

/// The same into memory of the caller's: the result as of decode() is in what `room` gave last.
/// @throws Error as decode(); what `room` throws, as image_broken or (std::bad_alloc) image_too_large
ImageInfo decode_into(std::string_view bytes, const DecodeLimits& limits, const TexelRoom& room);

/// Loads and sets up the readers of all formats ahead of time; decode() does so by itself where it
/// has not been called. For a process that is going to fork, or to give up opening files.
void prepare_decoders();

[[nodiscard]] std::string_view name_of(FileFormat format);        ///< "png", "jpeg", ...
[[nodiscard]] std::string_view name_of(SampleType type);          ///< "uint8", ...
[[nodiscard]] std::string_view media_type_of(FileFormat format);  ///< "image/png", ...

}  // namespace relit
