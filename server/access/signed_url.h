// URLs that carry their own permission, for <img src> and for whoever has no key: somebody with a
// key signs one, and it is good until it expires. For Access, which checks them, and for
// `relit sign-url`, which makes them.
//
// "/v1/images/c19f…/relit.png?sun=300,40&expires=1790000000&signature=…": the signature comes last. It
// is the HMAC-SHA-256, in lower-case hex, of "GET\n" and all that stands before "&signature=", with
// the API key as its key.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace relit::server {

/// The path and query of a signed URL.
/// @param target   path and maybe a query, as it will be sent, without a fragment
/// @param expires  seconds since 1970, UTC
/// @pre `target` has no parameter expires or signature
[[nodiscard]] std::string signed_target(std::string_view secret, std::string_view target,
                                        std::int64_t expires);

/// What a signature is about.
struct SignedTarget {
    std::string_view text;  ///< that was signed, of the target
    std::string_view signature;
};

/// The parts of a target; nothing where it does not end in a signature.
[[nodiscard]] std::optional<SignedTarget> split_signed(std::string_view target);

/// Whether `signature` is that of `text` by this key.
[[nodiscard]] bool is_signed_by(std::string_view secret, const SignedTarget& target);

}  // namespace relit::server
