// The parameters of a request's URL, and headers that are tokens. Nothing is silently ignored:
// neither is a parameter.
#pragma once

#include <charconv>
#include <initializer_list>
#include <optional>
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

/// All of the text, in decimal.
template <typename Number>
std::optional<Number> parse_number(std::string_view text) {
    Number number = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return number;
}

}  // namespace relit::server
