// Everything that batches are made of, put together: the store, the files of their pictures, the workers
// and who watches them. For the routes of batches.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "core/base/shared_cache.h"
#include "core/base/simd.h"
#include "server/decoding/image_decoder.h"
#include "server/jobs/batch_news.h"
#include "server/jobs/batch_runner.h"
#include "server/jobs/render_slots.h"
#include "server/jobs/sqlite_job_store.h"
#include "server/jobs/stream_slots.h"
#include "server/limits.h"
#include "server/metrics.h"
#include "server/storage/image_store.h"
#include "server/storage/result_files.h"

namespace relit::server {

/// What the workers use of the server. All of it must outlive the batches.
struct BatchNeeds {
    ImageStore& images;
    ImageDecoder decoder;
    SharedCache& cache;
    RenderSlots& renders;  ///< while these are used, batches take their share only
    Metrics& metrics;
    const Limits& limits;
    int threads = 1;  ///< of the machine, for all frames together
    Simd simd = best_simd();
};

/// Images in use: none of them is evicted while this is there.
using HeldImages = std::map<std::string, SharedBytes>;

class Batches {
public:
    /// @param folder  of the database and the pictures; made when there is a first batch
    Batches(const std::filesystem::path& folder, const BatchNeeds& needs);
    ~Batches();
    Batches(const Batches&) = delete;
    Batches& operator=(const Batches&) = delete;

    /// Goes on with what was not finished, in the background.
    void start();
    void drain() { runner_.drain(); }
    void stop() { runner_.stop(); }

    /// Marks a key as that of a submission under way.
    class KeyInUse {
    public:
        /// @throws Error conflict: it is one already
        KeyInUse(Batches& batches, std::string key);
        ~KeyInUse();
        KeyInUse(const KeyInUse&) = delete;
        KeyInUse& operator=(const KeyInUse&) = delete;

    private:
        Batches& batches_;
        std::string key_;
    };

    /// @param images  those that its frames name; held until it is finished or removed
    /// @throws Error as JobStore::submit()
    JobStore::Submitted submit(const NewBatch& batch, HeldImages images);

    /// @throws Error not_found
    void remove(const std::string& id);
    void retry(const std::string& id);
    [[nodiscard]] BatchFacts find(const std::string& id);

    JobStore& store() { return store_; }
    /// The bytes of a frame's picture, mapped.
    /// @throws Error not_found: its batch was removed meanwhile, or somebody else removed its file (logged)
    [[nodiscard]] SharedBytes picture(const std::string& batch, const std::string& file);
    BatchNews& news() { return news_; }
    StreamSlots& streams() { return streams_; }

    [[nodiscard]] static std::string new_id();

private:
    void hold_images_of_unfinished(const std::string& only);
    void changed(const std::string& batch, bool finished);

    const BatchNeeds needs_;
    SqliteJobStore store_;
    ResultFiles results_;
    BatchNews news_;
    StreamSlots streams_;
    std::mutex mutex_;
    std::set<std::string> keys_in_use_;
    std::map<std::string, HeldImages> images_;  // of unfinished batches
    BatchRunner runner_;                        // the first to go: it uses all the others
};

}  // namespace relit::server
