#include "server/schema/base64.h"

#include <array>
#include <cstdint>

namespace relit::server {
namespace {

using Digits = std::array<std::int8_t, 256>;

constexpr Digits digits_of(std::string_view alphabet) {
    Digits digits{};
    digits.fill(-1);
    for (std::size_t i = 0; i < alphabet.size(); ++i)
        digits[std::uint8_t(alphabet[i])] = std::int8_t(i);
    return digits;
}

constexpr Digits plain_digits =
    digits_of("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/");
constexpr Digits url_digits =
    digits_of("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_");

// `text` without padding: 6 bits a digit, the bits that no byte takes must be 0.
std::optional<std::string> decode(std::string_view text, const Digits& digits) {
    if (text.size() % 4 == 1) return std::nullopt;
    std::string bytes;
    bytes.reserve(text.size() / 4 * 3 + 2);
    std::uint32_t bits = 0;
    int count = 0;
    for (const char c : text) {
        const int digit = digits[std::uint8_t(c)];
        if (digit < 0) return std::nullopt;
        bits = bits << 6 | std::uint32_t(digit);
        count += 6;
        if (count < 8) continue;
        count -= 8;
        bytes += char(bits >> count & 0xff);
        bits &= (1u << count) - 1;
    }
    return bits == 0 ? std::optional(std::move(bytes)) : std::nullopt;
}

std::string_view without_padding(std::string_view text) {
    for (int i = 0; i < 2 && text.ends_with('='); ++i) text.remove_suffix(1);
    return text;
}

}  // namespace

std::optional<std::string> decode_base64(std::string_view text) {
    return text.size() % 4 == 0 ? decode(without_padding(text), plain_digits) : std::nullopt;
}

std::optional<std::string> decode_base64url(std::string_view text) {
    const bool padded = text.ends_with('=');
    if (padded && text.size() % 4 != 0) return std::nullopt;
    return decode(padded ? without_padding(text) : text, url_digits);
}

}  // namespace relit::server
