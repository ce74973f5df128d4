// How large a picture of a format may be, told to whoever asked for a larger one.
#pragma once

#include <string>

#include "core/base/error.h"
#include "core/io/encode.h"

namespace relit {

/// @param format_name  "WebP"
/// @throws Error invalid_value when a side is longer than max_side_of(format)
inline void check_side(int width, int height, PictureFormat format,
                       const std::string& format_name) {
    const int limit = max_side_of(format);
    if (width > limit || height > limit)
        throw Error(error_code::invalid_value,
                    "a " + format_name + " picture has at most " + std::to_string(limit) +
                        " pixels a side; this one is " + std::to_string(width) + " x " +
                        std::to_string(height));
}

}  // namespace relit
