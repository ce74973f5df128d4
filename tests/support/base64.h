// Base64 for tests that send it (RFC 4648).
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>

namespace relit::test {

inline std::string encode_base64(const std::string& bytes, const std::string& last_digits = "+/") {
    const std::string digits =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789" + last_digits;
    std::string text;
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
        std::uint32_t bits = 0;
        for (std::size_t k = 0; k < 3; ++k)
            bits = bits << 8 | (k < count ? std::uint8_t(bytes[i + k]) : 0);
        for (std::size_t k = 0; k < 4; ++k)
            text += k <= count ? digits[bits >> (18 - 6 * k) & 63] : '=';
    }
    return text;
}

inline std::string encode_base64url(const std::string& bytes) { return encode_base64(bytes, "-_"); }

}  // namespace relit::test
