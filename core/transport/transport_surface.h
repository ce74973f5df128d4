// A height map as what light is carried over. For transport.h and its parts.
#pragma once

#include "core/image/image.h"

namespace relit {

/// A sample a texel. Scene units: 1 = the map's width.
struct TransportSurface {
    Image z;     ///< 1 channel: heights of the texels' centres
    Image area;  ///< 1 channel, >= 0: true area of the surface over each texel; 0 = nothing is there

    [[nodiscard]] int width() const { return z.width; }
    [[nodiscard]] int height() const { return z.height; }
    /// From texel to texel; also what the kernel's cells are to be.
    [[nodiscard]] double spacing() const { return 1.0 / z.width; }
    /// Between the lowest and the highest texel.
    [[nodiscard]] double relief() const;
    /// No two texels are farther apart.
    [[nodiscard]] double extent() const;
};

}  // namespace relit
