#include "server/access/access.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "server/access/signed_url.h"
#include "server/error_codes.h"
#include "server/text.h"

namespace relit::server {
namespace {

constexpr std::string_view public_cache = "public";

// The token of "Bearer <token>" (RFC 6750, 2.1); the scheme's case does not matter.
std::optional<std::string_view> bearer_token(std::string_view header) {
    constexpr std::string_view scheme = "bearer ";
    if (header.size() <= scheme.size() ||
        !std::equal(scheme.begin(), scheme.end(), header.begin(),
                    [](char wanted, char c) { return wanted == lower(c); }))
        return std::nullopt;
    return trimmed(header.substr(scheme.size()));
}

void add_rate_headers(const RateState& rate, Reply& reply) {
    reply.headers.insert_or_assign("RateLimit-Limit", std::to_string(rate.limit));
    reply.headers.insert_or_assign("RateLimit-Remaining", std::to_string(rate.remaining));
    reply.headers.insert_or_assign("RateLimit-Reset", std::to_string(rate.reset_s));
    if (reply.error_code == error_code::rate_limited)
        reply.headers.insert_or_assign("Retry-After", std::to_string(rate.retry_after_s));
}

void narrow_caching(const Admission& admission, Reply& reply) {
    const auto found = reply.headers.find("Cache-Control");
    if (found == reply.headers.end() || !found->second.starts_with(public_cache)) return;
    if (admission.signed_for_s)
        found->second = fmt::format("public, max-age={}", *admission.signed_for_s);
    else found->second.replace(0, public_cache.size(), "private");
}

}  // namespace

Access::Access(const AccessSettings& settings) : now_(settings.now) {
    if (!settings.api_keys.empty()) keys_.emplace(settings.api_keys);
    if (settings.rate_limit > 0)
        rate_.emplace(settings.rate_limit, settings.rate_burst, settings.rate_now);
}

void Access::admit(Scope needed, Request& request) {
    if (needed == Scope::open) return;
    if (keys_) admit_with_key(*keys_->current(), needed, request);
    else charge("address " + request.address, request);
}

void Access::admit_with_key(const KeyList& keys, Scope needed, Request& request) {
    const ApiKey* key = nullptr;
    try {
        key = &key_of(keys, request);
    } catch (const Error&) {
        charge("address " + request.address, request);
        throw;
    }
    request.admission.key = key->name;
    charge("key " + key->name, request);
    if (key->scope < needed)
        throw Error(error_code::forbidden,
                    fmt::format("This needs a key of scope {}; this one's is {}.", name_of(needed),
                                name_of(key->scope)));
}

const ApiKey& Access::key_of(const KeyList& keys, Request& request) const {
    if (request.query.contains("signature")) return signer_of(keys, request);
    const auto header = request.header("Authorization");
    if (!header)
        throw Error(error_code::unauthorized,
                    "This needs an API key, as the header Authorization: Bearer <key>, or a signed "
                    "URL.");
    const auto token = bearer_token(*header);
    if (!token)
        throw Error(error_code::unauthorized,
                    "The header Authorization is not of the form: Bearer <key>.");
    const ApiKey* key = find_key(keys, *token);
    if (!key) throw Error(error_code::unauthorized, "The server does not know this API key.");
    return *key;
}

const ApiKey& Access::signer_of(const KeyList& keys, Request& request) const {
    const auto refuse = [](const char* words) {
        throw Error(error_code::signature_refused, words);
    };
    if (!request.is_get()) refuse("A signed URL is good for GET and HEAD alone.");
    const auto target = split_signed(request.target);
    if (!target || request.query.count("signature") > 1)
        refuse("The parameter 'signature' must be the last one, and there once.");
    const auto signer = std::find_if(keys.begin(), keys.end(), [&](const ApiKey& key) {
        return is_signed_by(key.secret, *target);
    });
    if (signer == keys.end())
        refuse("The signature is not that of this URL by a key that the server knows.");
    const auto expires = parse_number<std::int64_t>(request.query_value("expires").value_or(""));
    if (!expires || request.query.count("expires") > 1)
        refuse("The parameter 'expires' must be there once, in seconds since 1970.");
    const auto now = std::chrono::floor<std::chrono::seconds>(now_()).time_since_epoch().count();
    if (*expires <= now) refuse("The signed URL has expired.");
    request.admission.signed_for_s = std::min<std::int64_t>(*expires - now, 365 * 86400);
    request.query.erase("signature");
    request.query.erase("expires");
    return *signer;
}

void Access::charge(const std::string& client, Request& request) {
    if (!rate_) return;
    request.admission.rate = rate_->take(client);
    if (!request.admission.rate->allowed)
        throw Error(error_code::rate_limited,
                    "More requests than rate-limit and rate-burst allow a client.", {},
                    "rate-limit");
}

void add_access_headers(const Request& request, Reply& reply) {
    const Admission& admission = request.admission;
    if (admission.rate) add_rate_headers(*admission.rate, reply);
    if (reply.error_code == error_code::unauthorized)
        reply.headers.insert_or_assign("WWW-Authenticate", "Bearer realm=\"relit\"");
    if (!admission.key.empty()) narrow_caching(admission, reply);
}

}  // namespace relit::server
