#include "server/access/signed_url.h"

#include "server/storage/sha256.h"

namespace relit::server {
namespace {

constexpr std::string_view parameter = "&signature=";

std::string signature_of(std::string_view secret, std::string_view text) {
    return hmac_sha256_hex(secret, "GET\n" + std::string(text));
}

}  // namespace

std::string signed_target(std::string_view secret, std::string_view target, std::int64_t expires) {
    std::string text(target);
    const bool has_query = target.find('?') != std::string_view::npos;
    text.append(has_query ? "&" : "?").append("expires=").append(std::to_string(expires));
    return text + std::string(parameter) + signature_of(secret, text);
}

std::optional<SignedTarget> split_signed(std::string_view target) {
    const auto at = target.rfind(parameter);
    if (at == std::string_view::npos) return std::nullopt;
    const auto signature = target.substr(at + parameter.size());
    if (signature.find('&') != std::string_view::npos) return std::nullopt;
    return SignedTarget{target.substr(0, at), signature};
}

bool is_signed_by(std::string_view secret, const SignedTarget& target) {
    return equal_secrets(signature_of(secret, target.text), target.signature);
}

}  // namespace relit::server
