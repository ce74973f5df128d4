#include "core/base/parallel.h"

#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>
#include <vector>

#include "core/base/error.h"

namespace relit::test {
namespace {

TEST(ParallelRows, AreEachCalledOnce) {
    for (const int threads : {1, 2, 5}) {
        const Executor executor(threads);
        std::vector<std::atomic<int>> calls(1001);
        parallel_rows(executor, int(calls.size()), {}, [&](RowRange rows) {
            for (int y = rows.begin; y < rows.end; ++y) ++calls[std::size_t(y)];
        });
        for (std::size_t y = 0; y < calls.size(); ++y) ASSERT_EQ(calls[y], 1) << y;
    }
}

TEST(ParallelRows, ThatHaveNotBegunAreLeftOutAfterAStop) {
    const Executor executor(2);
    std::stop_source source;
    std::atomic<int> begun = 0;
    EXPECT_THROW(parallel_rows(executor, 1'000'000, source.get_token(),
                               [&](RowRange) {
                                   ++begun;
                                   source.request_stop();
                               }),
                 Error);
    EXPECT_LE(begun, executor.threads());
}

// What is made within one request may be for others too, and they have not been cancelled.
TEST(ParallelRows, OfALoopWithinAStoppedOneAreAllCalled) {
    const Executor executor(2);
    std::stop_source source;
    std::atomic<int> loops = 0, rows_within = 0;
    EXPECT_THROW(parallel_rows(executor, 100, source.get_token(),
                               [&](RowRange) {
                                   source.request_stop();
                                   ++loops;
                                   parallel_rows(executor, 1000, {}, [&](RowRange rows) {
                                       rows_within += rows.end - rows.begin;
                                   });
                               }),
                 Error);
    EXPECT_GE(loops, 1);
    EXPECT_EQ(rows_within, 1000 * loops);
}

TEST(ParallelRows, GiveOnWhatTheirBodyThrows) {
    const Executor executor(2);
    EXPECT_THROW(parallel_rows(executor, 1000, {},
                               [](RowRange rows) {
                                   if (rows.begin == 500) throw std::runtime_error("500");
                               }),
                 std::runtime_error);
}

}  // namespace
}  // namespace relit::test
