#include "server/jobs/batch_runner.h"

#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <new>

#include "server/error_codes.h"

namespace relit::server {
namespace {

using namespace std::chrono_literals;

constexpr int niceness = 19;  // about a seventieth of the share of a thread that answers requests
constexpr auto look_at_turn_every = 20ms;
constexpr auto look_for_work_every = 1s;  // for frames whose pause is over
constexpr auto renew_every = 10s;
constexpr std::chrono::seconds back_off[] = {1s, 4s, 16s};
// Finished frames are stored together: what that costs is the disk's, once however many they are.
constexpr auto gathered_for = 100ms;
constexpr std::size_t gathered = 16, stored_at_once = 32;

// Of this thread alone, as Linux counts.
void lower_priority() {
    if (::setpriority(PRIO_PROCESS, id_t(::gettid()), niceness) != 0)
        spdlog::warn("batches: workers run at the priority of requests");
}

}  // namespace

BatchRunner::BatchRunner(JobStore& store, ResultFiles& results, BatchRunnerSettings settings)
    : store_(store), results_(results), settings_(std::move(settings)) {}

BatchRunner::~BatchRunner() { stop(); }

void BatchRunner::start() {
    working_ = settings_.workers;
    keeper_ = std::thread([this] { keep(); });
    for (int i = 0; i < settings_.workers; ++i) workers_.emplace_back([this, i] { work(i); });
}

void BatchRunner::wake() {
    const std::scoped_lock lock(mutex_);
    ++work_;
    changed_.notify_all();
}

void BatchRunner::drain() {
    const std::scoped_lock lock(mutex_);
    draining_ = true;
    changed_.notify_all();
}

void BatchRunner::abandon(const std::string& batch) {
    const std::scoped_lock lock(mutex_);
    for (Held& held : rendering_)
        if (held.lease.batch == batch) stop_held(held, Held::Why::abandoned);
}

void BatchRunner::stop() {
    {
        const std::scoped_lock lock(mutex_);
        draining_ = stopping_ = true;
        for (Held& held : rendering_) stop_held(held, Held::Why::stopping);
        changed_.notify_all();
    }
    for (std::thread& worker : workers_) worker.join();
    workers_.clear();
    if (keeper_.joinable()) keeper_.join();
}

// With mutex_ locked. Renders have no callbacks of ours that would want it.
void BatchRunner::stop_held(Held& held, Held::Why why) {
    if (held.why == Held::Why::none) held.why = why;
    held.stop.request_stop();
}

// --- workers ---

void BatchRunner::work(int number) {
    lower_priority();
    const RenderFrame render = settings_.renderer();
    std::unique_lock lock(mutex_);
    while (wait_for_turn(lock, number)) {
        const std::uint64_t work_seen = work_;
        lock.unlock();
        std::optional<Claim> claim;
        try {
            claim = store_.claim(std::to_string(number));
            if (claim) work_on(*claim, render);
        } catch (const std::exception& error) {  // tried again like an empty queue
            spdlog::debug("batches: no frame was claimed: {}", error.what());
        }
        lock.lock();
        if (!claim)
            changed_.wait_for(lock, look_for_work_every,
                              [&] { return work_ != work_seen || draining_; });
    }
    --working_;
    changed_.notify_all();
}

// @return false: no more of them
bool BatchRunner::wait_for_turn(std::unique_lock<std::mutex>& lock, int number) {
    while (!draining_ && !may_begin(number)) changed_.wait_for(lock, look_at_turn_every);
    return !draining_;
}

// Not while more waits to be stored than is stored at once: the disk is slower than we are, or full.
bool BatchRunner::may_begin(int number) const {
    if (!ready_ || finished_.size() + storing_.size() > stored_at_once) return false;
    return number < settings_.busy_workers || !settings_.is_busy();
}

void BatchRunner::work_on(const Claim& claim, const RenderFrame& render) {
    HeldList mine;
    mine.push_back({.lease = claim.lease, .deadline = Clock::now() + settings_.frame_timeout});
    const auto held = mine.begin();
    {
        const std::scoped_lock lock(mutex_);
        rendering_.splice(rendering_.end(), mine);
        if (stopping_) stop_held(*held, Held::Why::stopping);
    }
    render_held(*held, claim, render);
    std::unique_lock lock(mutex_);
    const bool ended = held->picture || !held->problem.empty();
    if (ended) {
        held->ended = Clock::now();
        finished_.splice(finished_.end(), rendering_, held);
        changed_.notify_all();
        return;
    }
    rendering_.erase(held);
    lock.unlock();
    store_.give_back(claim.lease);
    wake();
}

// Leaves a picture or a problem; neither, where the frame is to be given back.
void BatchRunner::render_held(Held& held, const Claim& claim, const RenderFrame& render) {
    const auto fail = [&](const Error& error) {
        held.problem = settings_.problem(error);
        held.limit = error.limit;
    };
    try {
        held.picture = render(claim.scene, held.stop.get_token());
    } catch (const Error& error) {
        const std::scoped_lock lock(mutex_);
        if (error.code != error_code::cancelled) fail(error);
        else if (held.why == Held::Why::too_late)
            fail({error_code::timed_out,
                  "the frame was not ready in time (batch-frame-timeout)",
                  {},
                  "batch-frame-timeout"});
    } catch (const std::bad_alloc&) {
        fail({error_code::memory_full, "there was not enough memory for the frame"});
    } catch (const std::exception& error) {
        spdlog::error("batches: frame {} of {} failed: {}", claim.lease.number, claim.lease.batch,
                      error.what());
        fail({error_code::internal, "the server failed to render the frame"});
    }
}

// --- the keeper ---

void BatchRunner::keep() {
    sweep_once();
    std::size_t failures = 0;
    Clock::time_point deliver_at{}, room_at{}, renew_at = Clock::now() + renew_every;
    std::unique_lock lock(mutex_);
    for (;;) {
        changed_.wait_for(lock, finished_.empty() ? 1s : gathered_for, [&] {
            return (is_gathered() && Clock::now() >= deliver_at) || (stopping_ && working_ == 0);
        });
        const bool last = stopping_ && working_ == 0;
        const auto now = Clock::now();
        for (Held& held : rendering_)
            if (now > held.deadline) stop_held(held, Held::Why::too_late);
        if (last ? !finished_.empty() : is_gathered() && now >= deliver_at) {
            const auto end = std::next(finished_.begin(),
                                       std::ptrdiff_t(std::min(finished_.size(), stored_at_once)));
            storing_.splice(storing_.end(), finished_, finished_.begin(), end);
            lock.unlock();
            const bool stored = deliver(storing_);
            lock.lock();
            if (stored) {
                storing_.clear();
                failures = 0;
            } else {
                finished_.splice(finished_.begin(), storing_);
                deliver_at = Clock::now() + back_off[std::min(failures++, std::size(back_off) - 1)];
                if (last) return;  // they are rendered again by the next run
            }
            changed_.notify_all();
        }
        if (last && finished_.empty()) return;
        lock.unlock();
        if (now >= room_at) {
            look_after_room();
            room_at = now + 1s;
        }
        if (now >= renew_at) {
            look_after_leases();
            renew_at = now + renew_every;
        }
        lock.lock();
    }
}

// Whether finished frames are stored now; not while there will soon be more of them.
bool BatchRunner::is_gathered() const {
    return !finished_.empty() && (finished_.size() >= gathered || rendering_.empty() ||
                                  Clock::now() - finished_.front().ended >= gathered_for);
}

// What the last run left behind, before the first frame begins.
void BatchRunner::sweep_once() {
    std::unique_lock lock(mutex_);
    while (!stopping_) {
        lock.unlock();
        bool done = false;
        try {
            results_.sweep([&](const std::string& batch) { return store_.result_files(batch); });
            done = true;
        } catch (const std::exception& error) {
            spdlog::debug("batches: not swept: {}", error.what());
        }
        lock.lock();
        if (done) {
            ready_ = true;
            changed_.notify_all();
            return;
        }
        changed_.wait_for(lock, 1s, [&] { return stopping_; });
    }
}

// Files first, then the store: what the store says is done is there. One commit for all.
// @return false: nothing is ended, and they are to be tried again
bool BatchRunner::deliver(HeldList& finished) try {
    std::vector<JobStore::Ending> endings;
    std::vector<ResultFiles::NewPicture> pictures;
    for (Held& held : finished) {
        JobStore::Ending& ending = endings.emplace_back();
        ending.lease = held.lease;
        ending.problem = held.problem;
        if (held.picture && full_) {
            held.limit = "max-results";
            ending.problem = settings_.problem(
                {error_code::storage_full, "there is no room left for results (max-results)"});
        }
        if (!ending.problem.empty()) continue;
        const auto& [bytes, media_type] = *held.picture;
        ending.result = {"", bytes.size(), media_type};
        pictures.push_back({held.lease.batch, bytes});
    }
    std::vector<std::string> names = results_.put(pictures);
    auto name = names.begin();
    for (JobStore::Ending& ending : endings)
        if (ending.result) ending.result->file = std::move(*name++);
    const auto ended = store_.end(endings);
    auto held = finished.begin();
    for (std::size_t i = 0; i < ended.size(); ++i, ++held) {
        const std::string& batch = endings[i].lease.batch;
        if (ended[i].counted) {
            settings_.counted(endings[i].result.has_value(), held->limit);
            settings_.changed(batch, ended[i].finished);
        } else if (!store_.find(batch)) {
            results_.remove(batch);  // it was removed meanwhile
        }
    }
    return true;
} catch (const std::exception& error) {
    spdlog::error("batches: {} finished frames wait to be stored: {}", finished.size(),
                  error.what());
    return false;
}

void BatchRunner::look_after_leases() try {
    std::vector<Lease> leases;
    {
        const std::scoped_lock lock(mutex_);
        for (const HeldList* list : {&rendering_, &finished_})
            for (const Held& held : *list) leases.push_back(held.lease);
    }
    const auto gone = store_.renew(leases);
    {
        const std::scoped_lock lock(mutex_);
        for (Held& held : rendering_)
            if (std::find(gone.begin(), gone.end(), held.lease) != gone.end())
                stop_held(held, Held::Why::abandoned);
    }
    for (const std::string& batch : store_.reap()) {
        const auto facts = store_.find(batch);
        settings_.changed(batch, facts && facts->finished);
    }
    store_.forget_keys(settings_.expiry.count());
} catch (const std::exception& error) {  // tried again the next time
    spdlog::debug("batches: {}", error.what());
}

void BatchRunner::look_after_room() try {
    for (const std::string& batch :
         store_.expired(settings_.expiry.count(), settings_.max_result_bytes)) {
        if (!store_.remove(batch)) continue;
        results_.remove(batch);
        spdlog::info("batches: {} has expired", batch);
        settings_.changed(batch, true);
    }
    full_ = store_.counts().result_bytes > settings_.max_result_bytes;
} catch (const std::exception& error) {  // tried again the next time
    spdlog::debug("batches: {}", error.what());
}

}  // namespace relit::server
