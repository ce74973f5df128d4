#include "server/jobs/render_slots.h"

#include <algorithm>
#include <cassert>

#include "server/error_codes.h"

namespace relit::server {
namespace {

Error cancelled() { return {error_code::cancelled, "The request was abandoned while it waited."}; }

Error timed_out() { return {error_code::timed_out, "The request waited until its time was over."}; }

}  // namespace

RenderSlots::RenderSlots(Settings settings, Now now)
    : settings_(std::move(settings)), now_(std::move(now)) {
    assert(settings_.max_running > 0 && settings_.max_waiting >= 0);
}

RenderSlots::Slot RenderSlots::wait_for_slot(Clock::time_point deadline,
                                             const std::stop_token& stop) {
    const auto arrival = now_();
    std::unique_lock lock(mutex_);
    if (stop.stop_requested()) throw cancelled();
    if (arrival >= deadline) throw timed_out();
    if (running_ < settings_.max_running && line_.empty()) ++running_;
    else wait_in_line(lock, deadline, stop);
    return {this, now_() - arrival};
}

void RenderSlots::wait_in_line(std::unique_lock<std::mutex>& lock, Clock::time_point deadline,
                               const std::stop_token& stop) {
    if (int(line_.size()) >= settings_.max_waiting)
        throw Error(error_code::queue_full, "As many requests are waiting as " +
                                                settings_.max_waiting_name + " allows, " +
                                                std::to_string(settings_.max_waiting) + ".");
    Waiter waiter;
    const auto place = line_.insert(line_.end(), &waiter);
    while (!waiter.granted && !stop.stop_requested() && now_() < deadline) {
        waiter.recheck = false;
        // Not longer than an hour at once: the largest time points overflow in the wait.
        const auto patience = std::min<Clock::duration>(deadline - now_(), std::chrono::hours(1));
        waiter.changed.wait_for(lock, stop, patience,
                                [&] { return waiter.granted || waiter.recheck; });
    }
    if (waiter.granted)
        return;  // also when it comes with the deadline: the slot is ours to give back
    line_.erase(place);
    throw stop.stop_requested() ? cancelled() : timed_out();
}

// A slot passes to the next in line before anybody else can see it free.
void RenderSlots::release() noexcept {
    const std::scoped_lock lock(mutex_);
    if (line_.empty()) {
        --running_;
        return;
    }
    Waiter& next = *line_.front();
    line_.pop_front();
    next.granted = true;
    next.changed.notify_one();
}

int RenderSlots::running() const {
    const std::scoped_lock lock(mutex_);
    return running_;
}

int RenderSlots::waiting() const {
    const std::scoped_lock lock(mutex_);
    return int(line_.size());
}

void RenderSlots::recheck() {
    const std::scoped_lock lock(mutex_);
    for (Waiter* waiter : line_) {
        waiter->recheck = true;
        waiter->changed.notify_one();
    }
}

}  // namespace relit::server
