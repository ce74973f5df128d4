// Cross-origin requests (the Fetch standard, CORS protocol): which pages of other origins may read
// our replies. For dispatch(), which puts its headers on every reply; the list is a setting.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "server/http/message.h"

namespace relit::server {

struct CorsPolicy {
    enum class Allow { all, listed, none } allow = Allow::all;
    std::vector<std::string> origins;  ///< as browsers write them; with Allow::listed alone
};

/// "*", "none", or origins separated by commas, "https://example.org, http://localhost:3000".
/// @throws std::invalid_argument with a sentence that quotes the origin that is none
[[nodiscard]] CorsPolicy parse_cors_policy(std::string_view text);

/// Lets the page that asks read the reply, with all headers of ours and its timing, where the policy
/// says so. No text of the request's gets into the reply.
void add_cors_headers(const CorsPolicy& policy, const Request& request, Reply& reply);

/// What a preflight asks (an OPTIONS request before the one that is meant): whether the method and
/// our request headers are allowed here. Others are left alone.
/// @param methods  of the path, "GET, HEAD"
void add_preflight_headers(const CorsPolicy& policy, const Request& request,
                           const std::string& methods, Reply& reply);

}  // namespace relit::server
