#include "server/jobs/sqlite_database.h"

#include <spdlog/spdlog.h>
#include <sqlite3.h>
#include <sys/stat.h>

#include <cerrno>
#include <utility>

#include "server/error_codes.h"

namespace relit::server {
namespace {

void now_ms(sqlite3_context* context, int, sqlite3_value**) {
    const auto* clock =
        static_cast<const std::function<std::int64_t()>*>(sqlite3_user_data(context));
    sqlite3_result_int64(context, (*clock)());
}

}  // namespace

SqliteDatabase::SqliteDatabase(const std::filesystem::path& path,
                               std::function<std::int64_t()> clock)
    : path_(path), clock_(std::move(clock)) {
    constexpr int flags = SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_NOMUTEX;
    try {
        if (sqlite3_open_v2(path.c_str(), &connection_, flags, nullptr) != SQLITE_OK) fail("open");
        sqlite3_extended_result_codes(connection_, 1);
        sqlite3_busy_timeout(connection_, 5000);
        if (sqlite3_create_function(connection_, "now_ms", 0, SQLITE_UTF8, &clock_, now_ms, nullptr,
                                    nullptr) != SQLITE_OK)
            fail("add a function");
        execute(
            "PRAGMA journal_mode = WAL");  // makes the file, or finds that it is none of SQLite's
        opened_file_ = file_number();
    } catch (...) {
        sqlite3_close_v2(connection_);
        throw;
    }
}

SqliteDatabase::~SqliteDatabase() {
    for (const auto& [sql, statement] : statements_) sqlite3_finalize(statement);
    sqlite3_close_v2(connection_);
}

void SqliteDatabase::execute(const char* sql) {
    if (sqlite3_exec(connection_, sql, nullptr, nullptr, nullptr) != SQLITE_OK) fail(sql);
}

// 0 where there is none.
std::uint64_t SqliteDatabase::file_number() const {
    struct stat status {};
    return ::stat(path_.c_str(), &status) == 0 ? std::uint64_t(status.st_ino) : 0;
}

bool SqliteDatabase::is_in_place() const { return file_number() == opened_file_; }

int SqliteDatabase::changes() const { return sqlite3_changes(connection_); }

sqlite3_stmt* SqliteDatabase::prepared(std::string_view sql) {
    sqlite3_stmt*& statement = statements_[sql];
    if (!statement &&
        sqlite3_prepare_v3(connection_, sql.data(), int(sql.size()), SQLITE_PREPARE_PERSISTENT,
                           &statement, nullptr) != SQLITE_OK)
        fail(sql);
    return statement;
}

void SqliteDatabase::fail(std::string_view doing) {
    const int code = sqlite3_extended_errcode(connection_);
    spdlog::error("batches: {}: {} ({})", doing.substr(0, 60), sqlite3_errmsg(connection_), code);
    const int reason = sqlite3_system_errno(connection_);
    if (code == SQLITE_FULL || reason == ENOSPC || reason == EDQUOT || reason == EFBIG)
        throw Error(error_code::storage_full, "There is no room left to keep batches.");
    // All but what passes by itself: a new connection finds what is there by then.
    broken_ = (code & 0xff) != SQLITE_BUSY && (code & 0xff) != SQLITE_NOMEM;
    throw Error(error_code::batches_unavailable,
                "The server cannot read or write its batches now.");
}

SqliteQuery::~SqliteQuery() {
    sqlite3_reset(statement_);
    sqlite3_clear_bindings(statement_);
}

bool SqliteQuery::next() {
    const int code = sqlite3_step(statement_);
    if (code != SQLITE_ROW && code != SQLITE_DONE) database_.fail(sqlite3_sql(statement_));
    return code == SQLITE_ROW;
}

int SqliteQuery::run() {
    while (next()) continue;
    return database_.changes();
}

bool SqliteQuery::is_null(int column) const {
    return sqlite3_column_type(statement_, column) == SQLITE_NULL;
}

std::int64_t SqliteQuery::integer(int column) const {
    return sqlite3_column_int64(statement_, column);
}

std::optional<std::int64_t> SqliteQuery::integer_or_null(int column) const {
    if (is_null(column)) return std::nullopt;
    return integer(column);
}

std::string SqliteQuery::text(int column) const {
    const auto* const text = sqlite3_column_text(statement_, column);
    if (!text) return {};
    return {reinterpret_cast<const char*>(text),
            std::size_t(sqlite3_column_bytes(statement_, column))};
}

void SqliteQuery::bind(std::int64_t value) { sqlite3_bind_int64(statement_, ++bound_, value); }

void SqliteQuery::bind(const std::string& value) {
    sqlite3_bind_text64(statement_, ++bound_, value.data(), value.size(), SQLITE_STATIC,
                        SQLITE_UTF8);
}

void SqliteQuery::bind(std::nullptr_t) { sqlite3_bind_null(statement_, ++bound_); }

SqliteTransaction::SqliteTransaction(SqliteDatabase& database, Kind kind) : database_(database) {
    database_.execute(kind == Kind::durable ? "PRAGMA synchronous = FULL"
                                            : "PRAGMA synchronous = NORMAL");
    database_.execute("BEGIN IMMEDIATE");
}

SqliteTransaction::~SqliteTransaction() {
    if (!open_) return;
    try {
        database_.execute("ROLLBACK");
    } catch (const Error&) {  // logged; SQLite has undone it already
    }
}

void SqliteTransaction::commit() {
    database_.execute("COMMIT");
    open_ = false;
}

}  // namespace relit::server
