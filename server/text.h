// Characters as HTTP and JSON count them: ASCII alone, whatever the locale.
#pragma once

#include <charconv>
#include <optional>
#include <string_view>
#include <system_error>

namespace relit::server {

constexpr char lower(char c) { return c >= 'A' && c <= 'Z' ? char(c - 'A' + 'a') : c; }

/// 0 to 15; -1 for what is no hex digit.
constexpr int hex_digit(char c) {
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    if (c >= 'A' && c <= 'F') return c - 'A' + 10;
    return -1;
}

/// Without the spaces and tabs around it.
constexpr std::string_view trimmed(std::string_view text) {
    const auto begin = text.find_first_not_of(" \t");
    if (begin == std::string_view::npos) return {};
    return text.substr(begin, text.find_last_not_of(" \t") - begin + 1);
}

inline constexpr std::string_view digits = "0123456789";
inline constexpr std::string_view lower_letters = "abcdefghijklmnopqrstuvwxyz";
inline constexpr std::string_view upper_letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZ";

/// Whether each character of `text` is in one of the sets.
template <typename... Sets>
constexpr bool consists_of(std::string_view text, const Sets&... sets) {
    for (const char c : text)
        if (((std::string_view(sets).find(c) == std::string_view::npos) && ...)) return false;
    return true;
}

/// The number that the whole text is, in decimal; nothing where it is none or does not fit.
template <typename Number>
std::optional<Number> parse_number(std::string_view text) {
    Number number = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return number;
}

}  // namespace relit::server
