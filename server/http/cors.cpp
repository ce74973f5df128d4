#include "server/http/cors.h"

#include <algorithm>
#include <stdexcept>

#include "server/text.h"

namespace relit::server {
namespace {

constexpr const char* exposed_headers =
    "Allow, Content-Length, Date, ETag, Location, RateLimit-Limit, RateLimit-Remaining, "
    "RateLimit-Reset, Relit-Accuracy, Relit-Height-Range, Retry-After, Server-Timing, "
    "traceresponse, WWW-Authenticate, X-Request-Id";
constexpr const char* accepted_headers =
    "Authorization, Content-Type, If-None-Match, Relit-Session, Idempotency-Key, Last-Event-ID, "
    "X-Request-Id, traceparent, tracestate";
constexpr const char* preflight_lifetime_s = "7200";  // as long as any browser keeps one

bool is_scheme(std::string_view text) {
    return !text.empty() && lower_letters.find(text.front()) != std::string_view::npos &&
           consists_of(text, lower_letters, digits, "+-.");
}

bool is_host(std::string_view text) {
    if (text.starts_with('[') && text.ends_with(']'))  // an IPv6 address
        return text.size() > 2 && consists_of(text.substr(1, text.size() - 2), digits, "abcdef:.");
    return !text.empty() && consists_of(text, lower_letters, digits, "-._");
}

bool is_port(std::string_view text) {
    const auto port = parse_number<int>(text);
    return port && *port > 0 && *port <= 65535 && text.front() != '0';
}

// The origin as browsers write it: in lower case, without the scheme's own port.
std::string parse_origin(std::string_view text) {
    std::string origin(text);
    std::transform(origin.begin(), origin.end(), origin.begin(), lower);
    const auto fail = [&] {
        throw std::invalid_argument("'" + std::string(text) +
                                    "' is no origin; one looks like https://example.org or "
                                    "http://localhost:3000, with no path");
    };
    const auto scheme_end = origin.find("://");
    if (scheme_end == std::string::npos) fail();
    const std::string_view scheme = std::string_view(origin).substr(0, scheme_end);
    std::string_view host = std::string_view(origin).substr(scheme_end + 3);
    std::string_view port;
    const auto colon = host.rfind(':');
    const bool has_port = colon != std::string_view::npos && !host.ends_with(']');
    if (has_port) {
        port = host.substr(colon + 1);
        host = host.substr(0, colon);
    }
    if (!is_scheme(scheme) || !is_host(host) || (has_port && !is_port(port))) fail();
    if ((scheme == "http" && port == "80") || (scheme == "https" && port == "443"))
        origin.resize(origin.size() - port.size() - 1);
    return origin;
}

// Our own words for who may read the reply to `request`; empty: nobody.
std::string_view allowed_origin(const CorsPolicy& policy, const Request& request) {
    if (policy.allow == CorsPolicy::Allow::all) return "*";
    const auto origin = request.header("Origin");
    if (policy.allow == CorsPolicy::Allow::none || !origin) return {};
    const auto found = std::find(policy.origins.begin(), policy.origins.end(), *origin);
    return found == policy.origins.end() ? std::string_view{} : *found;
}

}  // namespace

CorsPolicy parse_cors_policy(std::string_view text) {
    if (trimmed(text) == "*") return {CorsPolicy::Allow::all, {}};
    if (trimmed(text) == "none") return {CorsPolicy::Allow::none, {}};
    CorsPolicy policy{CorsPolicy::Allow::listed, {}};
    for (;;) {
        const auto comma = text.find(',');
        policy.origins.push_back(parse_origin(trimmed(text.substr(0, comma))));
        if (comma == std::string_view::npos) return policy;
        text.remove_prefix(comma + 1);
    }
}

void add_cors_headers(const CorsPolicy& policy, const Request& request, Reply& reply) {
    if (policy.allow == CorsPolicy::Allow::none) return;
    std::string& vary = reply.headers["Vary"];
    vary += vary.empty() ? "Origin" : ", Origin";
    const auto origin = allowed_origin(policy, request);
    if (origin.empty()) return;
    reply.headers.insert_or_assign("Access-Control-Allow-Origin", std::string(origin));
    reply.headers.insert_or_assign("Access-Control-Expose-Headers", exposed_headers);
    reply.headers.insert_or_assign("Timing-Allow-Origin", std::string(origin));
}

void add_preflight_headers(const CorsPolicy& policy, const Request& request,
                           const std::string& methods, Reply& reply) {
    if (!request.header("Access-Control-Request-Method")) return;
    if (allowed_origin(policy, request).empty()) return;
    reply.headers.insert_or_assign("Access-Control-Allow-Methods", methods);
    reply.headers.insert_or_assign("Access-Control-Allow-Headers", accepted_headers);
    reply.headers.insert_or_assign("Access-Control-Max-Age", preflight_lifetime_s);
}

}  // namespace relit::server
