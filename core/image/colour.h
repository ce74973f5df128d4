// Colour numbers: linear RGB for shading, the sRGB transfer function at the edges, luminance.
// For decode of colour images, JSON colours and the last step before an integer format (IEC
// 61966-2-1).
#pragma once

#include <array>

#include "core/image/image.h"

namespace relit {

/// Three colour numbers, Rec. 709 primaries; linear unless said otherwise.
///
/// In double: products of a scene's colours and intensities outgrow float within their ranges.
struct Rgb {
    double r = 0;
    double g = 0;
    double b = 0;

    friend constexpr bool operator==(const Rgb&, const Rgb&) = default;
};

constexpr Rgb operator+(Rgb a, Rgb b) { return {a.r + b.r, a.g + b.g, a.b + b.b}; }
constexpr Rgb operator*(double s, Rgb a) { return {s * a.r, s * a.g, s * a.b}; }
constexpr Rgb operator*(Rgb a, Rgb b) { return {a.r * b.r, a.g * b.g, a.b * b.b}; }

/// Relative luminance of linear Rec. 709 colour, 0.2126 r + 0.7152 g + 0.0722 b (ITU-R BT.709), so
/// summed that a grey has exactly its own number.
constexpr double luminance(Rgb c) { return c.r + 0.7152 * (c.g - c.r) + 0.0722 * (c.b - c.r); }

/// sRGB-encoded number in [0, 1] -> linear (IEC 61966-2-1).
[[nodiscard]] float srgb_to_linear(float encoded);

/// Linear number -> sRGB-encoded. Numbers outside [0, 1] are clipped, NaN gives 0. Within 1e-6 of
/// the formula.
[[nodiscard]] float linear_to_srgb(float linear);

/// The first three of every `channels` numbers, sRGB-encoded in place. @pre 3 or 4 channels
void encode_srgb(std::span<float> texels, int channels);

/// What the numbers of a picture mean between file and shading (integrated model, section 7).
enum class Transfer {
    srgb,  ///< shading is in linear light; integer files and `#rrggbb` are sRGB-encoded
    none,  ///< every number is used and written as it is
};

/// A colour as a scene gives it: `#rrggbb` or three linear numbers.
struct Colour {
    std::array<double, 3> values{0, 0, 0};  ///< `#rrggbb`: the bytes / 255; else as given, >= 0
    bool hex = false;                       ///< given as `#rrggbb`

    friend bool operator==(const Colour&, const Colour&) = default;
};

constexpr Colour hex_colour(int r, int g, int b) {
    return {{r / 255.0, g / 255.0, b / 255.0}, true};
}

/// The numbers to shade with: a hex colour is decoded from sRGB unless `transfer` is none.
[[nodiscard]] Rgb shading_colour(const Colour& colour, Transfer transfer);

/// Decodes the colour channels of a 3-channel image from sRGB, in place.
void decode_srgb(Image& image);

}  // namespace relit
