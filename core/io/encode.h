// Finished pictures -> bytes of a file: PNG (8/16), JPEG, WebP, OpenEXR (half/float). The last step
// of a render; same picture and options, same bytes, whatever the machine's load or number of
// threads.
#pragma once

#include <stop_token>
#include <string>
#include <vector>

#include "core/base/parallel.h"
#include "core/image/image.h"
#include "core/image/picture_rows.h"

namespace relit {

enum class PictureFormat { png, jpeg, webp, exr };
enum class Effort { fast, small };  ///< what the encoder spends its time on

struct TextEntry {
    std::string keyword;  ///< 1 to 79 Latin-1 characters
    std::string text;     ///< UTF-8 without zero bytes
};

struct EncodeOptions {
    PictureFormat format = PictureFormat::png;
    int bit_depth = 8;  ///< one of bit_depths_of(format); of exr, 16 is half and 32 float
    int quality = 85;   ///< 1..100, jpeg and webp
    Effort effort = Effort::fast;
    /// The numbers are sRGB-encoded colour: marked so where the format can (not exr).
    bool srgb = true;
    /// png: tEXt chunks (iTXt for text beyond Latin-1); exr: string attributes; others: not
    /// written.
    std::vector<TextEntry> text = {};
};

/// How encoding runs; nothing in it changes the bytes.
struct EncodeControl {
    const Executor& executor;
    std::stop_token stop{};
};

/// Writes `picture` as a file.
///
/// @param picture  1 channel (grey), 2 (grey + alpha), 3 (RGB) or 4 (RGBA) channels, at least 1 x
///                 1. Integer formats take numbers in [0, 1] (others are clipped, NaN is 0) and
///                 unassociated alpha, and round to the nearest step; exr takes linear numbers as
///                 they are, colour associated with alpha. jpeg has no alpha (asserted); webp has
///                 no grey: it is written as three equal channels.
/// @throws Error   cancelled; invalid_value when the picture exceeds what the format can hold (jpeg
///                 65500, webp 16383 pixels a side)
/// @throws std::runtime_error when the encoder fails (out of memory)
/// Deterministic; safe from any thread. The executor compresses png and jpeg in strips; webp and
/// exr are compressed by the caller's thread, exr without looking at the stop token.
[[nodiscard]] std::string encode(const Image& picture, const EncodeOptions& options,
                                 const EncodeControl& control);

/// The same file of a picture that is made while it is written: of png and jpeg some 24 MB of floats
/// are taken at a time, of the others all at once.
/// @throws what encode() and `picture` throw
[[nodiscard]] std::string encode(const PictureRows& picture, const EncodeOptions& options,
                                 const EncodeControl& control);

/// The longest side in pixels that a file of the format can hold.
[[nodiscard]] int max_side_of(PictureFormat format);

/// Bits per number that its files can have.
[[nodiscard]] std::vector<int> bit_depths_of(PictureFormat format);

[[nodiscard]] std::string media_type_of(PictureFormat format);  ///< "image/png", ..., "image/x-exr"

}  // namespace relit
