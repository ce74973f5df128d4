// How many replies may be streams at once: each holds a connection's thread for as long as it lasts, so
// that without a cap they would leave none for renders.
#pragma once

#include <atomic>
#include <memory>
#include <string>

#include "server/error_codes.h"

namespace relit::server {

class StreamSlots {
public:
    explicit StreamSlots(int max) : max_(max) {}
    StreamSlots(const StreamSlots&) = delete;
    StreamSlots& operator=(const StreamSlots&) = delete;

    /// The right to stream, given back when the last copy is gone. Must not outlive its StreamSlots.
    using Slot = std::shared_ptr<void>;

    /// @throws Error queue_full
    [[nodiscard]] Slot take() {
        if (++open_ > max_) {
            --open_;
            throw Error(
                error_code::queue_full,
                "As many streams are open as max-streams allows, " + std::to_string(max_) + ".", {},
                "max-streams");
        }
        return {nullptr, [this](void*) { --open_; }};
    }

    [[nodiscard]] int open() const { return open_; }

private:
    const int max_;
    std::atomic<int> open_{0};
};

}  // namespace relit::server
