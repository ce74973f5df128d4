#include "server/jobs/sqlite_job_store.h"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <limits>
#include <utility>

#include "server/error_codes.h"
#include "server/jobs/sqlite_statements.h"
#include "server/random_hex.h"

namespace relit::server {
namespace {

using Kind = SqliteTransaction::Kind;

StoreTime system_time_ms() {
    return std::chrono::duration_cast<std::chrono::milliseconds>(
               std::chrono::system_clock::now().time_since_epoch())
        .count();
}

SqliteJobStoreSettings with_a_clock(SqliteJobStoreSettings settings) {
    if (!settings.clock) settings.clock = system_time_ms;
    return settings;
}

Error unavailable() {
    return {error_code::batches_unavailable, "The server cannot read or write its batches now."};
}

void check_whole(SqliteDatabase& database) {
    SqliteQuery row(database, "PRAGMA quick_check(1)");
    if (row.next() && row.text(0) == "ok") return;
    spdlog::error("batches: the database is damaged; restore it from a copy, or move it away");
    throw unavailable();
}

std::vector<FrameFacts> frames_of(SqliteQuery& rows) {
    std::vector<FrameFacts> frames;
    while (rows.next()) frames.push_back(frame_of(rows));
    return frames;
}

std::optional<JobStore::Submitted> repeated(SqliteDatabase& database, const std::string& key,
                                            const std::string& body_hash) {
    if (key.empty()) return std::nullopt;
    SqliteQuery row(database, "SELECT id, total, body_hash FROM keys WHERE key = ?", key);
    if (!row.next()) return std::nullopt;
    if (row.text(2) != body_hash)
        throw Error(error_code::key_reused,
                    "The Idempotency-Key was used before, with another body.");
    return JobStore::Submitted{row.text(0), int(row.integer(1)), true};
}

}  // namespace

SqliteJobStore::SqliteJobStore(std::filesystem::path file, SqliteJobStoreSettings settings)
    : file_(std::move(file)),
      settings_(with_a_clock(std::move(settings))),
      run_(random_hex(2) + '/') {}

SqliteJobStore::~SqliteJobStore() = default;

// With writer_mutex_ locked.
void SqliteJobStore::open() {
    if (writer_ && writer_->is_in_place()) return;
    close();
    const StoreTime now = settings_.clock();
    if (open_failed_ && now >= *open_failed_ && now < *open_failed_ + 1000) throw unavailable();
    open_failed_ = now;
    std::error_code ignored;  // a folder that cannot be made is one that cannot be opened
    std::filesystem::create_directory(file_.parent_path(), ignored);
    auto database = std::make_unique<SqliteDatabase>(file_, settings_.clock);
    database->execute("PRAGMA foreign_keys = ON");
    database->execute("PRAGMA journal_size_limit = 67108864");
    check_whole(*database);
    make_tables(*database);
    {
        SqliteTransaction transaction(*database, Kind::durable);
        end_lapsed_leases(*database, run_, settings_.worker_lost_problem);
        transaction.commit();
    }
    const std::scoped_lock lock(reader_mutex_);
    reader_ = std::make_unique<SqliteDatabase>(file_, settings_.clock);
    writer_ = std::move(database);
    open_failed_.reset();
    open_ = true;
}

// With writer_mutex_ locked. Both at once: the last connection takes the log with it, which must not
// be found by another file that takes the place of this one.
void SqliteJobStore::close() {
    const std::scoped_lock lock(reader_mutex_);
    open_ = false;
    reader_.reset();
    writer_.reset();
}

template <class Work>
auto SqliteJobStore::writing(Kind kind, const Work& work) {
    const std::scoped_lock lock(writer_mutex_);
    open();
    try {
        SqliteTransaction transaction(*writer_, kind);
        auto result = work(*writer_);
        transaction.commit();
        return result;
    } catch (const Error&) {
        if (writer_->is_broken()) close();
        throw;
    }
}

template <class Work>
auto SqliteJobStore::reading(const Work& work) {
    if (!open_) {
        const std::scoped_lock lock(writer_mutex_);
        open();
    }
    try {
        const std::scoped_lock lock(reader_mutex_);
        if (!reader_) throw unavailable();  // closed meanwhile
        return work(*reader_);
    } catch (const Error&) {
        const std::scoped_lock lock(writer_mutex_);
        if (reader_ && reader_->is_broken()) close();
        throw;
    }
}

JobStore::Submitted SqliteJobStore::submit(const NewBatch& batch) {
    return writing(Kind::durable, [&](SqliteDatabase& database) {
        if (auto known = repeated(database, batch.key, batch.body_hash)) return *known;
        SqliteQuery row(database, "SELECT count(*) FROM batches WHERE finished IS NULL");
        row.next();
        if (row.integer(0) >= settings_.max_unfinished_batches)
            throw Error(
                error_code::queue_full,
                fmt::format("As many batches are unfinished as max-unfinished-batches allows, {}.",
                            settings_.max_unfinished_batches),
                "", "max-unfinished-batches");
        insert_batch(database, batch);
        return Submitted{batch.id, int(batch.frames.size()), false};
    });
}

std::optional<JobStore::Submitted> SqliteJobStore::submitted(const std::string& key,
                                                             const std::string& body_hash) {
    return reading([&](SqliteDatabase& database) { return repeated(database, key, body_hash); });
}

std::optional<BatchFacts> SqliteJobStore::find(const std::string& id) {
    return reading([&](SqliteDatabase& database) -> std::optional<BatchFacts> {
        SqliteQuery row(database, "SELECT " RELIT_BATCH_COLUMNS " FROM batches WHERE id = ?", id);
        if (!row.next()) return std::nullopt;
        return facts_of(row);
    });
}

std::vector<BatchFacts> SqliteJobStore::list(std::size_t limit,
                                             std::optional<std::int64_t> before) {
    return reading([&](SqliteDatabase& database) {
        SqliteQuery rows(
            database,
            "SELECT " RELIT_BATCH_COLUMNS " FROM batches WHERE seq < ? ORDER BY seq DESC LIMIT ?",
            before.value_or(std::numeric_limits<std::int64_t>::max()), std::int64_t(limit));
        std::vector<BatchFacts> batches;
        while (rows.next()) batches.push_back(facts_of(rows));
        return batches;
    });
}

std::optional<FrameFacts> SqliteJobStore::frame(const std::string& batch, int number) {
    auto found = frames(batch, number, 1);
    if (found.empty() || found.front().number != number) return std::nullopt;
    return std::move(found.front());
}

std::vector<FrameFacts> SqliteJobStore::frames(const std::string& batch, int first,
                                               std::size_t limit) {
    return reading([&](SqliteDatabase& database) {
        SqliteQuery rows(database,
                         "SELECT " RELIT_FRAME_COLUMNS
                         " FROM frames WHERE batch = (SELECT seq FROM batches WHERE id = ?)"
                         " AND number >= ? ORDER BY number LIMIT ?",
                         batch, first, std::int64_t(limit));
        return frames_of(rows);
    });
}

std::vector<FrameFacts> SqliteJobStore::failed_frames(const std::string& batch) {
    return reading([&](SqliteDatabase& database) {
        SqliteQuery rows(database,
                         "SELECT " RELIT_FRAME_COLUMNS
                         " FROM frames WHERE batch = (SELECT seq FROM batches WHERE id = ?)"
                         " AND state = 3 ORDER BY number",
                         batch);
        return frames_of(rows);
    });
}

std::vector<BatchEvent> SqliteJobStore::events(const std::string& batch, std::int64_t after,
                                               std::size_t limit) {
    return reading([&](SqliteDatabase& database) {
        // One query, so that it is one moment: the end comes after all frames.
        SqliteQuery rows(database,
                         "SELECT event, " RELIT_FRAME_COLUMNS
                         " FROM frames WHERE batch = (SELECT seq FROM batches WHERE id = ?1)"
                         " AND event > ?2 UNION ALL"
                         " SELECT end_event, NULL, NULL, NULL, NULL, NULL, NULL, NULL FROM batches"
                         " WHERE id = ?1 AND end_event > ?2 ORDER BY 1 LIMIT ?3",
                         batch, after, std::int64_t(limit));
        std::vector<BatchEvent> events;
        while (rows.next()) {
            BatchEvent& event = events.emplace_back();
            event.id = rows.integer(0);
            if (!rows.is_null(1)) event.frame = frame_of(rows, 1);
        }
        return events;
    });
}

std::optional<Claim> SqliteJobStore::claim(const std::string& worker) {
    return writing(Kind::quick, [&](SqliteDatabase& database) {
        return claim_next(database, run_ + worker, settings_.lease_ms);
    });
}

std::vector<Lease> SqliteJobStore::renew(std::span<const Lease> leases) {
    return writing(Kind::quick, [&](SqliteDatabase& database) {
        std::vector<Lease> gone;
        for (const Lease& lease : leases)
            if (SqliteQuery(database,
                            "UPDATE frames SET lease_end = now_ms() + ?"
                            " WHERE batch = (SELECT seq FROM batches WHERE id = ?) AND number = ?"
                            " AND state = 1 AND attempt = ? AND worker = ?",
                            settings_.lease_ms, lease.batch, lease.number, lease.attempt,
                            lease.worker)
                    .run() == 0)
                gone.push_back(lease);
        return gone;
    });
}

std::vector<JobStore::Ended> SqliteJobStore::end(std::span<const Ending> endings) {
    return writing(Kind::durable, [&](SqliteDatabase& database) {
        std::vector<Ended> ended;
        for (const Ending& ending : endings) ended.push_back(end_frame(database, ending));
        return ended;
    });
}

void SqliteJobStore::give_back(const Lease& lease) {
    writing(Kind::quick, [&](SqliteDatabase& database) {
        return SqliteQuery(database,
                           "UPDATE frames SET state = 0, worker = NULL, lease_end = NULL"
                           " WHERE batch = (SELECT seq FROM batches WHERE id = ?) AND number = ?"
                           " AND state = 1 AND attempt = ? AND worker = ?",
                           lease.batch, lease.number, lease.attempt, lease.worker)
            .run();
    });
}

std::vector<std::string> SqliteJobStore::reap() {
    return writing(Kind::durable, [&](SqliteDatabase& database) {
        return end_lapsed_leases(database, "", settings_.worker_lost_problem);
    });
}

std::optional<int> SqliteJobStore::retry_failed(const std::string& batch) {
    return writing(Kind::durable, [&](SqliteDatabase& database) -> std::optional<int> {
        const auto place = place_of(database, batch);
        if (!place) return std::nullopt;
        const int count = SqliteQuery(database,
                                      "UPDATE frames SET state = 0, losses = 0, run_at = 0,"
                                      " problem = NULL, event = NULL WHERE batch = ? AND state = 3",
                                      *place)
                              .run();
        if (count > 0)
            SqliteQuery(database,
                        "UPDATE batches SET failed = 0, finished = NULL, end_event = NULL"
                        " WHERE seq = ?",
                        *place)
                .run();
        return count;
    });
}

bool SqliteJobStore::remove(const std::string& batch) {
    return writing(Kind::durable, [&](SqliteDatabase& database) {
        return SqliteQuery(database, "DELETE FROM batches WHERE id = ?", batch).run() > 0;
    });
}

std::vector<std::string> SqliteJobStore::expired(std::int64_t age_ms, std::uint64_t max_bytes) {
    return reading([&](SqliteDatabase& database) {
        std::uint64_t bytes = 0;
        {
            SqliteQuery sum(database, "SELECT total(bytes) FROM batches");
            if (sum.next()) bytes = std::uint64_t(sum.integer(0));
        }
        SqliteQuery rows(database,
                         "SELECT id, bytes, finished + ? <= now_ms() FROM batches"
                         " WHERE finished IS NOT NULL ORDER BY finished, seq",
                         age_ms);
        std::vector<std::string> ids;
        while (rows.next() && (rows.integer(2) != 0 || bytes > max_bytes)) {
            ids.push_back(rows.text(0));
            bytes -= std::uint64_t(rows.integer(1));
        }
        return ids;
    });
}

void SqliteJobStore::forget_keys(std::int64_t age_ms) {
    writing(Kind::durable, [&](SqliteDatabase& database) {
        return SqliteQuery(database,
                           "DELETE FROM keys WHERE created + ? <= now_ms()"
                           " AND id NOT IN (SELECT id FROM batches)",
                           age_ms)
            .run();
    });
}

std::vector<JobStore::Unfinished> SqliteJobStore::unfinished() {
    return reading([&](SqliteDatabase& database) {
        SqliteQuery rows(database,
                         "SELECT batches.id, image FROM batches"
                         " LEFT JOIN images ON images.batch = batches.seq"
                         " WHERE finished IS NULL ORDER BY batches.seq");
        std::vector<Unfinished> batches;
        while (rows.next()) {
            if (batches.empty() || batches.back().batch != rows.text(0))
                batches.push_back({rows.text(0), {}});
            if (!rows.is_null(1)) batches.back().images.push_back(rows.text(1));
        }
        return batches;
    });
}

std::set<std::string> SqliteJobStore::result_files(const std::string& batch) {
    return reading([&](SqliteDatabase& database) {
        SqliteQuery rows(database,
                         "SELECT DISTINCT file FROM frames WHERE file IS NOT NULL"
                         " AND batch = (SELECT seq FROM batches WHERE id = ?)",
                         batch);
        std::set<std::string> files;
        while (rows.next()) files.insert(rows.text(0));
        return files;
    });
}

JobCounts SqliteJobStore::counts() {
    return reading([&](SqliteDatabase& database) {
        JobCounts counts;
        SqliteQuery all(database, "SELECT count(*), total(bytes) FROM batches");
        all.next();
        counts.batches = all.integer(0);
        counts.result_bytes = std::uint64_t(all.integer(1));
        SqliteQuery leased(database, "SELECT count(*) FROM frames WHERE state = 1");
        leased.next();
        counts.leased_frames = leased.integer(0);
        SqliteQuery open(database,
                         "SELECT count(*), total(total - done - failed),"
                         " max(0, now_ms() - min(created)) FROM batches WHERE finished IS NULL");
        open.next();
        counts.unfinished_batches = open.integer(0);
        counts.waiting_frames = open.integer(1) - counts.leased_frames;
        counts.queue_age_s = 1e-3 * double(open.integer(2));
        return counts;
    });
}

}  // namespace relit::server
