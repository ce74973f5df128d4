// An image's facts as the few lines of text that the store keeps beside it.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "core/io/decode.h"

namespace relit::server {

[[nodiscard]] std::string image_info_text(const ImageInfo& info);

/// Nothing where the text is not exactly what image_info_text() writes.
[[nodiscard]] std::optional<ImageInfo> parse_image_info(std::string_view text);

}  // namespace relit::server
