#include "server/storage/sha256.h"

#include <openssl/crypto.h>
#include <openssl/evp.h>
#include <openssl/hmac.h>

#include <array>
#include <stdexcept>

namespace relit::server {
namespace {

using Digest = std::array<unsigned char, 32>;

std::string hex_of(const Digest& digest) {
    std::string hex;
    hex.reserve(2 * digest.size());
    for (const unsigned char byte : digest) {
        hex += "0123456789abcdef"[byte >> 4];
        hex += "0123456789abcdef"[byte & 15];
    }
    return hex;
}

}  // namespace

std::string sha256_hex(std::string_view bytes) {
    Digest digest{};
    unsigned size = 0;
    if (::EVP_Digest(bytes.data(), bytes.size(), digest.data(), &size, ::EVP_sha256(), nullptr) !=
            1 ||
        size != digest.size())
        throw std::runtime_error("SHA-256 is not available");
    return hex_of(digest);
}

std::string strong_etag(std::string_view bytes) {
    return '"' + sha256_hex(bytes).substr(0, 32) + '"';
}

std::string hmac_sha256_hex(std::string_view key, std::string_view text) {
    Digest digest{};
    unsigned size = 0;
    if (!::HMAC(::EVP_sha256(), key.data(), int(key.size()),
                reinterpret_cast<const unsigned char*>(text.data()), text.size(), digest.data(),
                &size) ||
        size != digest.size())
        throw std::runtime_error("HMAC-SHA-256 is not available");
    return hex_of(digest);
}

bool equal_secrets(std::string_view a, std::string_view b) {
    return a.size() == b.size() && ::CRYPTO_memcmp(a.data(), b.data(), a.size()) == 0;
}

}  // namespace relit::server
