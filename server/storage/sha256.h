// SHA-256 as the name of bytes: image ids, strong ETags; and as the proof that somebody has a key.
#pragma once

#include <string>
#include <string_view>

namespace relit::server {

/// 64 lower-case hex digits.
[[nodiscard]] std::string sha256_hex(std::string_view bytes);

/// A strong validator of what is made of these bytes alone (RFC 9110, 8.8.1): half of their hash, in
/// quotes.
[[nodiscard]] std::string strong_etag(std::string_view bytes);

/// HMAC-SHA-256 (RFC 2104), 64 lower-case hex digits.
[[nodiscard]] std::string hmac_sha256_hex(std::string_view key, std::string_view text);

/// Whether both are the same, in a time that tells nothing of where they differ, only of their
/// lengths.
[[nodiscard]] bool equal_secrets(std::string_view a, std::string_view b);

}  // namespace relit::server
