// SHA-256 as the name of bytes: image ids, strong ETags.
#pragma once

#include <string>
#include <string_view>

namespace relit::server {

/// 64 lower-case hex digits.
[[nodiscard]] std::string sha256_hex(std::string_view bytes);

/// A strong validator of what is made of these bytes alone (RFC 9110, 8.8.1): half of their hash, in
/// quotes.
[[nodiscard]] std::string strong_etag(std::string_view bytes);

}  // namespace relit::server
