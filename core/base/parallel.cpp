#include "core/base/parallel.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/info.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>
#include <oneapi/tbb/task_group.h>

#include <atomic>
#include <optional>

#include "core/base/error.h"

namespace relit {

struct Executor::Arena {
    explicit Arena(int threads) : arena(threads) {
        // oneTBB starts no more threads than there are processors unless it is told that it may.
        if (threads > tbb::info::default_concurrency())
            more_threads.emplace(tbb::global_control::max_allowed_parallelism, threads);
    }
    std::optional<tbb::global_control> more_threads;
    tbb::task_arena arena;
};

Executor::Executor(int threads)
    : arena_(std::make_unique<Arena>(threads > 0 ? threads : tbb::info::default_concurrency())) {
    arena_->arena.initialize();
}

Executor::~Executor() = default;

int Executor::threads() const { return arena_->arena.max_concurrency(); }

void parallel_rows(const Executor& executor, int rows, const std::stop_token& stop,
                   const std::function<void(RowRange)>& body) {
    // One row a range: the cost of a row differs by a factor of ten with a raking light, and a
    // range's overhead (about a microsecond) is nothing beside a row.
    //
    // oneTBB orders what stands before, in and after the loop, but its library is not instrumented:
    // the two counters say so to ThreadSanitizer as well.
    std::atomic<int> begun = 0, done = 0;
    // Ranges are halved down to rows as they are come to: cancelled ones are left whole. Isolated, so
    // that a loop without a stop of its own runs to its end also within one that is stopped.
    tbb::task_group_context context(tbb::task_group_context::isolated);
    begun.store(1, std::memory_order_release);
    executor.arena_->arena.execute([&] {
        tbb::parallel_for(
            tbb::blocked_range<int>(0, rows, 1),
            [&](const tbb::blocked_range<int>& range) {
                (void)begun.load(std::memory_order_acquire);
                if (stop.stop_requested()) context.cancel_group_execution();
                else body({range.begin(), range.end()});
                done.fetch_add(1, std::memory_order_release);
            },
            tbb::simple_partitioner(), context);
    });
    (void)done.load(std::memory_order_acquire);
    if (stop.stop_requested()) throw Error(error_code::cancelled, "the render was cancelled");
}

}  // namespace relit
