// The parameters of a request's URL, and headers that are tokens. Nothing is silently ignored:
// neither is a parameter.
#pragma once

#include <initializer_list>
#include <string>
#include <string_view>

#include "server/http/message.h"

namespace relit::server {

/// @throws Error unknown_field for a parameter of another name, duplicate_field for one that is
///         there twice
void allow_parameters(const Request& request, std::initializer_list<std::string_view> names);

/// How many entries a page of a list is to have: the parameter `limit`, or 100.
/// @throws Error invalid_value
[[nodiscard]] std::size_t page_size(const Request& request);

/// A header that is a name of the client's own making; empty: it is not there.
/// @throws Error malformed_request unless it has 1 to 128 visible ASCII characters
[[nodiscard]] std::string token_header(const Request& request, std::string_view name);

}  // namespace relit::server
