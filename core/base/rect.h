// Texels and rectangles of them.
#pragma once

namespace relit {

/// Column and row, row 0 at the top.
struct TexelIndex {
    int i = 0;
    int j = 0;
};

/// Texels x <= i < x + width, y <= j < y + height; row 0 at the top.
struct Rect {
    int x = 0;
    int y = 0;
    int width = 0;
    int height = 0;

    friend constexpr bool operator==(const Rect&, const Rect&) = default;
};

}  // namespace relit
