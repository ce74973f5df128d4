// What picture of a scene is wanted: which layer, which part, what size, how it leaves linear
// light. For render(). Source: integrated model, sections 7 and 9; api.md, `output`.
#pragma once

#include <optional>

#include "core/base/rect.h"
#include "core/image/colour.h"

namespace relit {

enum class Layer {
    beauty,        ///< the lit picture
    illumination,  ///< d of the first light; an environment's weighted mean
    thickness,     ///< r of the first light in scene units
    normal,        ///< 0.5 n + 0.5
    specular,      ///< s of the first light; an environment's weighted mean
    scatter,       ///< f of the first light; an environment's weighted mean
    irradiance,    ///< E / pi of all lights, RGB: what a matt white surface would show
    subsurface,    ///< what scattering below the surface sends to the viewer, RGB, before textures
    highlight,     ///< k_h H of all lights, RGB
    height,        ///< h
    alpha,         ///< the mask
};

enum class Accuracy {
    final,    ///< always the same numbers for the same scene
    preview,  ///< may be coarser where that is faster
};

enum class Tone {
    clip,    ///< numbers stay as they are and integer formats clip them at 1
    filmic,  ///< Narkowicz 2016, "ACES filmic tone mapping curve": toe, shoulder, 1 at infinity
};

struct Output {
    Layer layer = Layer::beauty;
    Accuracy accuracy = Accuracy::final;
    std::optional<int> width;  ///< pixels; one of width and height alone keeps the aspect
    std::optional<int> height;
    std::optional<Rect> region;  ///< texels of the map; none: all of it
    double exposure = 0;         ///< stops
    Tone tone = Tone::clip;
    Transfer transfer = Transfer::srgb;
    std::optional<Colour> background;  ///< put under the picture, which then has no alpha
    /// The picture goes into a float file: linear, uncut, colour associated with alpha.
    bool linear = false;
};

struct PictureSize {
    int width = 0;
    int height = 0;
};

/// Size of the picture of a width x height map. Sizes round to the nearest pixel, at least 1.
[[nodiscard]] PictureSize picture_size(const Output& output, int map_width, int map_height);

/// Layers of one number per texel: pictures of one channel without alpha.
[[nodiscard]] constexpr bool is_scalar(Layer layer) {
    switch (layer) {
        case Layer::beauty:
        case Layer::normal:
        case Layer::irradiance:
        case Layer::subsurface:
        case Layer::highlight:
            return false;
        default:
            return true;
    }
}

}  // namespace relit
