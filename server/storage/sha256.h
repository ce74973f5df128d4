// SHA-256 as the name of bytes: image ids, strong ETags.
#pragma once

#include <string>
#include <string_view>

namespace relit::server {

/// 64 lower-case hex digits.
[[nodiscard]] std::string sha256_hex(std::string_view bytes);

}  // namespace relit::server
