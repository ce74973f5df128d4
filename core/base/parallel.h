// Rows of an image in parallel, for every loop over a map or a picture. Serial or parallel is the
// executor's business: loop bodies see a range of rows and nothing of threads. oneTBB is behind it
// and included nowhere else.
#pragma once

#include <functional>
#include <memory>
#include <stop_token>

namespace relit {

/// Rows begin <= y < end.
struct RowRange {
    int begin = 0;
    int end = 0;
};

/// Threads that work on rows: made once and shared, from any thread, by everything that renders.
class Executor {
public:
    /// @param threads  how many threads work at most, the caller included; 0 = one per processor
    explicit Executor(int threads = 0);
    ~Executor();
    Executor(const Executor&) = delete;
    Executor& operator=(const Executor&) = delete;

    [[nodiscard]] int threads() const;

private:
    friend void parallel_rows(const Executor&, int, const std::stop_token&,
                              const std::function<void(RowRange)>&);
    struct Arena;
    std::unique_ptr<Arena> arena_;
};

/// Calls `body` on ranges that together cover rows 0..rows-1, each row once, in no order, and
/// returns when all are done. Which thread takes which rows is not fixed, so `body` must compute
/// every row from its inputs alone.
///
/// @param stop  looked at once per range; when set, the ranges not yet begun are left out
/// @throws Error cancelled (after `stop`); what `body` throws
void parallel_rows(const Executor& executor, int rows, const std::stop_token& stop,
                   const std::function<void(RowRange)>& body);

}  // namespace relit
