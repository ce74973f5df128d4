// Renders the frames of batches: workers that claim them one by one, and a keeper that stores what is
// finished, keeps leases alive and removes what has expired. Knows neither scenes nor HTTP: what a frame
// is made by is passed in.
#pragma once

#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "core/base/error.h"
#include "server/jobs/job_store.h"
#include "server/storage/result_files.h"

namespace relit::server {

struct RenderedFrame {
    std::string bytes;
    std::string media_type;
};

/// Makes the picture of a scene. @throws Error (cancelled after `stop`)
using RenderFrame =
    std::function<RenderedFrame(const std::string& scene, const std::stop_token& stop)>;

struct BatchRunnerSettings {
    int workers = 1;                        ///< frames at once, > 0
    int busy_workers = 1;                   ///< as many begin one while `is_busy`
    std::function<RenderFrame()> renderer;  ///< called once by each worker, on its thread
    std::function<bool()> is_busy = [] {
        return false;
    };  ///< requests have somebody waiting for them
    /// Told of every frame that has ended, and of the setting (Error::limit) that it failed because of.
    std::function<void(bool done, std::string_view limit)> counted = [](bool, std::string_view) {};
    /// Told after a batch has changed, and whether with its last frame. From any thread.
    std::function<void(const std::string& batch, bool finished)> changed = [](const std::string&,
                                                                              bool) {};
    std::function<std::string(const Error&)> problem;  ///< the document that tells of an error
    std::chrono::milliseconds frame_timeout = std::chrono::minutes(10);
    std::chrono::milliseconds expiry = std::chrono::hours(24 * 7);  ///< of finished batches
    std::uint64_t max_result_bytes = 20ull << 30;
};

/// Workers run at a lower priority of the operating system: requests take the processors when they want
/// them, whatever share of the workers goes on.
///
/// What cannot be stored for now (a full disk, a database out of reach) is kept in memory and tried
/// again, 1 s, 4 s, then 16 s apart; meanwhile no further frame begins.
class BatchRunner {
public:
    /// @param results  swept when the store is first reached: of files it does not name
    BatchRunner(JobStore& store, ResultFiles& results, BatchRunnerSettings settings);
    ~BatchRunner();  ///< stop()
    BatchRunner(const BatchRunner&) = delete;
    BatchRunner& operator=(const BatchRunner&) = delete;

    void start();

    /// There is work that was not there before.
    void wake();

    /// Stops the frames of a batch that has been removed.
    void abandon(const std::string& batch);

    /// Begins no further frame; those under way go on.
    void drain();

    /// Gives back the frames under way, stores what is finished, and returns when all threads are gone.
    void stop();

private:
    using Clock = std::chrono::steady_clock;

    // A frame that is being rendered or stored.
    struct Held {
        enum class Why { none, abandoned, too_late, stopping };
        Lease lease;
        Clock::time_point deadline;
        std::stop_source stop{};
        Why why = Why::none;  // it was stopped
        std::optional<RenderedFrame> picture{};
        std::string problem{};
        std::string_view limit{};  // the setting behind the problem
        Clock::time_point ended{};
    };
    using HeldList = std::list<Held>;

    void work(int number);
    bool wait_for_turn(std::unique_lock<std::mutex>& lock, int number);
    bool may_begin(int number) const;
    void work_on(const Claim& claim, const RenderFrame& render);
    void render_held(Held& held, const Claim& claim, const RenderFrame& render);
    void stop_held(Held& held, Held::Why why);

    void keep();
    void sweep_once();
    bool is_gathered() const;
    bool deliver(HeldList& finished);
    void look_after_leases();
    void look_after_room();

    JobStore& store_;
    ResultFiles& results_;
    const BatchRunnerSettings settings_;

    std::mutex mutex_;
    std::condition_variable changed_;  // of anything below
    HeldList rendering_;
    HeldList finished_;  // to be stored
    HeldList storing_;
    std::uint64_t work_ = 0;  // rises when there may be work
    bool ready_ = false;      // what the last run left has been swept
    bool draining_ = false;
    bool stopping_ = false;
    int working_ = 0;    // workers
    bool full_ = false;  // results have no room left, and nothing can go
    std::vector<std::thread> workers_;
    std::thread keeper_;
};

}  // namespace relit::server
