// The name of a picture: what its ETag is. For routes that render, and for dry runs of them.
#pragma once

#include <string>
#include <string_view>

namespace relit::server {

/// A strong validator (RFC 9110, 8.8.1): a hash of everything that determines the picture's bytes,
/// in quotes.
/// @param scene_text  the scene in its one form, as scene_json() writes it, images named by id
[[nodiscard]] std::string picture_etag(std::string_view scene_text);

}  // namespace relit::server
