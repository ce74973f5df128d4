#include "server/jobs/render_slots.h"

#include <algorithm>
#include <cassert>

#include "server/error_codes.h"

namespace relit::server {
namespace {

Error cancelled() { return {error_code::cancelled, "The request was abandoned while it waited."}; }

Error timed_out() { return {error_code::timed_out, "The request waited until its time was over."}; }

Error superseded() {
    return {error_code::superseded, "A newer request of the same Relit-Session took its place."};
}

constexpr double weight_of_newest = 0.1;  // in the mean of the work's length
constexpr std::chrono::seconds watch_time{1};
constexpr int calm_share = 5;  // slots are free for that part of it: the load is below 1.2 or so

}  // namespace

RenderSlots::RenderSlots(Settings settings, Now now)
    : settings_(settings), now_(std::move(now)), watched_since_(now_()), noted_(watched_since_) {
    assert(settings_.max_running > 0 && settings_.max_waiting >= 0);
}

RenderSlots::Slot RenderSlots::wait_for_slot(Clock::time_point deadline,
                                             const std::stop_token& stop,
                                             std::string_view session) {
    const auto arrival = now_();
    Places mine;
    mine.emplace_back(session);
    const auto place = mine.begin();
    std::unique_lock lock(mutex_);
    if (stop.stop_requested()) throw cancelled();
    if (arrival >= deadline) throw timed_out();
    const auto older = waiting_of(session);
    const bool at_once = int(running_.size()) < settings_.max_running && line_.empty();
    auto stopping = working_for(session);
    // Who stops a request of its own takes no place that was not taken before.
    const bool replaces = older != line_.end() || !stopping.empty();
    look_for_calm(arrival);
    if (!at_once && !replaces) check_room(arrival, deadline);
    line_.splice(older, mine);
    if (older != line_.end()) displace(older);
    if (at_once) run_next();
    if (!stopping.empty()) {
        lock.unlock();  // a stop runs callbacks
        for (std::stop_source& work : stopping) work.request_stop();
        lock.lock();
    }
    wait_in_line(lock, place, deadline, stop);
    return {this, place, now_() - arrival};
}

// @throws Error queue_full
void RenderSlots::check_room(Clock::time_point arrival, Clock::time_point deadline) {
    const int waiting = int(line_.size());
    const std::string setting = std::string(settings_.max_waiting_name) + " allows, " +
                                std::to_string(settings_.max_waiting) + ".";
    if (waiting >= settings_.max_waiting) {
        if (!overloaded_) {
            watched_since_ = arrival;
            spare_ = {};
        }
        overloaded_ = true;
        throw Error(error_code::queue_full, "As many requests are waiting as " + setting, {},
                    settings_.max_waiting_name);
    }
    if (overloaded_ && waiting >= settings_.max_running)
        throw Error(error_code::queue_full,
                    "The server is overloaded: as many requests were waiting as " + setting, {},
                    settings_.max_waiting_name);
    const auto wait = usual_work_ * waiting / settings_.max_running;
    if (deadline - arrival < wait)
        throw Error(error_code::queue_full,
                    "The requests that are waiting take longer than this one may wait "
                    "(render-timeout).",
                    {}, "render-timeout");
}

// Counts the time until now in which there was a slot for whoever came.
void RenderSlots::note_spare(Clock::time_point now) {
    if (int(running_.size()) < settings_.max_running) spare_ += now - noted_;
    noted_ = now;
}

void RenderSlots::look_for_calm(Clock::time_point now) {
    note_spare(now);
    const auto watched = now - watched_since_;
    if (watched < watch_time) return;
    if (spare_ * calm_share > watched) overloaded_ = false;
    watched_since_ = now;
    spare_ = {};
}

void RenderSlots::supersede(std::string_view session) {
    std::unique_lock lock(mutex_);
    auto stopping = working_for(session);
    if (const auto older = waiting_of(session); older != line_.end()) displace(older);
    lock.unlock();
    for (std::stop_source& work : stopping) work.request_stop();
}

// The one place of a session in the line, or its end.
RenderSlots::Places::iterator RenderSlots::waiting_of(std::string_view session) {
    if (session.empty()) return line_.end();
    return std::find_if(line_.begin(), line_.end(),
                        [&](const Place& place) { return place.session == session; });
}

std::list<std::stop_source> RenderSlots::working_for(std::string_view session) const {
    std::list<std::stop_source> sources;
    for (const Place& place : running_)
        if (!session.empty() && place.session == session) sources.push_back(place.superseded);
    return sources;
}

void RenderSlots::displace(Places::iterator older) {
    displaced_.splice(displaced_.end(), line_, older);
    older->state = Place::displaced;
    older->changed.notify_one();
}

void RenderSlots::wait_in_line(std::unique_lock<std::mutex>& lock, Places::iterator place,
                               Clock::time_point deadline, const std::stop_token& stop) {
    while (place->state == Place::waiting && !stop.stop_requested() && now_() < deadline) {
        place->recheck = false;
        // Not longer than an hour at once: the largest time points overflow in the wait.
        const auto patience = std::min<Clock::duration>(deadline - now_(), std::chrono::hours(1));
        place->changed.wait_for(lock, stop, patience,
                                [&] { return place->state != Place::waiting || place->recheck; });
    }
    if (place->state == Place::running)
        return;  // also when it comes with the deadline: the slot is ours to give back
    if (place->state == Place::displaced) {
        displaced_.erase(place);
        throw superseded();
    }
    line_.erase(place);
    throw stop.stop_requested() ? cancelled() : timed_out();
}

void RenderSlots::run_next() noexcept {
    const auto now = now_();
    note_spare(now);
    const auto next = line_.begin();
    next->began = now;
    running_.splice(running_.end(), line_, next);
    next->state = Place::running;
    next->changed.notify_one();
}

// A slot passes to the next in line before anybody else can see it free.
void RenderSlots::release(Places::iterator place) noexcept {
    const std::scoped_lock lock(mutex_);
    last_used_ = now_();
    note_spare(last_used_);
    const std::chrono::duration<double> work = last_used_ - place->began;
    usual_work_ = used_ ? usual_work_ + weight_of_newest * (work - usual_work_) : work;
    running_.erase(place);
    used_ = true;
    if (!line_.empty()) run_next();
}

int RenderSlots::running() const {
    const std::scoped_lock lock(mutex_);
    return int(running_.size());
}

int RenderSlots::waiting() const {
    const std::scoped_lock lock(mutex_);
    return int(line_.size());
}

bool RenderSlots::overloaded() const {
    const std::scoped_lock lock(mutex_);
    return overloaded_;
}

RenderSlots::Clock::duration RenderSlots::idle_for() const {
    const std::scoped_lock lock(mutex_);
    if (!running_.empty() || !line_.empty()) return {};
    return used_ ? now_() - last_used_ : Clock::duration::max();
}

void RenderSlots::recheck() {
    const std::scoped_lock lock(mutex_);
    for (Place& place : line_) {
        place.recheck = true;
        place.changed.notify_one();
    }
}

}  // namespace relit::server
