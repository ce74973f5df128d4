// What the API says of the samples that ship.
#pragma once

#include <string>

namespace relit::server {

/// {"samples": [{"id", "name", "title", "kind", "width", "height", "format", "credit", "licence",
/// "source", "scene"}]}
[[nodiscard]] std::string samples_json();

}  // namespace relit::server
