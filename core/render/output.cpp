#include "core/render/output.h"

#include <algorithm>
#include <cmath>

namespace relit {

PictureSize picture_size(const Output& output, int map_width, int map_height) {
    const double w = output.region ? output.region->width : map_width;
    const double h = output.region ? output.region->height : map_height;
    const auto scaled = [](double size, double scale) {
        return std::max(1, int(std::lround(size * scale)));
    };
    if (output.width && output.height) return {*output.width, *output.height};
    if (output.width) return {*output.width, scaled(h, *output.width / w)};
    if (output.height) return {scaled(w, *output.height / h), *output.height};
    return {int(w), int(h)};
}

}  // namespace relit
