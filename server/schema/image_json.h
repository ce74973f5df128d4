// What the API says of stored images.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "server/storage/image_store.h"

namespace relit::server {

/// {"id", "width", "height", "channels", "type", "format", "bytes", "created"}; the last one is
/// RFC 3339 in UTC, with milliseconds, or null for a built-in image.
[[nodiscard]] std::string image_json(const StoredImage& image);

/// {"images", "next"}: each as above; null where there is no next page.
[[nodiscard]] std::string image_list_json(const std::vector<StoredImage>& images,
                                          const std::optional<std::string>& next);

}  // namespace relit::server
