// Who may do what, and how often: asked for each request when its head is there, before any of its
// body is read. For the transport and dispatch().
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <optional>

#include "server/access/api_keys.h"
#include "server/access/rate_limit.h"
#include "server/access/scope.h"
#include "server/http/message.h"

namespace relit::server {

struct AccessSettings {
    std::filesystem::path api_keys;  ///< see api_keys.h; empty: everybody may do everything
    int rate_limit = 0;              ///< requests per second of a client; 0: any number
    int rate_burst = 100;            ///< at once, after a pause
    std::function<std::chrono::system_clock::time_point()> now = std::chrono::system_clock::now;
    std::function<RateLimit::Clock::time_point()> rate_now = RateLimit::Clock::now;
};

class Access {
public:
    /// Everybody may do everything.
    Access() = default;
    /// @throws std::runtime_error with a sentence for the operator about the file of keys
    explicit Access(const AccessSettings& settings);

    /// Lets a request in. Where there are keys, it has to bring one of `needed` or more, as
    /// `Authorization: Bearer <key>` or as a signed URL, whose parameters are taken off it. It
    /// counts against the rate of its key; without keys, or with a wrong one, against that of its
    /// address. What is open to all is not counted.
    /// @throws Error unauthorized, forbidden, signature_refused, rate_limited
    void admit(Scope needed, Request& request);

private:
    void admit_with_key(const KeyList& keys, Scope needed, Request& request);
    [[nodiscard]] const ApiKey& key_of(const KeyList& keys, Request& request) const;
    [[nodiscard]] const ApiKey& signer_of(const KeyList& keys, Request& request) const;
    void charge(const std::string& client, Request& request);

    std::optional<ApiKeys> keys_;
    std::optional<RateLimit> rate_;
    std::function<std::chrono::system_clock::time_point()> now_;
};

/// What a reply says of access: `WWW-Authenticate`, `RateLimit-*`, `Retry-After`; and no shared cache
/// may give to everybody what takes a key, or keep what a signed URL gives beyond its time.
void add_access_headers(const Request& request, Reply& reply);

}  // namespace relit::server
