// A height map as the renderer takes it: heights in [0, 1], a mask, an albedo, all of one size. For
// everything that loads maps; from the numbers of decoded files. Source: integrated model, sections
// 1, 5 and 7; api.md, "A scene".
#pragma once

#include <optional>
#include <string>

#include "core/base/parallel.h"
#include "core/image/image.h"

namespace relit {

/// Stored numbers that became heights 0 and 1.
struct HeightRange {
    double min = 0;
    double max = 1;
};

/// Plain data; images of one size, or empty.
struct HeightField {
    Image heights;  ///< 1 channel in [0, 1], 1 = nearest to the viewer; 0 where the file's number is not finite
    Image alpha;   ///< 1 channel in [0, 1]; empty = 1 everywhere
    Image albedo;  ///< 3 channels >= 0, numbers to shade with; empty = 1 everywhere
    Image bump;    ///< 1 channel, detail that normals alone show, as heights; empty = none
    std::vector<bool> no_height;  ///< texels whose number in the file is not finite; empty = none
    /// Name all of this, and what is not colour of it, for a SharedCache, where what is made of them
    /// may be kept; empty: it is not.
    std::string key, shape_key;
    std::optional<HeightRange> rescaled_from;  ///< set when the file's numbers did not lie in [0, 1]

    [[nodiscard]] int width() const { return heights.width; }
    [[nodiscard]] int height() const { return heights.height; }
    /// Whether texel (i, j) is material: alpha >= 0.5.
    [[nodiscard]] bool is_solid(int i, int j) const {
        return alpha.empty() || alpha.at(i, j) >= 0.5f;
    }
};

/// Heights (and alpha, where the image has it) from the numbers of a decoded file.
///
/// Colour counts by its luminance. Numbers that are not already fractions are rescaled from their
/// finite minimum and maximum unless they lie in [0, 1]; a flat map becomes 0. Texels that are not
/// finite get height 0 and alpha 0.
///
/// @param stored     1 to 4 channels
/// @param has_alpha  the last channel is alpha, taken as in [0, 1] (clipped)
/// @param fractions  the file held unsigned integers, already divided by their type's maximum
/// @throws Error image_broken when no texel is finite
[[nodiscard]] HeightField height_field_from(Image stored, bool has_alpha, bool fractions);

/// Gives `field` a mask: the image's own alpha channel if it has one, else its luminance, clipped
/// to [0, 1] and resampled to the field's size. Replaces an alpha that came with the heights;
/// texels without a finite height stay masked.
void set_alpha(HeightField& field, Image stored, bool has_alpha, const Executor& executor);

/// Gives `field` an albedo, resampled to its size in linear light.
/// @param encoded  the numbers are sRGB-encoded and shading is in linear light
void set_albedo(HeightField& field, const Image& stored, bool has_alpha, bool encoded,
                const Executor& executor);

/// Gives `field` a bump map: heights as height_field_from() makes them, resampled to the field's size.
/// @throws Error image_broken when no texel is finite
void set_bump(HeightField& field, Image stored, bool has_alpha, bool fractions,
              const Executor& executor);

/// The whole field averaged down, for previews. Masked texels take part with their stored height,
/// as they do in interpolation. @pre 1 <= width <= field.width(), the same for height
[[nodiscard]] HeightField smaller_field(const HeightField& field, int width, int height,
                                        const Executor& executor, const std::stop_token& stop);

}  // namespace relit
