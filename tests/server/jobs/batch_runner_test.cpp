// Workers over a real store, with pictures that take no rendering.
#include "server/jobs/batch_runner.h"

#include <gtest/gtest.h>

#include <atomic>
#include <fstream>
#include <set>
#include <thread>

#include "server/error_codes.h"
#include "server/jobs/sqlite_job_store.h"
#include "tests/support/temporary_folder.h"

namespace relit::server {
namespace {

using namespace std::chrono_literals;
using test::TemporaryFolder;

bool comes_true(const std::function<bool()>& condition, std::chrono::milliseconds patience = 10s) {
    const auto deadline = std::chrono::steady_clock::now() + patience;
    while (!condition()) {
        if (std::chrono::steady_clock::now() > deadline) return false;
        std::this_thread::sleep_for(2ms);
    }
    return true;
}

class BatchRunnerTest : public testing::Test {
protected:
    // "sleep" renders until it is stopped, "fail" fails, everything else is its own picture.
    RenderedFrame rendered(const std::string& scene, const std::stop_token& stop) {
        ++begun;
        if (scene == "fail") throw Error(error_code::image_broken, "broken", "/height");
        if (scene == "large") throw Error(error_code::image_too_large, "large", {}, "max-lights");
        if (scene == "crash") throw std::runtime_error("not for clients");
        while (scene == "sleep" && !stop.stop_requested()) std::this_thread::sleep_for(1ms);
        if (stop.stop_requested()) throw Error(error_code::cancelled, "stopped");
        return {"picture of " + scene, "image/png"};
    }
    BatchRunnerSettings settings() {
        return {.workers = 2,
                .busy_workers = 1,
                .renderer =
                    [this] {
                        return [this](const std::string& scene, const std::stop_token& stop) {
                            return rendered(scene, stop);
                        };
                    },
                .is_busy = [this] { return busy.load(); },
                .changed = [this](const std::string&, bool finished) { ends += finished ? 1 : 0; },
                .problem = [](const Error& error) { return std::string(error.code); }};
    }
    void submit(const std::string& id, const std::vector<std::string>& scenes) {
        NewBatch batch{.id = id, .frames = {}, .images = {}, .key = {}, .body_hash = {}};
        for (const std::string& scene : scenes)
            batch.frames.push_back({std::to_string(batch.frames.size()), scene});
        store.submit(batch);
    }
    bool finishes(const std::string& id) {
        return comes_true([&] { return store.find(id)->finished.has_value(); });
    }
    std::size_t files_of(const std::string& batch) {
        const auto path = folder.path() / "results" / batch;
        if (!std::filesystem::exists(path)) return 0;
        return std::size_t(std::distance(std::filesystem::directory_iterator(path), {}));
    }

    TemporaryFolder folder;
    SqliteJobStore store{folder.path() / "batches.db"};
    ResultFiles results{folder.path()};
    std::atomic<int> begun{0}, ends{0};
    std::atomic<bool> busy{false};
};

TEST_F(BatchRunnerTest, EveryFrameHasItsPictureOrItsProblem) {
    submit("a", {"one", "fail", "two", "crash", "one"});
    BatchRunner runner(store, results, settings());
    runner.start();
    ASSERT_TRUE(finishes("a"));
    const auto frames = store.frames("a", 0, 10);
    EXPECT_EQ(results.get("a", frames[0].result.file).bytes, "picture of one");
    EXPECT_EQ(results.get("a", frames[2].result.file).bytes, "picture of two");
    EXPECT_EQ(results.get("a", frames[4].result.file).bytes, "picture of one");
    EXPECT_EQ(frames[1].problem, error_code::image_broken);
    EXPECT_EQ(frames[3].problem, error_code::internal);
    EXPECT_TRUE(std::filesystem::is_empty(folder.path() / "incoming"));
    EXPECT_TRUE(comes_true([&] { return ends == 1; }));
    EXPECT_EQ(begun, 5) << "each was rendered once";
}

TEST_F(BatchRunnerTest, StoppingGivesBackWhatIsUnderWayAndHoldsNothingAgainstIt) {
    submit("a", {"sleep", "sleep", "sleep"});
    {
        BatchRunner runner(store, results, settings());
        runner.start();
        ASSERT_TRUE(comes_true([&] { return begun == 2; }));
        runner.stop();
    }
    for (const FrameFacts& frame : store.frames("a", 0, 10))
        EXPECT_EQ(frame.state, FrameState::ready) << frame.number;
    EXPECT_EQ(store.claim("w")->lease.number, 0) << "at once, without a pause";
}

TEST_F(BatchRunnerTest, DrainingBeginsNothingMore) {
    submit("a", {"sleep", "one", "one"});
    auto one_worker = settings();
    one_worker.workers = 1;
    BatchRunner runner(store, results, one_worker);
    runner.start();
    ASSERT_TRUE(comes_true([&] { return begun == 1; }));
    runner.drain();
    runner.stop();
    EXPECT_EQ(begun, 1);
}

TEST_F(BatchRunnerTest, ARemovedBatchStopsItsFramesAndLeavesNoFiles) {
    submit("a", {"one", "sleep"});
    BatchRunner runner(store, results, settings());
    runner.start();
    ASSERT_TRUE(comes_true([&] { return store.find("a")->done == 1 && begun == 2; }));
    EXPECT_TRUE(store.remove("a"));
    runner.abandon("a");
    results.remove("a");
    submit("b", {"two", "two"});
    runner.wake();
    EXPECT_TRUE(finishes("b")) << "both workers go on";
    EXPECT_EQ(files_of("a"), 0u);
}

TEST_F(BatchRunnerTest, AFrameThatTakesTooLongFails) {
    submit("a", {"sleep"});
    auto hasty = settings();
    hasty.frame_timeout = 50ms;
    BatchRunner runner(store, results, hasty);
    runner.start();
    ASSERT_TRUE(finishes("a"));
    EXPECT_EQ(store.frame("a", 0)->problem, error_code::timed_out);
}

TEST_F(BatchRunnerTest, WhileRequestsAreRenderedOnlyItsShareGoesOn) {
    busy = true;
    submit("a", {"sleep", "sleep"});
    BatchRunner runner(store, results, settings());
    runner.start();
    ASSERT_TRUE(comes_true([&] { return begun == 1; }));
    std::this_thread::sleep_for(100ms);
    EXPECT_EQ(begun, 1) << "one of two workers";
    busy = false;
    EXPECT_TRUE(comes_true([&] { return begun == 2; }));
}

// A file where the folder of results should be stands for a disk that does not take them.
TEST_F(BatchRunnerTest, WhatCannotBeStoredIsKeptAndStoredWhenItCan) {
    submit("a", {"one"});
    std::ofstream(folder.path() / "incoming") << "in the way";
    BatchRunner runner(store, results, settings());
    runner.start();
    ASSERT_TRUE(comes_true([&] { return begun == 1; }));
    std::this_thread::sleep_for(100ms);
    EXPECT_EQ(store.frame("a", 0)->state, FrameState::leased);
    std::filesystem::remove(folder.path() / "incoming");
    ASSERT_TRUE(finishes("a"));
    EXPECT_EQ(store.frame("a", 0)->state, FrameState::done);
    EXPECT_EQ(begun, 1) << "rendered once";
}

TEST_F(BatchRunnerTest, OrphansOfTheLastRunAreSweptAndNothingElse) {
    submit("a", {"one"});
    {
        BatchRunner runner(store, results, settings());
        runner.start();
        ASSERT_TRUE(finishes("a"));
    }
    const ResultFiles::NewPicture orphans[] = {{"a", "never named"}, {"gone", "of no batch"}};
    (void)results.put(orphans);
    std::ofstream(folder.path() / "incoming" / "XXabcd") << "half";
    submit("b", {"two"});
    BatchRunner runner(store, results, settings());
    runner.start();
    ASSERT_TRUE(finishes("b"));
    EXPECT_EQ(files_of("a"), 1u);
    EXPECT_EQ(results.get("a", store.frame("a", 0)->result.file).bytes, "picture of one");
    EXPECT_FALSE(std::filesystem::exists(folder.path() / "results" / "gone"));
    EXPECT_TRUE(std::filesystem::is_empty(folder.path() / "incoming"));
}

TEST_F(BatchRunnerTest, ExpiredBatchesGoWithTheirFiles) {
    submit("a", {"one"});
    submit("b", {"sleep"});
    auto forgetful = settings();
    forgetful.expiry = 1ms;
    BatchRunner runner(store, results, forgetful);
    runner.start();
    EXPECT_TRUE(comes_true([&] { return !store.find("a"); }));
    EXPECT_TRUE(comes_true([&] { return files_of("a") == 0; }));
    EXPECT_TRUE(store.find("b")) << "unfinished ones stay";
}

TEST_F(BatchRunnerTest, FramesAreCountedWithTheLimitThatTheyFailedBecauseOf) {
    auto counting = settings();
    std::multiset<std::string> ended;  // told by one thread, the keeper
    counting.counted = [&](bool done, std::string_view limit) {
        ended.insert((done ? "done " : "failed ") + std::string(limit));
    };
    counting.frame_timeout = 50ms;
    submit("a", {"one", "large", "fail", "sleep"});
    BatchRunner runner(store, results, counting);
    runner.start();
    ASSERT_TRUE(finishes("a"));
    runner.stop();
    EXPECT_EQ(ended, (std::multiset<std::string>{"done ", "failed ", "failed max-lights",
                                                 "failed batch-frame-timeout"}));
}

TEST_F(BatchRunnerTest, FinishedBatchesMakeRoomForNewOnesAndWithoutRoomFramesFail) {
    auto small = settings();
    small.max_result_bytes = 40;
    submit("a", {"one"});
    BatchRunner runner(store, results, small);
    runner.start();
    ASSERT_TRUE(finishes("a"));
    submit("b", {"one", "two", "three", "sleep"});  // 44 bytes, and it is not finished
    runner.wake();
    ASSERT_TRUE(comes_true([&] { return !store.find("a") && store.find("b")->done == 3; }));
    const auto fails = [&] {
        static int count = 0;
        const std::string id = "c" + std::to_string(++count);
        submit(id, {"one"});
        runner.wake();
        EXPECT_TRUE(comes_true([&] { return !store.find(id) || store.find(id)->finished; }));
        const auto frame = store.frame(id, 0);  // a finished one may have made room again
        return frame && frame->problem == error_code::storage_full;
    };
    EXPECT_TRUE(comes_true(fails)) << "within a second or two";
}

}  // namespace
}  // namespace relit::server
