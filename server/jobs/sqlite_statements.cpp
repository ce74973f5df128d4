#include "server/jobs/sqlite_statements.h"

#include <spdlog/spdlog.h>

#include <iterator>

#include "server/error_codes.h"

namespace relit::server {
namespace {

constexpr int table_version = 1;
constexpr StoreTime back_off_ms[] = {1'000, 4'000};  // after the first lost worker, the second
constexpr int worker_losses = 3;  // as many as are too many; one fewer, and the frame runs alone

// State: 0 ready, 1 leased, 2 done, 3 failed. `event` is that of a frame's end, counted by the
// batch, so that events have a place in one order without a table of their own.
constexpr const char* tables = R"sql(
CREATE TABLE batches (
    seq INTEGER PRIMARY KEY AUTOINCREMENT, id TEXT NOT NULL UNIQUE, priority INTEGER NOT NULL,
    total INTEGER NOT NULL, done INTEGER NOT NULL DEFAULT 0, failed INTEGER NOT NULL DEFAULT 0,
    created INTEGER NOT NULL, started INTEGER, finished INTEGER, bytes INTEGER NOT NULL DEFAULT 0,
    events INTEGER NOT NULL DEFAULT 0, end_event INTEGER);
CREATE INDEX unfinished ON batches(seq) WHERE finished IS NULL;
CREATE INDEX finished ON batches(finished) WHERE finished IS NOT NULL;
CREATE TABLE frames (
    batch INTEGER NOT NULL REFERENCES batches(seq) ON DELETE CASCADE, number INTEGER NOT NULL,
    priority INTEGER NOT NULL, name TEXT NOT NULL, state INTEGER NOT NULL DEFAULT 0,
    attempt INTEGER NOT NULL DEFAULT 0, losses INTEGER NOT NULL DEFAULT 0,
    run_at INTEGER NOT NULL, lease_end INTEGER, worker TEXT,
    file TEXT, size INTEGER, media_type TEXT, problem TEXT, event INTEGER, scene TEXT NOT NULL);
CREATE UNIQUE INDEX frame_numbers ON frames(batch, number);
CREATE INDEX ready ON frames(priority DESC, batch, number) WHERE state = 0;
CREATE INDEX leased ON frames(lease_end) WHERE state = 1;
CREATE INDEX failed ON frames(batch, number) WHERE state = 3;
CREATE INDEX frame_events ON frames(batch, event) WHERE event IS NOT NULL;
CREATE TABLE images (
    batch INTEGER NOT NULL REFERENCES batches(seq) ON DELETE CASCADE, image TEXT NOT NULL);
CREATE INDEX image_batches ON images(batch);
CREATE TABLE keys (
    key TEXT PRIMARY KEY, body_hash TEXT NOT NULL, id TEXT NOT NULL, total INTEGER NOT NULL,
    created INTEGER NOT NULL);
PRAGMA user_version = 1;
)sql";

// Counts a frame's end, and ends the batch with its last. @return whether it has ended
bool count_end(SqliteDatabase& database, std::int64_t batch, int number, FrameState state,
               std::uint64_t bytes) {
    const int done = state == FrameState::done ? 1 : 0;
    SqliteQuery(database,
                "UPDATE batches SET done = done + ?, failed = failed + ?, bytes = bytes + ?,"
                " events = events + 1 WHERE seq = ?",
                done, 1 - done, bytes, batch)
        .run();
    SqliteQuery(database,
                "UPDATE frames SET event = (SELECT events FROM batches WHERE seq = ?1)"
                " WHERE batch = ?1 AND number = ?2",
                batch, number)
        .run();
    return SqliteQuery(database,
                       "UPDATE batches SET finished = now_ms(), events = events + 1,"
                       " end_event = events + 1 WHERE seq = ? AND done + failed = total",
                       batch)
               .run() > 0;
}

struct LapsedLease {
    std::int64_t batch = 0;
    std::string batch_id;
    int number = 0;
    int losses = 0;  // this one included
};

std::vector<LapsedLease> lapsed_leases(SqliteDatabase& database, const std::string& except_run) {
    constexpr std::string_view columns_of_all =
        "SELECT frames.batch, batches.id, number, losses + 1 FROM frames"
        " JOIN batches ON batches.seq = frames.batch"
        " WHERE state = 1 AND CASE WHEN ?1 = '' THEN lease_end < now_ms()"
        " ELSE substr(worker, 1, length(?1)) <> ?1 END";
    SqliteQuery rows(database, columns_of_all, except_run);
    std::vector<LapsedLease> leases;
    while (rows.next())
        leases.push_back(
            {rows.integer(0), rows.text(1), int(rows.integer(2)), int(rows.integer(3))});
    return leases;
}

}  // namespace

void make_tables(SqliteDatabase& database) {
    std::int64_t version = 0;
    {
        SqliteQuery row(database, "PRAGMA user_version");
        if (row.next()) version = row.integer(0);
    }
    if (version == table_version) return;
    if (version != 0) {
        spdlog::error("batches: the database is of version {}, and this program knows {}", version,
                      table_version);
        throw Error(error_code::batches_unavailable,
                    "The server's batches are of another version of the program.");
    }
    SqliteTransaction transaction(database, SqliteTransaction::Kind::durable);
    database.execute(tables);
    transaction.commit();
}

void insert_batch(SqliteDatabase& database, const NewBatch& batch) {
    SqliteQuery(database,
                "INSERT INTO batches(id, priority, total, created) VALUES (?, ?, ?, now_ms())",
                batch.id, batch.priority, int(batch.frames.size()))
        .run();
    const std::int64_t place = place_of(database, batch.id).value();
    for (int number = 0; number < int(batch.frames.size()); ++number) {
        const NewFrame& frame = batch.frames[std::size_t(number)];
        SqliteQuery(database,
                    "INSERT INTO frames(batch, number, priority, name, run_at, scene)"
                    " VALUES (?, ?, ?, ?, 0, ?)",
                    place, number, batch.priority, frame.name, frame.scene)
            .run();
    }
    for (const std::string& image : batch.images)
        SqliteQuery(database, "INSERT INTO images VALUES (?, ?)", place, image).run();
    if (!batch.key.empty())
        SqliteQuery(database, "INSERT INTO keys VALUES (?, ?, ?, ?, now_ms())", batch.key,
                    batch.body_hash, batch.id, int(batch.frames.size()))
            .run();
}

BatchFacts facts_of(const SqliteQuery& row) {
    return {.place = row.integer(0),
            .id = row.text(1),
            .priority = int(row.integer(2)),
            .total = int(row.integer(3)),
            .done = int(row.integer(4)),
            .failed = int(row.integer(5)),
            .created = row.integer(6),
            .started = row.integer_or_null(7),
            .finished = row.integer_or_null(8),
            .result_bytes = std::uint64_t(row.integer(9)),
            .last_event = row.integer(10)};
}

FrameFacts frame_of(const SqliteQuery& row, int first_column) {
    const auto column = [&](int i) { return first_column + i; };
    return {.number = int(row.integer(column(0))),
            .name = row.text(column(1)),
            .state = FrameState(row.integer(column(2))),
            .result = {.file = row.text(column(3)),
                       .size_bytes = std::uint64_t(row.integer(column(4))),
                       .media_type = row.text(column(5))},
            .problem = row.text(column(6))};
}

std::optional<std::int64_t> place_of(SqliteDatabase& database, const std::string& id) {
    SqliteQuery row(database, "SELECT seq FROM batches WHERE id = ?", id);
    if (!row.next()) return std::nullopt;
    return row.integer(0);
}

std::optional<Claim> claim_next(SqliteDatabase& database, const std::string& worker,
                                StoreTime lease_ms) {
    int leased = 0, alone = 0;
    {
        SqliteQuery row(database, "SELECT count(*), sum(losses >= ?) FROM frames WHERE state = 1",
                        worker_losses - 1);
        row.next();
        leased = int(row.integer(0));
        alone = int(row.integer(1));
    }
    if (alone > 0) return std::nullopt;
    Claim claim;
    std::int64_t batch = 0;
    {
        SqliteQuery row(database,
                        "SELECT batch, number, attempt + 1, scene, losses >= ?,"
                        " (SELECT id FROM batches WHERE seq = batch) FROM frames"
                        " WHERE state = 0 AND run_at <= now_ms()"
                        " ORDER BY priority DESC, batch, number LIMIT 1",
                        worker_losses - 1);
        if (!row.next()) return std::nullopt;
        batch = row.integer(0);
        claim = {.lease = {row.text(5), int(row.integer(1)), int(row.integer(2)), worker},
                 .scene = row.text(3),
                 .alone = row.integer(4) != 0};
    }
    if (claim.alone && leased > 0) return std::nullopt;  // the next one, when these have ended
    SqliteQuery(database,
                "UPDATE frames SET state = 1, attempt = ?, worker = ?, lease_end = now_ms() + ?"
                " WHERE batch = ? AND number = ?",
                claim.lease.attempt, worker, lease_ms, batch, claim.lease.number)
        .run();
    SqliteQuery(database, "UPDATE batches SET started = now_ms() WHERE seq = ? AND started IS NULL",
                batch)
        .run();
    return claim;
}

std::vector<std::string> end_lapsed_leases(SqliteDatabase& database, const std::string& except_run,
                                           const std::string& worker_lost_problem) {
    std::set<std::string> changed;
    for (const LapsedLease& lease : lapsed_leases(database, except_run)) {
        const bool lost = lease.losses >= worker_losses;
        const auto pause =
            back_off_ms[std::min<std::size_t>(std::size_t(lease.losses), std::size(back_off_ms)) - 1];
        SqliteQuery(database,
                    "UPDATE frames SET state = ?, losses = ?, worker = NULL, lease_end = NULL,"
                    " run_at = now_ms() + ?, problem = CASE WHEN ? THEN ? END"
                    " WHERE batch = ? AND number = ?",
                    int(lost ? FrameState::failed : FrameState::ready), lease.losses, pause,
                    int(lost), worker_lost_problem, lease.batch, lease.number)
            .run();
        if (lost) count_end(database, lease.batch, lease.number, FrameState::failed, 0);
        changed.insert(lease.batch_id);
        spdlog::warn("batches: frame {} of {} lost its worker ({} times)", lease.number,
                     lease.batch_id, lease.losses);
    }
    return {changed.begin(), changed.end()};
}

JobStore::Ended end_frame(SqliteDatabase& database, const JobStore::Ending& ending) {
    const Lease& lease = ending.lease;
    const auto batch = place_of(database, lease.batch);
    if (!batch) return {};
    const FrameState state = ending.result ? FrameState::done : FrameState::failed;
    const FrameResult result = ending.result.value_or(FrameResult{});
    const int changed =
        SqliteQuery(database,
                    "UPDATE frames SET state = ?, file = nullif(?, ''), size = ?,"
                    " media_type = ?, problem = nullif(?, ''), worker = NULL, lease_end = NULL"
                    " WHERE batch = ? AND number = ? AND state = 1 AND attempt = ? AND worker = ?",
                    int(state), result.file, result.size_bytes, result.media_type, ending.problem,
                    *batch, lease.number, lease.attempt, lease.worker)
            .run();
    if (changed == 0) return {};
    return {.counted = true,
            .finished = count_end(database, *batch, lease.number, state, result.size_bytes)};
}

}  // namespace relit::server
