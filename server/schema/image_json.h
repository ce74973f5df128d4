// What the API says of a stored image.
#pragma once

#include <string>

#include "server/storage/image_store.h"

namespace relit::server {

/// {"id", "width", "height", "channels", "type", "format", "bytes"}
[[nodiscard]] std::string image_json(const StoredImage& image);

}  // namespace relit::server
