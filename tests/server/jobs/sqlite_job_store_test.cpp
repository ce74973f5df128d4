// Every transition of a frame, who may make it, and what is left of it after a restart.
#include "server/jobs/sqlite_job_store.h"

#include <gtest/gtest.h>

#include <fstream>
#include <thread>

#include "server/error_codes.h"
#include "tests/support/temporary_folder.h"

namespace relit::server {
namespace {

using test::TemporaryFolder;

template <class Call>
std::string_view refusal_of(const Call& call) {
    try {
        (void)call();
        return "none";
    } catch (const Error& error) {
        return error.code;
    }
}

class SqliteJobStoreTest : public testing::Test {
protected:
    [[nodiscard]] std::unique_ptr<SqliteJobStore> opened(int max_unfinished = 100) {
        return std::make_unique<SqliteJobStore>(
            file,
            SqliteJobStoreSettings{.clock = [this] { return now.load(); },
                                   .lease_ms = 30'000,
                                   .max_unfinished_batches = max_unfinished,
                                   .worker_lost_problem = R"({"type":"/problems/worker-lost"})"});
    }
    // As after kill -9: another run of the program on the same file.
    void restart() {
        store.reset();
        store = opened();
        (void)store->counts();  // it is opened when it is first asked
    }

    static NewBatch batch_of(const std::string& id, int frames, int priority = 0) {
        NewBatch batch{.id = id,
                       .priority = priority,
                       .frames = {},
                       .images = {"image-" + id},
                       .key = {},
                       .body_hash = {}};
        for (int i = 0; i < frames; ++i)
            batch.frames.push_back({std::to_string(i) + ".png", "scene " + std::to_string(i)});
        return batch;
    }
    // "b/3", or "" where there is none.
    std::string claimed(const std::string& worker = "w") {
        const auto claim = store->claim(worker);
        if (!claim) return "";
        last = claim->lease;
        return claim->lease.batch + "/" + std::to_string(claim->lease.number);
    }
    JobStore::Ended end_with_result(const Lease& lease, const std::string& name = "file") {
        const JobStore::Ending ending{lease, FrameResult{name, 100, "image/png"}, ""};
        return store->end({&ending, 1}).front();
    }
    JobStore::Ended end_with_problem(const Lease& lease, const std::string& problem = "{}") {
        const JobStore::Ending ending{lease, std::nullopt, problem};
        return store->end({&ending, 1}).front();
    }
    FrameState state_of(const std::string& batch, int number) {
        return store->frame(batch, number).value().state;
    }

    TemporaryFolder folder;
    std::filesystem::path file = folder.path() / "batches" / "batches.db";
    std::atomic<StoreTime> now{1'000'000};
    std::unique_ptr<SqliteJobStore> store = opened();
    Lease last;
};

TEST_F(SqliteJobStoreTest, ABatchIsThereWithAllItsFramesAfterARestart) {
    store->submit(batch_of("a", 3, 5));
    restart();
    const auto batch = store->find("a").value();
    EXPECT_EQ(batch.total, 3);
    EXPECT_EQ(batch.priority, 5);
    EXPECT_EQ(batch.done, 0);
    EXPECT_EQ(batch.created, 1'000'000);
    EXPECT_FALSE(batch.started);
    EXPECT_FALSE(batch.finished);
    const auto frames = store->frames("a", 0, 10);
    ASSERT_EQ(frames.size(), 3u);
    EXPECT_EQ(frames[2].name, "2.png");
    EXPECT_EQ(frames[2].state, FrameState::ready);
    EXPECT_EQ(store->unfinished().at(0).images, std::vector<std::string>{"image-a"});
    EXPECT_FALSE(store->find("b"));
    EXPECT_FALSE(store->frame("a", 3));
    EXPECT_FALSE(store->frame("b", 0));
}

TEST_F(SqliteJobStoreTest, FramesAreClaimedByPriorityThenAgeThenNumber) {
    store->submit(batch_of("old", 2));
    store->submit(batch_of("new", 1));
    store->submit(batch_of("urgent", 1, 1));
    store->submit(batch_of("idle", 1, -1));
    for (const char* next : {"urgent/0", "old/0", "old/1", "new/0", "idle/0", ""})
        EXPECT_EQ(claimed(), next);
}

TEST_F(SqliteJobStoreTest, AClaimTellsTheSceneAndStartsTheBatch) {
    store->submit(batch_of("a", 2));
    now += 500;
    const auto claim = store->claim("w").value();
    EXPECT_EQ(claim.scene, "scene 0");
    EXPECT_EQ(claim.lease.attempt, 1);
    EXPECT_FALSE(claim.alone);
    EXPECT_EQ(store->find("a")->started, 1'000'500);
    EXPECT_EQ(state_of("a", 0), FrameState::leased);
}

TEST_F(SqliteJobStoreTest, DoneAndFailedFramesAreCountedAndTheLastEndsTheBatch) {
    store->submit(batch_of("a", 2));
    claimed();
    const auto first = end_with_result(last, "f00");
    EXPECT_TRUE(first.counted);
    EXPECT_FALSE(first.finished);
    claimed();
    now += 7;
    const auto second = end_with_problem(last, R"({"status":422})");
    EXPECT_TRUE(second.counted);
    EXPECT_TRUE(second.finished);
    restart();
    const auto batch = store->find("a").value();
    EXPECT_EQ(batch.done, 1);
    EXPECT_EQ(batch.failed, 1);
    EXPECT_EQ(batch.finished, 1'000'007);
    EXPECT_EQ(batch.result_bytes, 100u);
    const auto done = store->frame("a", 0).value();
    EXPECT_EQ(done.state, FrameState::done);
    EXPECT_EQ(done.result.file, "f00");
    EXPECT_EQ(done.result.size_bytes, 100u);
    EXPECT_EQ(done.result.media_type, "image/png");
    const auto failed = store->failed_frames("a");
    ASSERT_EQ(failed.size(), 1u);
    EXPECT_EQ(failed[0].number, 1);
    EXPECT_EQ(failed[0].problem, R"({"status":422})");
    EXPECT_EQ(store->result_files("a"), std::set<std::string>{"f00"});
    EXPECT_TRUE(store->unfinished().empty());
    EXPECT_EQ(claimed(), "");
}

// The fencing token: whoever lost a frame can do nothing to it any more.
TEST_F(SqliteJobStoreTest, AnOlderLeaseChangesNothing) {
    store->submit(batch_of("a", 1));
    claimed("slow");
    const Lease slow = last;
    now += 30'001;
    EXPECT_EQ(store->reap(), std::vector<std::string>{"a"});
    now += 1'000;
    claimed("quick");
    EXPECT_EQ(last.attempt, 2);
    EXPECT_FALSE(end_with_result(slow).counted);
    EXPECT_FALSE(end_with_problem(slow).counted);
    store->give_back(slow);
    EXPECT_EQ(store->renew(std::vector{slow}), std::vector{slow});
    EXPECT_EQ(state_of("a", 0), FrameState::leased);
    EXPECT_TRUE(end_with_result(last).counted);
    EXPECT_FALSE(end_with_result(last).counted) << "a frame ends once";
    EXPECT_EQ(store->find("a")->done, 1);
}

TEST_F(SqliteJobStoreTest, ALeaseLastsAsLongAsItIsRenewed) {
    store->submit(batch_of("a", 1));
    claimed();
    for (int i = 0; i < 5; ++i) {
        now += 29'000;
        EXPECT_TRUE(store->renew(std::vector{last}).empty());
        EXPECT_TRUE(store->reap().empty());
    }
    now += 30'001;
    EXPECT_EQ(store->reap().size(), 1u);
}

TEST_F(SqliteJobStoreTest, ALostFrameWaitsOneSecondThenFourAndIsThenTriedAloneOrNotAtAll) {
    store->submit(batch_of("a", 1));
    claimed();
    now += 30'001;
    store->reap();
    now += 999;
    EXPECT_EQ(claimed(), "") << "1 s";
    now += 1;
    EXPECT_EQ(claimed(), "a/0");
    now += 30'001;
    store->reap();
    now += 3'999;
    EXPECT_EQ(claimed(), "") << "4 s";
    now += 1;
    const auto third = store->claim("w").value();
    EXPECT_TRUE(third.alone);
    now += 30'001;
    EXPECT_EQ(store->reap(), std::vector<std::string>{"a"});
    EXPECT_EQ(store->frame("a", 0)->problem, R"({"type":"/problems/worker-lost"})");
    EXPECT_TRUE(store->find("a")->finished);
    EXPECT_EQ(store->find("a")->failed, 1);
    EXPECT_EQ(store->events("a", 0, 10).size(), 2u) << "the frame, and the end";
}

TEST_F(SqliteJobStoreTest, AFrameThatIsTriedAloneHasNoOthersBesideIt) {
    store->submit(batch_of("a", 3));
    for (int lost = 0; lost < 2; ++lost) {
        EXPECT_EQ(claimed(), "a/0");
        restart();  // its worker is gone
        now += 4'000;
    }
    store->submit(batch_of("urgent", 1, 1));
    EXPECT_EQ(claimed(), "urgent/0");
    const Lease other = last;
    EXPECT_EQ(claimed(), "") << "it waits until the other has ended";
    end_with_result(other);
    EXPECT_EQ(claimed(), "a/0");
    const Lease alone = last;
    EXPECT_EQ(claimed(), "") << "nobody beside it";
    end_with_result(alone);
    EXPECT_EQ(claimed(), "a/1");
    EXPECT_EQ(claimed(), "a/2");
}

TEST_F(SqliteJobStoreTest, LeasesOfAnotherRunEndAtTheStartAndThoseOfThisOneDoNot) {
    store->submit(batch_of("a", 2));
    claimed();
    const Lease before = last;
    restart();
    EXPECT_EQ(state_of("a", 0), FrameState::ready);
    EXPECT_FALSE(end_with_result(before).counted);
    EXPECT_EQ(claimed(), "a/1") << "the other one waits for a second";
    EXPECT_EQ(state_of("a", 1), FrameState::leased);
}

TEST_F(SqliteJobStoreTest, WhatIsGivenBackIsReadyAtOnceAndNothingIsHeldAgainstIt) {
    store->submit(batch_of("a", 1));
    for (int i = 0; i < 5; ++i) {
        EXPECT_EQ(claimed(), "a/0");
        store->give_back(last);
    }
    const auto claim = store->claim("w").value();
    EXPECT_FALSE(claim.alone);
    EXPECT_EQ(claim.lease.attempt, 6) << "the token rises all the same";
}

TEST_F(SqliteJobStoreTest, EventsGoOnWhereAClientStopped) {
    store->submit(batch_of("a", 3));
    EXPECT_TRUE(store->events("a", 0, 10).empty());
    claimed();
    const Lease zero = last;
    claimed();
    end_with_problem(last);
    end_with_result(zero);
    auto events = store->events("a", 0, 10);
    ASSERT_EQ(events.size(), 2u);
    EXPECT_EQ(events[0].id, 1);
    EXPECT_EQ(events[0].frame->number, 1) << "in the order in which they ended";
    EXPECT_EQ(events[1].frame->number, 0);
    restart();
    claimed();
    end_with_result(last);
    events = store->events("a", 2, 10);
    ASSERT_EQ(events.size(), 2u);
    EXPECT_EQ(events[0].id, 3);
    EXPECT_EQ(events[0].frame->number, 2);
    EXPECT_EQ(events[1].id, 4);
    EXPECT_FALSE(events[1].frame) << "the end";
    EXPECT_EQ(store->find("a")->last_event, 4);
    EXPECT_EQ(store->events("a", 0, 2).size(), 2u);
    EXPECT_TRUE(store->events("a", 4, 10).empty());
}

TEST_F(SqliteJobStoreTest, FailedFramesAreTriedAgainWithEventsOfTheirOwn) {
    store->submit(batch_of("a", 2));
    claimed();
    end_with_result(last);
    claimed();
    end_with_problem(last);
    ASSERT_EQ(store->events("a", 0, 10).back().id, 3);
    EXPECT_EQ(store->retry_failed("a"), 1);
    EXPECT_EQ(store->retry_failed("b"), std::nullopt);
    EXPECT_FALSE(store->find("a")->finished);
    EXPECT_EQ(store->find("a")->failed, 0);
    EXPECT_TRUE(store->failed_frames("a").empty());
    EXPECT_EQ(claimed(), "a/1");
    end_with_result(last);
    const auto events = store->events("a", 3, 10);
    ASSERT_EQ(events.size(), 2u);
    EXPECT_EQ(events[0].id, 4);
    EXPECT_EQ(events[0].frame->number, 1);
    EXPECT_EQ(events[1].id, 5);
    EXPECT_EQ(store->retry_failed("a"), 0) << "nothing has failed";
    EXPECT_TRUE(store->find("a")->finished) << "and the batch is as it was";
}

TEST_F(SqliteJobStoreTest, TheSameKeyAndBodyIsTheSameAnswerAlsoWhenTheBatchIsGone) {
    NewBatch batch = batch_of("a", 2);
    batch.key = "key";
    batch.body_hash = "hash";
    EXPECT_FALSE(store->submitted("key", "hash"));
    EXPECT_FALSE(store->submit(batch).repeated);
    batch.id = "b";
    const auto again = store->submit(batch);
    EXPECT_TRUE(again.repeated);
    EXPECT_EQ(again.id, "a");
    EXPECT_EQ(again.total, 2);
    EXPECT_EQ(store->submitted("key", "hash")->id, "a");
    EXPECT_FALSE(store->find("b"));
    batch.body_hash = "other";
    EXPECT_EQ(refusal_of([&] { return store->submit(batch); }), error_code::key_reused);
    EXPECT_EQ(refusal_of([&] { return store->submitted("key", "other"); }), error_code::key_reused);
    store->forget_keys(0);
    EXPECT_TRUE(store->submitted("key", "hash")) << "the batch is there";
    EXPECT_TRUE(store->remove("a"));
    restart();
    EXPECT_EQ(store->submitted("key", "hash")->id, "a");
    now += 9'999;
    store->forget_keys(10'000);
    EXPECT_TRUE(store->submitted("key", "hash"));
    now += 1;
    store->forget_keys(10'000);
    EXPECT_FALSE(store->submitted("key", "hash"));
}

TEST_F(SqliteJobStoreTest, ARemovedBatchTakesItsLeasesAlong) {
    store->submit(batch_of("a", 2));
    claimed();
    EXPECT_TRUE(store->remove("a"));
    EXPECT_FALSE(store->remove("a"));
    EXPECT_EQ(store->renew(std::vector{last}), std::vector{last}) << "its worker hears of it";
    EXPECT_FALSE(end_with_result(last).counted);
    EXPECT_EQ(claimed(), "");
    EXPECT_FALSE(store->find("a"));
    EXPECT_TRUE(store->unfinished().empty());
}

TEST_F(SqliteJobStoreTest, PagesGoFromTheNewestToTheOldest) {
    for (const char* id : {"a", "b", "c"}) store->submit(batch_of(id, 1));
    const auto page = store->list(2, std::nullopt);
    ASSERT_EQ(page.size(), 2u);
    EXPECT_EQ(page[0].id, "c");
    EXPECT_EQ(page[1].id, "b");
    store->remove("b");
    store->submit(batch_of("d", 1));
    const auto rest = store->list(2, page[1].place);
    ASSERT_EQ(rest.size(), 1u);
    EXPECT_EQ(rest[0].id, "a");
}

TEST_F(SqliteJobStoreTest, FinishedBatchesExpireByAgeAndByRoomTheOldestFirst) {
    for (const char* id : {"a", "b", "c", "open"}) {
        store->submit(batch_of(id, 1));
        if (id == std::string("open")) break;
        claimed();
        end_with_result(last);
        now += 1'000;
    }
    EXPECT_TRUE(store->expired(10'000, 1'000).empty());
    EXPECT_EQ(store->expired(2'500, 1'000), std::vector<std::string>{"a"});
    EXPECT_EQ(store->expired(10'000, 299), std::vector<std::string>{"a"});
    EXPECT_EQ(store->expired(10'000, 0), (std::vector<std::string>{"a", "b", "c"}));
    EXPECT_TRUE(store->find("a")) << "they are only named";
}

TEST_F(SqliteJobStoreTest, MoreUnfinishedBatchesThanMayBeAreRefused) {
    store = opened(2);
    store->submit(batch_of("a", 1));
    store->submit(batch_of("b", 1));
    EXPECT_EQ(refusal_of([&] { return store->submit(batch_of("c", 1)); }), error_code::queue_full);
    claimed();
    end_with_result(last);
    EXPECT_EQ(store->submit(batch_of("c", 1)).id, "c");
}

TEST_F(SqliteJobStoreTest, CountsWhatWaitsAndForHowLong) {
    store->submit(batch_of("a", 3));
    now += 2'500;
    store->submit(batch_of("b", 1));
    claimed();
    end_with_result(last);
    claimed();
    const auto counts = store->counts();
    EXPECT_EQ(counts.batches, 2);
    EXPECT_EQ(counts.unfinished_batches, 2);
    EXPECT_EQ(counts.leased_frames, 1);
    EXPECT_EQ(counts.waiting_frames, 2);
    EXPECT_EQ(counts.result_bytes, 100u);
    EXPECT_DOUBLE_EQ(counts.queue_age_s, 2.5);
}

// Workers of several threads: each frame ends once, whoever takes it.
TEST_F(SqliteJobStoreTest, ManyWorkersShareTheFrames) {
    store->submit(batch_of("a", 200));
    std::atomic<int> ended{0};
    std::vector<std::thread> workers;
    workers.reserve(4);
    for (int w = 0; w < 4; ++w)
        workers.emplace_back([&, w] {
            while (const auto claim = store->claim(std::to_string(w)))
                ended += end_with_result(claim->lease).counted ? 1 : 0;
        });
    for (std::thread& worker : workers) worker.join();
    EXPECT_EQ(ended, 200);
    EXPECT_EQ(store->find("a")->done, 200);
}

TEST_F(SqliteJobStoreTest, ADamagedDatabaseIsRefusedUntilItIsPutRight) {
    store->submit(batch_of("a", 1));
    store.reset();
    const auto good = file.string() + ".good";
    std::filesystem::copy_file(file, good);
    std::ofstream(file, std::ios::binary | std::ios::trunc) << std::string(8192, 'x');
    store = opened();
    EXPECT_EQ(refusal_of([&] { return store->submit(batch_of("b", 1)); }),
              error_code::batches_unavailable);
    EXPECT_EQ(refusal_of([&] { return store->find("a"); }), error_code::batches_unavailable);
    std::filesystem::rename(good, file);
    now += 1'000;  // it is not tried more often
    EXPECT_EQ(store->find("a")->total, 1);
    EXPECT_EQ(store->submit(batch_of("b", 1)).id, "b");
}

TEST_F(SqliteJobStoreTest, AnotherFileInItsPlaceIsFoundAtTheNextChange) {
    store->submit(batch_of("a", 1));
    std::filesystem::rename(file, file.string() + ".away");
    EXPECT_EQ(store->submit(batch_of("b", 1)).id, "b");
    EXPECT_FALSE(store->find("a"));
    restart();
    EXPECT_TRUE(store->find("b"));
}

TEST_F(SqliteJobStoreTest, AFolderThatCannotBeMadeIsToldAndTriedAgain) {
    store.reset();
    std::filesystem::remove_all(file.parent_path());
    std::ofstream(file.parent_path()) << "a file where the folder should be";
    store = opened();
    EXPECT_EQ(refusal_of([&] { return store->find("a"); }), error_code::batches_unavailable);
    std::filesystem::remove(file.parent_path());
    now += 1'000;
    EXPECT_FALSE(store->find("a"));
}

}  // namespace
}  // namespace relit::server
