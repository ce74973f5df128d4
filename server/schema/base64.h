// Base64 (RFC 4648), strict: no white space, nothing after the padding, no stray bits.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace relit::server {

/// Section 4: the usual alphabet, padded. None when `text` is not that.
[[nodiscard]] std::optional<std::string> decode_base64(std::string_view text);

/// Section 5: the alphabet for URLs, padding optional.
[[nodiscard]] std::optional<std::string> decode_base64url(std::string_view text);

}  // namespace relit::server
