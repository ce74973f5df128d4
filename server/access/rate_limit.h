// How often a client may ask: a bucket of tokens for each, filled at a steady rate. For Access; knows
// neither keys nor HTTP.
#pragma once

#include <chrono>
#include <functional>
#include <mutex>
#include <string>
#include <unordered_map>

namespace relit::server {

/// What a client is told of its bucket.
struct RateState {
    bool allowed = true;
    int limit = 0;          ///< tokens that the bucket holds
    int remaining = 0;      ///< after this request
    int reset_s = 0;        ///< until it is full again, rounded up
    int retry_after_s = 0;  ///< until there is a token; 0: there is one
};

class RateLimit {
public:
    using Clock = std::chrono::steady_clock;

    /// @param per_second  requests, for good; > 0
    /// @param burst       requests at once after a pause; > 0
    /// @param now         the time; tests have their own
    RateLimit(double per_second, int burst, std::function<Clock::time_point()> now = Clock::now);

    /// Takes a token of the client's bucket where there is one. Safe from any thread.
    [[nodiscard]] RateState take(const std::string& client);

    /// Buckets that are not full. Those beyond 100,000 share one, so that no number of addresses
    /// takes more memory.
    [[nodiscard]] std::size_t buckets() const;

private:
    /// A bucket is the moment when it will be full: it fills by itself.
    using FullAt = Clock::time_point;
    [[nodiscard]] FullAt& bucket_of(const std::string& client, Clock::time_point now);

    const Clock::duration token_;  ///< time in which one comes
    const int burst_;
    const std::function<Clock::time_point()> now_;
    mutable std::mutex mutex_;
    std::unordered_map<std::string, FullAt> full_at_;
    FullAt others_{};
    Clock::time_point swept_{};
};

}  // namespace relit::server
