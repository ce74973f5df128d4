// Batches of renders and their frames, kept so that nothing that was accepted is lost: the states,
// the leases and the transitions between them, whatever keeps them. For the routes of batches and
// for the workers that render frames (batch_runner.h).
//
//     ready --claim--> leased --complete--> done
//       ^                |  `---fail------> failed --retry_failed--> ready
//       |                |                    ^
//       `--give_back-----+---vanished 3x------'        (vanished: the lease ran out, or its process)
#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

namespace relit::server {

/// Milliseconds since 1970 by the store's own clock, the only one that counts.
using StoreTime = std::int64_t;

enum class FrameState { ready, leased, done, failed };

struct NewFrame {
    std::string name;   ///< of its file; unique within the batch
    std::string scene;  ///< in its one form, as scene_json() writes it
};

/// A batch as it is submitted.
struct NewBatch {
    std::string id;
    int priority = 0;              ///< batches of a higher one go first
    std::vector<NewFrame> frames;  ///< at least one
    std::set<std::string> images;  ///< ids that its frames name
    std::string key;               ///< the client's idempotency key; empty: none
    std::string body_hash;         ///< of the request, to know its repetition by
};

/// What is known of a batch.
struct BatchFacts {
    std::int64_t place = 0;  ///< rises with every batch that is submitted
    std::string id;
    int priority = 0;
    int total = 0;
    int done = 0;
    int failed = 0;
    StoreTime created = 0;
    std::optional<StoreTime> started;   ///< when its first frame was claimed
    std::optional<StoreTime> finished;  ///< when its last frame was done or failed
    std::uint64_t result_bytes = 0;     ///< of the pictures that are done
    std::int64_t last_event = 0;        ///< the id of its newest event; 0: there is none
};

/// A finished picture.
struct FrameResult {
    std::string file;  ///< its name among the result files of the batch
    std::uint64_t size_bytes = 0;
    std::string media_type;
};

struct FrameFacts {
    int number = 0;  ///< from 0
    std::string name;
    FrameState state = FrameState::ready;
    FrameResult result;   ///< where it is done
    std::string problem;  ///< a problem document, where it has failed
};

/// A step of a batch, in the order in which they happened: a frame done or failed, or its end.
struct BatchEvent {
    std::int64_t id = 0;  ///< rises within the batch, also over restarts; never used twice
    std::optional<FrameFacts> frame;  ///< none: the batch has ended
};

/// The right to work on a frame until it runs out. `attempt` is the fencing token: who claims a
/// frame after this one has a higher one, and what is done with an older one has no effect.
struct Lease {
    std::string batch;
    int number = 0;
    int attempt = 0;
    std::string worker;
    friend bool operator==(const Lease&, const Lease&) = default;
};

struct Claim {
    Lease lease;
    std::string scene;
    bool alone = false;  ///< it took its worker along twice: no other frame is worked on with it
};

/// Numbers for the metrics.
struct JobCounts {
    std::int64_t batches = 0;
    std::int64_t unfinished_batches = 0;
    std::int64_t waiting_frames = 0;
    std::int64_t leased_frames = 0;
    std::uint64_t result_bytes = 0;
    double queue_age_s = 0;  ///< since the oldest unfinished batch was submitted
};

/// Safe from any thread. Every call is one transaction; what it has returned from survives the end
/// of the program and of the machine, but for leases, which the end of the machine may undo (their
/// frames are then ready, as they would be anyway).
///
/// All calls throw Error storage_full (there is no room) or batches_unavailable (the store cannot be
/// used now); then nothing has changed.
class JobStore {
public:
    JobStore() = default;
    virtual ~JobStore() = default;
    JobStore(const JobStore&) = delete;
    JobStore& operator=(const JobStore&) = delete;

    struct Submitted {
        std::string id;
        int total = 0;
        bool repeated = false;  ///< the key was there, with the same body: nothing was submitted
    };

    /// @throws Error key_reused (the key was there with another body), queue_full (as many unfinished
    ///         batches as may be)
    virtual Submitted submit(const NewBatch& batch) = 0;

    /// What submit() of this key and body would repeat; nothing where it would submit.
    /// @throws Error key_reused
    [[nodiscard]] virtual std::optional<Submitted> submitted(const std::string& key,
                                                             const std::string& body_hash) = 0;

    [[nodiscard]] virtual std::optional<BatchFacts> find(const std::string& id) = 0;

    /// Up to `limit` batches, newest first, of those with a place below `before`.
    [[nodiscard]] virtual std::vector<BatchFacts> list(std::size_t limit,
                                                       std::optional<std::int64_t> before) = 0;

    [[nodiscard]] virtual std::optional<FrameFacts> frame(const std::string& batch, int number) = 0;

    /// Up to `limit` frames from `first` on, by number.
    [[nodiscard]] virtual std::vector<FrameFacts> frames(const std::string& batch, int first,
                                                         std::size_t limit) = 0;

    /// All failed frames, by number.
    [[nodiscard]] virtual std::vector<FrameFacts> failed_frames(const std::string& batch) = 0;

    /// Up to `limit` events after the one with id `after`, in their order.
    [[nodiscard]] virtual std::vector<BatchEvent> events(const std::string& batch,
                                                         std::int64_t after, std::size_t limit) = 0;

    /// The next frame, for so long as a lease lasts: of the batches with the highest priority the
    /// oldest, of its frames the first that may run. Nothing while there is none, or while a frame is
    /// tried alone.
    [[nodiscard]] virtual std::optional<Claim> claim(const std::string& worker) = 0;

    /// Makes leases last from now on. @return those that are no longer held
    [[nodiscard]] virtual std::vector<Lease> renew(std::span<const Lease> leases) = 0;

    /// How a frame ended: with a result, or with a problem document.
    struct Ending {
        Lease lease;
        std::optional<FrameResult> result;
        std::string problem;
    };
    struct Ended {
        bool counted = false;   ///< false: the lease was no longer held, and nothing was changed
        bool finished = false;  ///< it was the last frame of its batch
    };

    /// Several at once cost hardly more than one.
    virtual std::vector<Ended> end(std::span<const Ending> endings) = 0;

    /// The frame may be claimed again at once; nothing is held against it.
    virtual void give_back(const Lease& lease) = 0;

    /// What has run out goes back, to be claimed after 1 s, then 4 s; the third time the frame has
    /// failed. @return the batches that changed
    virtual std::vector<std::string> reap() = 0;

    /// Failed frames are ready again. @return how many; nothing where there is no such batch
    virtual std::optional<int> retry_failed(const std::string& batch) = 0;

    /// Forgets a batch and its frames; leases of it are no longer held. @return whether it was there
    virtual bool remove(const std::string& batch) = 0;

    /// Finished batches, the one that was finished first in front: all that were finished before
    /// `age_ms` ago, and as many more as have to go so that results take `max_bytes` at most. They
    /// are still there.
    [[nodiscard]] virtual std::vector<std::string> expired(std::int64_t age_ms,
                                                           std::uint64_t max_bytes) = 0;

    /// Forgets keys of batches that are gone and were submitted before `age_ms` ago.
    virtual void forget_keys(std::int64_t age_ms) = 0;

    struct Unfinished {
        std::string batch;
        std::vector<std::string> images;
    };
    [[nodiscard]] virtual std::vector<Unfinished> unfinished() = 0;

    /// The names of all result files of a batch.
    [[nodiscard]] virtual std::set<std::string> result_files(const std::string& batch) = 0;

    [[nodiscard]] virtual JobCounts counts() = 0;
};

}  // namespace relit::server
