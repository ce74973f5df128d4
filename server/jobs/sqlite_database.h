// SQLite as this program uses it: a connection with its prepared statements, queries whose values
// are bound, transactions that end with their scope. For sqlite_job_store.cpp.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>

struct sqlite3;
struct sqlite3_stmt;

namespace relit::server {

/// One connection; one thread at a time.
///
/// What goes wrong is an Error: storage_full where there is no room, otherwise batches_unavailable;
/// the log has the reason.
class SqliteDatabase {
public:
    /// @param clock  what now_ms() is in queries, asked once for each call
    SqliteDatabase(const std::filesystem::path& path, std::function<std::int64_t()> clock);
    ~SqliteDatabase();
    SqliteDatabase(const SqliteDatabase&) = delete;
    SqliteDatabase& operator=(const SqliteDatabase&) = delete;

    /// Runs statements that return nothing, or whose rows nobody wants.
    void execute(const char* sql);

    /// Rows changed by the last statement.
    [[nodiscard]] int changes() const;

    /// Whether the file is damaged, or no longer what it was: the connection is of no more use.
    [[nodiscard]] bool is_broken() const { return broken_; }

    /// Whether the file is still where it was opened, and no other one.
    [[nodiscard]] bool is_in_place() const;

private:
    friend class SqliteQuery;
    sqlite3_stmt* prepared(std::string_view sql);
    [[noreturn]] void fail(std::string_view doing);

    [[nodiscard]] std::uint64_t file_number() const;

    sqlite3* connection_ = nullptr;
    const std::filesystem::path path_;
    std::function<std::int64_t()> clock_;
    std::unordered_map<std::string_view, sqlite3_stmt*> statements_;  // by text of our own
    std::uint64_t opened_file_ = 0;                                   // its number
    bool broken_ = false;
};

/// One use of a prepared statement, with its values.
class SqliteQuery {
public:
    /// @param sql  a literal: statements are kept by it
    template <class... Values>
    SqliteQuery(SqliteDatabase& database, std::string_view sql, const Values&... values)
        : database_(database), statement_(database.prepared(sql)) {
        (bind(values), ...);
    }
    ~SqliteQuery();
    SqliteQuery(const SqliteQuery&) = delete;
    SqliteQuery& operator=(const SqliteQuery&) = delete;

    /// The next row, if there is one.
    bool next();

    /// Runs it to its end. @return the rows that it changed
    int run();

    [[nodiscard]] bool is_null(int column) const;
    [[nodiscard]] std::int64_t integer(int column) const;
    [[nodiscard]] std::optional<std::int64_t> integer_or_null(int column) const;
    [[nodiscard]] std::string text(int column) const;

private:
    void bind(std::int64_t value);
    void bind(int value) { bind(std::int64_t(value)); }
    void bind(std::uint64_t value) { bind(std::int64_t(value)); }
    void bind(const std::string& value);  // must outlive the query
    void bind(std::nullptr_t);

    SqliteDatabase& database_;
    sqlite3_stmt* statement_;
    int bound_ = 0;
};

/// Undone unless it is committed.
class SqliteTransaction {
public:
    enum class Kind {
        durable,  ///< survives the end of the machine
        quick,    ///< survives the end of the program
    };
    SqliteTransaction(SqliteDatabase& database, Kind kind);
    ~SqliteTransaction();
    SqliteTransaction(const SqliteTransaction&) = delete;
    SqliteTransaction& operator=(const SqliteTransaction&) = delete;
    void commit();

private:
    SqliteDatabase& database_;
    bool open_ = true;
};

}  // namespace relit::server
