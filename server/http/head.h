// The head of an HTTP/1.1 request, read strictly: what is not exactly what RFC 9112 says is
// refused, so that no proxy in front and no parser behind can understand a request differently. For
// the transport.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "server/error_codes.h"
#include "server/http/message.h"
#include "server/limits.h"

namespace relit::server {

/// Request line and headers, checked.
struct Head {
    std::string method;  ///< as sent: HEAD is HEAD here
    std::string path;    ///< percent-decoded UTF-8 without control characters; "*" of `OPTIONS *`
    std::string target;  ///< path and query as sent
    std::multimap<std::string, std::string> query;  ///< decoded, `+` is a space
    Headers headers;                                ///< repeated ones joined by ", "
    std::optional<std::uint64_t> content_length;
    bool chunked = false;
    bool is_1_1 = true;  ///< else HTTP/1.0
    bool keep_alive = true;
    bool expects_continue = false;

    [[nodiscard]] bool has_body() const { return chunked || content_length.value_or(0) > 0; }
    [[nodiscard]] bool has_length() const { return chunked || content_length.has_value(); }
    [[nodiscard]] bool may_have_body() const;  ///< does the method take one?
};

/// Where in `buffer` the head ends.
struct HeadEnd {
    enum { incomplete, complete, malformed } state = incomplete;
    std::size_t size = 0;  ///< of the head with its empty line, when complete
};

/// Looks for the empty line that ends a head, from `from` on (what lies before was looked at
/// already). A line feed alone and control characters are malformed at once: their sender would
/// wait for long.
[[nodiscard]] HeadEnd find_head_end(std::string_view buffer, std::size_t from = 0);

/// The parsed head.
///
/// @param text  all lines, the empty one included, as found by find_head_end
/// @throws Error malformed_request (grammar, framing, undecodable target, no Host), uri_too_long,
///         headers_too_large, version_not_supported, unsupported_media_type (Content-Encoding),
///         each of them a reason to close the connection
[[nodiscard]] Head parse_head(std::string_view text, const Limits& limits);

/// Why a head that has outgrown its limit is refused: its target, or else its headers.
[[nodiscard]] Error head_too_large(std::string_view begun, const Limits& limits);

/// `text` with %XX decoded; nothing where a percent sign is not followed by two hex digits.
[[nodiscard]] std::optional<std::string> percent_decoded(std::string_view text,
                                                         bool plus_is_space = false);

}  // namespace relit::server
