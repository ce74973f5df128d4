// Rectangles of texels.
#pragma once

namespace relit {

/// Texels x <= i < x + width, y <= j < y + height; row 0 at the top.
struct Rect {
    int x = 0;
    int y = 0;
    int width = 0;
    int height = 0;

    friend constexpr bool operator==(const Rect&, const Rect&) = default;
};

}  // namespace relit
