// The parts of a multipart/form-data body (RFC 7578), read from the whole body in one linear pass.
// For forms in browsers and `curl -F`; nothing nested, no transfer encodings, as RFC 7578 has it.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "server/http/message.h"
#include "server/limits.h"

namespace relit::server {

[[nodiscard]] bool is_multipart(std::string_view content_type);

/// The parts in their order.
///
/// @param body          whole; its memory becomes that of the largest part, so that a big upload is
///                      held once
/// @param content_type  of the request, with the boundary
/// @param limits        max_parts and max_part_head_bytes are kept to
/// @throws Error malformed_request (names what is missing), body_too_large (too many parts,
///         or one with too large a head)
[[nodiscard]] std::vector<Part> parse_multipart(std::string body, std::string_view content_type,
                                                const Limits& limits);

}  // namespace relit::server
