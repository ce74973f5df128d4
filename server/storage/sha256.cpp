#include "server/storage/sha256.h"

#include <openssl/evp.h>

#include <array>
#include <stdexcept>

namespace relit::server {

std::string sha256_hex(std::string_view bytes) {
    std::array<unsigned char, 32> digest{};
    unsigned size = 0;
    if (::EVP_Digest(bytes.data(), bytes.size(), digest.data(), &size, ::EVP_sha256(), nullptr) !=
            1 ||
        size != digest.size())
        throw std::runtime_error("SHA-256 is not available");
    std::string hex;
    hex.reserve(2 * digest.size());
    for (const unsigned char byte : digest) {
        hex += "0123456789abcdef"[byte >> 4];
        hex += "0123456789abcdef"[byte & 15];
    }
    return hex;
}

std::string strong_etag(std::string_view bytes) {
    return '"' + sha256_hex(bytes).substr(0, 32) + '"';
}

}  // namespace relit::server
