// The tables of sqlite_job_store.cpp, and the steps that its calls are made of. Within a transaction
// of the caller's.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "server/jobs/job_store.h"
#include "server/jobs/sqlite_database.h"

namespace relit::server {

/// Makes the tables where there are none.
/// @throws Error batches_unavailable where they are of another version of the program
void make_tables(SqliteDatabase& database);

void insert_batch(SqliteDatabase& database, const NewBatch& batch);

/// Columns of the queries that `facts_of` and `frame_of` read.
#define RELIT_BATCH_COLUMNS \
    "seq, id, priority, total, done, failed, created, started, finished, bytes, events"
#define RELIT_FRAME_COLUMNS "number, name, state, file, size, media_type, problem"
[[nodiscard]] BatchFacts facts_of(const SqliteQuery& row);
[[nodiscard]] FrameFacts frame_of(const SqliteQuery& row, int first_column = 0);

[[nodiscard]] std::optional<std::int64_t> place_of(SqliteDatabase& database, const std::string& id);

[[nodiscard]] std::optional<Claim> claim_next(SqliteDatabase& database, const std::string& worker,
                                              StoreTime lease_ms);

/// Ends leases whose time is over.
/// @param except_run  empty: those that ran out; otherwise those of all other runs
/// @return the batches that changed
std::vector<std::string> end_lapsed_leases(SqliteDatabase& database, const std::string& except_run,
                                           const std::string& worker_lost_problem);

[[nodiscard]] JobStore::Ended end_frame(SqliteDatabase& database, const JobStore::Ending& ending);

}  // namespace relit::server
