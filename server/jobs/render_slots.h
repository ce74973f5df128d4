// Who may work now and who waits, in the order of arrival. A machine renders no faster for being
// asked by many at once, so requests queue here, and a full queue says so at once instead of making
// everybody late.
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <list>
#include <mutex>
#include <stop_token>
#include <string>
#include <utility>

namespace relit::server {

/// A bounded queue before a bounded number of slots. Safe from any thread.
///
/// Strictly first come, first served: a slot that becomes free goes to the longest waiting, and a
/// newcomer never passes a waiter. (A mutex and a condition variable alone let newcomers pass:
/// measured, a request among eight clients then waits up to 18 times the median.)
class RenderSlots {
public:
    using Clock = std::chrono::steady_clock;
    using Now = std::function<Clock::time_point()>;

    struct Settings {
        int max_running = 1;  ///< > 0
        int max_waiting = 64;
        std::string max_waiting_name = "max-queue";  ///< the setting, for the refusal
    };

    /// @param now  the time; tests pass their own and call recheck() after moving it
    explicit RenderSlots(Settings settings, Now now = Clock::now);
    RenderSlots(const RenderSlots&) = delete;
    RenderSlots& operator=(const RenderSlots&) = delete;
    ~RenderSlots() = default;

    /// The right to work, given back when it is destroyed. Must not outlive its RenderSlots.
    class [[nodiscard]] Slot {
    public:
        Slot(Slot&& other) noexcept : slots_(std::exchange(other.slots_, nullptr)) {}
        Slot& operator=(Slot&&) = delete;
        ~Slot() {
            if (slots_) slots_->release();
        }

        /// How long it was waited for.
        [[nodiscard]] Clock::duration waited() const { return waited_; }

    private:
        friend class RenderSlots;
        Slot(RenderSlots* slots, Clock::duration waited) : slots_(slots), waited_(waited) {}
        RenderSlots* slots_;
        Clock::duration waited_{};
    };

    /// A slot, at once or when it is this caller's turn.
    ///
    /// @throws Error queue_full (as many wait as may), timed_out (`deadline` has passed), cancelled
    ///         (`stop` is set); after each of them the caller's place is gone
    Slot wait_for_slot(Clock::time_point deadline, const std::stop_token& stop);

    [[nodiscard]] int running() const;
    [[nodiscard]] int waiting() const;

    /// Has every waiter look at the time again; for clocks that do not run by themselves.
    void recheck();

private:
    struct Waiter {
        std::condition_variable_any
            changed;  // one each, so that a free slot wakes exactly its next owner
        bool granted = false;
        bool recheck = false;
    };

    void wait_in_line(std::unique_lock<std::mutex>& lock, Clock::time_point deadline,
                      const std::stop_token& stop);
    void release() noexcept;

    const Settings settings_;
    const Now now_;
    mutable std::mutex mutex_;
    std::list<Waiter*> line_;  // those not granted, longest waiting first
    int running_ = 0;
};

}  // namespace relit::server
