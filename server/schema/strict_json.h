// JSON text -> a tree, refusing what RFC 8259 leaves open: keys twice, numbers beyond double,
// endless nesting. Included by schema/ alone, as everything that names the JSON library.
#pragma once

#include <nlohmann/json.hpp>
#include <string_view>

#include "server/limits.h"

namespace relit::server {

using Json = nlohmann::json;

/// @throws Error malformed_json (with the byte where reading stopped, or over a limit),
///         duplicate_field, invalid_value (a number too large); `pointer` names the place
[[nodiscard]] Json parse_json(std::string_view text, const JsonLimits& limits = {});

/// A key as a token of an RFC 6901 pointer.
[[nodiscard]] std::string pointer_token(std::string_view key);

}  // namespace relit::server
