#include "server/jobs/batch_news.h"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>
#include <vector>

namespace relit::server {
namespace {

using namespace std::chrono_literals;

TEST(BatchNews, AWatchHearsOfWhatWasThereBeforeItAndOfEveryChangeSince) {
    BatchNews news;
    news.announce("a");
    BatchNews::Watch watch(news, "a");
    EXPECT_TRUE(watch.wait(0ms, {})) << "once, to look at what is there";
    EXPECT_FALSE(watch.wait(0ms, {}));
    news.announce("b");
    EXPECT_FALSE(watch.wait(0ms, {})) << "of another batch";
    news.announce("a");
    news.announce("a");
    EXPECT_TRUE(watch.wait(0ms, {}));
    EXPECT_FALSE(watch.wait(0ms, {})) << "both at once";
}

TEST(BatchNews, AStopEndsTheWait) {
    BatchNews news;
    BatchNews::Watch watch(news, "a");
    (void)watch.wait(0ms, {});
    std::stop_source stop;
    const auto begin = std::chrono::steady_clock::now();
    std::jthread stopping([&] {
        std::this_thread::sleep_for(20ms);
        stop.request_stop();
    });
    EXPECT_FALSE(watch.wait(60s, stop.get_token()));
    EXPECT_LT(std::chrono::steady_clock::now() - begin, 30s);
}

// What is counted before it is announced is seen by everybody who waits for it.
TEST(BatchNews, ManyWatchesMissNothing) {
    constexpr int last = 2000;
    BatchNews news;
    std::atomic<int> happened = 0;
    std::atomic<int> saw_the_end = 0;
    std::vector<std::jthread> watching;
    for (int i = 0; i < 8; ++i)
        watching.emplace_back([&] {
            BatchNews::Watch watch(news, "a");
            while (watch.wait(30s, {}))
                if (happened == last) {
                    ++saw_the_end;
                    return;
                }
        });
    for (int i = 0; i < last; ++i) {
        ++happened;
        news.announce("a");
    }
    for (std::jthread& thread : watching) thread.join();
    EXPECT_EQ(saw_the_end, 8);
}

}  // namespace
}  // namespace relit::server
