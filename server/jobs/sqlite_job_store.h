// Batches in a SQLite database of their own (write-ahead log; synchronous for everything but
// leases): no server to run, and as durable as the disk. One process at a time.
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>

#include "server/jobs/job_store.h"
#include "server/jobs/sqlite_database.h"

namespace relit::server {

struct SqliteJobStoreSettings {
    std::function<StoreTime()> clock = {};  ///< none: the system's
    StoreTime lease_ms = 30'000;
    int max_unfinished_batches = 10'000;
    std::string worker_lost_problem = "{}";  ///< of a frame that took its worker along three times
};

/// Opens the database when it is first asked for something; again after a failure, and when another
/// file has taken its place, at most once a second where that fails: it may have been put right. Whoever
/// held a lease in another run of the program is gone: such leases end when the database is opened.
class SqliteJobStore final : public JobStore {
public:
    /// @param file  made where it is missing, its folder too, but not what that is in: a data folder that
    ///              is gone is not to come back empty. Others lie beside it (-wal, -shm)
    explicit SqliteJobStore(std::filesystem::path file, SqliteJobStoreSettings settings = {});
    ~SqliteJobStore() override;

    Submitted submit(const NewBatch& batch) override;
    std::optional<Submitted> submitted(const std::string& key,
                                       const std::string& body_hash) override;
    std::optional<BatchFacts> find(const std::string& id) override;
    std::vector<BatchFacts> list(std::size_t limit, std::optional<std::int64_t> before) override;
    std::optional<FrameFacts> frame(const std::string& batch, int number) override;
    std::vector<FrameFacts> frames(const std::string& batch, int first, std::size_t limit) override;
    std::vector<FrameFacts> failed_frames(const std::string& batch) override;
    std::vector<BatchEvent> events(const std::string& batch, std::int64_t after,
                                   std::size_t limit) override;
    std::optional<Claim> claim(const std::string& worker) override;
    std::vector<Lease> renew(std::span<const Lease> leases) override;
    std::vector<Ended> end(std::span<const Ending> endings) override;
    void give_back(const Lease& lease) override;
    std::vector<std::string> reap() override;
    std::optional<int> retry_failed(const std::string& batch) override;
    bool remove(const std::string& batch) override;
    std::vector<std::string> expired(std::int64_t age_ms, std::uint64_t max_bytes) override;
    void forget_keys(std::int64_t age_ms) override;
    std::vector<Unfinished> unfinished() override;
    std::set<std::string> result_files(const std::string& batch) override;
    JobCounts counts() override;

private:
    void open();
    void close();
    template <class Work>
    auto writing(SqliteTransaction::Kind kind, const Work& work);
    template <class Work>
    auto reading(const Work& work);

    const std::filesystem::path file_;
    const SqliteJobStoreSettings settings_;
    const std::string run_;  // of the program; leases of others are of no one

    // Writers do not wait for readers, nor readers for writers. Who takes both takes them in this order.
    std::mutex writer_mutex_;
    std::unique_ptr<SqliteDatabase> writer_;
    std::optional<StoreTime> open_failed_;  // when
    std::atomic<bool> open_{false};
    std::mutex reader_mutex_;
    std::unique_ptr<SqliteDatabase> reader_;
};

}  // namespace relit::server
