// A picture that is made while it is taken, some rows at a time: so that nobody holds all of a large one
// as floats. Between render() and encode().
#pragma once

#include <functional>

#include "core/base/parallel.h"
#include "core/image/image.h"

namespace relit {

struct PictureRows {
    int width = 0;
    int height = 0;
    int channels = 1;
    /// Those rows as an image of their own. To be asked for from the top down, each row once.
    std::function<Image(RowRange)> rows;
};

}  // namespace relit
