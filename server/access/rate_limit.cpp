#include "server/access/rate_limit.h"

#include <algorithm>
#include <utility>

namespace relit::server {
namespace {

constexpr std::size_t most_buckets = 100'000;
constexpr std::chrono::seconds pause_between_sweeps{1};

int seconds_of(RateLimit::Clock::duration time) {
    return int(std::chrono::ceil<std::chrono::seconds>(time).count());
}

}  // namespace

RateLimit::RateLimit(double per_second, int burst, std::function<Clock::time_point()> now)
    : token_(std::chrono::duration_cast<Clock::duration>(
          std::chrono::duration<double>(1 / per_second))),
      burst_(burst),
      now_(std::move(now)) {}

// A full bucket is as good as none.
RateLimit::FullAt& RateLimit::bucket_of(const std::string& client, Clock::time_point now) {
    const auto found = full_at_.find(client);
    if (found != full_at_.end()) return found->second;
    if (now - swept_ >= pause_between_sweeps) {
        swept_ = now;
        std::erase_if(full_at_, [&](const auto& bucket) { return bucket.second <= now; });
    }
    return full_at_.size() < most_buckets ? full_at_[client] : others_;
}

RateState RateLimit::take(const std::string& client) {
    const std::scoped_lock lock(mutex_);
    const auto now = now_();
    FullAt& full_at = bucket_of(client, now);
    const auto capacity = token_ * burst_;
    auto missing = std::max(full_at - now, Clock::duration::zero());
    RateState state{.allowed = missing + token_ <= capacity, .limit = burst_};
    if (state.allowed) {
        missing += token_;
        full_at = now + missing;
    } else {
        state.retry_after_s = seconds_of(missing + token_ - capacity);
    }
    state.remaining = int((capacity - missing) / token_);
    state.reset_s = seconds_of(missing);
    return state;
}

std::size_t RateLimit::buckets() const {
    const std::scoped_lock lock(mutex_);
    return full_at_.size();
}

}  // namespace relit::server
