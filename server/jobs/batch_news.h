// Says that something has happened to a batch, to those who watch this batch alone: who watches a batch
// that waits is not woken by one that runs.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <stop_token>
#include <string>

namespace relit::server {

/// Safe from any thread.
class BatchNews {
public:
    BatchNews() = default;
    BatchNews(const BatchNews&) = delete;
    BatchNews& operator=(const BatchNews&) = delete;

    void announce(const std::string& batch);

    /// Watches a batch from its making on. Must not outlive its BatchNews.
    class Watch {
    public:
        Watch(BatchNews& news, const std::string& batch);
        ~Watch();
        Watch(const Watch&) = delete;
        Watch& operator=(const Watch&) = delete;

        /// Whether there is news since the last call that said so: at once, or within `patience`, or
        /// until `stop`. The first call always says so.
        [[nodiscard]] bool wait(std::chrono::milliseconds patience, const std::stop_token& stop);

    private:
        BatchNews& news_;
        const std::string batch_;
        std::uint64_t seen_ = 0;
    };

private:
    struct Channel {
        std::uint64_t announced = 1;
        int watches = 0;
        std::condition_variable_any changed;
    };
    std::mutex mutex_;
    std::map<std::string, Channel> channels_;  // of batches that are watched
};

}  // namespace relit::server
