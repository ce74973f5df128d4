// What this server can do and how much of it, for clients that ask before they try.
#pragma once

#include <string>
#include <string_view>

#include "server/limits.h"

namespace relit::server {

/// {"name", "version", "formats": {"read", "write"}, "layers", "presets", "limits"}; the limits are
/// named as the settings, in camelCase, times in seconds.
[[nodiscard]] std::string capabilities_json(std::string_view version, const Limits& limits);

}  // namespace relit::server
