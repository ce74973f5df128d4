// Batches through the real program, which is killed again and again. tests/soak/batches runs the first
// of these tests at length.
#include <gtest/gtest.h>

#include <csignal>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>
#include <thread>

#include "server/jobs/sqlite_database.h"
#include "server/storage/result_files.h"
#include "server/storage/sha256.h"
#include "tests/server/e2e/batch_server.h"
#include "tests/support/batch_client.h"
#include "tests/support/http_client.h"
#include "tests/support/metrics_text.h"

namespace relit::test {
namespace {

using namespace std::chrono_literals;
using Json = nlohmann::json;
using Clock = std::chrono::steady_clock;
namespace fs = std::filesystem;

int setting(const char* name, int otherwise) {
    const char* text = std::getenv(name);
    return text ? std::stoi(text) : otherwise;
}

// Frames of one batch: a sun that goes round, and one frame whose environment is too large to load.
struct Work {
    std::string image;
    std::string environment;
    int frames = 0;

    [[nodiscard]] Json scene() const { return {{"height", {{"image", image}}}}; }
    [[nodiscard]] Json patch(int batch, int frame) const {
        if (fails(frame))
            return {{"light", {{"type", "environment"}, {"image", {{"image", environment}}}}}};
        return {{"light",
                 {{"type", "directional"}, {"azimuth", frame * 3}, {"elevation", 20 + batch % 50}}}};
    }
    [[nodiscard]] bool fails(int frame) const { return frame == frames / 2; }
    [[nodiscard]] std::string body(int batch) const {
        Json patches = Json::array();
        for (int i = 0; i < frames; ++i) patches.push_back(patch(batch, i));
        return Json{{"scene", scene()}, {"frames", patches}}.dump();
    }
};

struct Client {
    std::map<std::string, int> batches;  // id -> which
    std::string faults;
    int reconnected = 0;
};

// Submits its batches, some of them twice or three times, and follows each to its end.
void run_client(Client& client, const Work& work, const CurrentPort& port, int first, int count,
                unsigned seed) {
    std::mt19937 random(seed);
    for (int i = 0; i < count; ++i) {
        const std::string key = "batch-" + std::to_string(first + i);
        const std::string body = work.body(first + i);
        const std::string id = submit_until_accepted(port, body, key);
        for (unsigned repeat = random() % 3; repeat > 0; --repeat)
            if (submit_until_accepted(port, body, key) != id) client.faults += "two of " + key;
        client.batches[id] = first + i;
    }
    for (const auto& [id, which] : client.batches) {
        const SeenEvents seen = follow_events(port, id);
        client.faults += seen.faults;
        client.reconnected += seen.reconnected;
        if (int(seen.frames.size()) != work.frames) client.faults += "events are missing of " + id;
    }
}

// A frame that lost its worker three times by chance is tried again, as its client would.
int retry_worker_lost(int port, const std::string& id) {
    int lost = 0;
    const Json batch = batch_at(port, id);
    for (const Json& failed : batch["problems"])
        lost += failed["problem"]["type"] == "/problems/worker-lost" ? 1 : 0;
    if (lost == 0) return 0;
    EXPECT_EQ(http(port, "POST", "/v1/batches/" + id + "/retry").status, 200);
    for (int i = 0; i < 2000 && batch_at(port, id)["status"] != "done"; ++i)
        std::this_thread::sleep_for(10ms);
    return lost;
}

std::set<std::string> names_in(const fs::path& folder) {
    std::set<std::string> names;
    if (fs::exists(folder))
        for (const auto& entry : fs::directory_iterator(folder))
            names.insert(entry.path().filename());
    return names;
}

std::set<std::string> packs_of(const fs::path& database, const std::string& batch) {
    server::SqliteDatabase connection(database, [] { return 0; });
    server::SqliteQuery rows(connection,
                             "SELECT file FROM frames WHERE file IS NOT NULL"
                             " AND batch = (SELECT seq FROM batches WHERE id = ?)",
                             batch);
    std::set<std::string> packs;
    while (rows.next()) packs.emplace(server::ResultFiles::pack_of(rows.text(0)));
    return packs;
}

// Every frame has one result, whose bytes are those of a render that nothing disturbs.
void expect_whole(int port, const fs::path& folder, const Work& work, const std::string& id,
                  int which) {
    const Json batch = batch_at(port, id);
    EXPECT_EQ(batch["total"], work.frames);
    EXPECT_EQ(batch["done"], work.frames - 1) << batch.dump();
    EXPECT_EQ(batch["failed"], 1);
    EXPECT_EQ(batch["problems"][0]["problem"]["type"], "/problems/image-too-large");
    for (int i = 0; i < work.frames; ++i) {
        const auto frame = http(port, "GET", "/v1/batches/" + id + "/frames/" + std::to_string(i));
        if (work.fails(i)) {
            EXPECT_EQ(frame.status, 413);
            continue;
        }
        ASSERT_EQ(frame.status, 200) << frame.body;
        Json scene = work.scene();
        scene.merge_patch(work.patch(which, i));
        const auto render = http(port, "POST", "/v1/render", scene.dump());
        EXPECT_TRUE(frame.body == render.body) << "frame " << i << " of " << id;
        EXPECT_EQ(frame.header("etag"), '"' + server::sha256_hex(frame.body) + '"');
    }
    EXPECT_EQ(names_in(folder / "results" / id), packs_of(folder / "batches.db", id))
        << "no orphans";
}

void expect_sound(const fs::path& database) {
    server::SqliteDatabase connection(database, [] { return 0; });
    server::SqliteQuery check(connection, "PRAGMA integrity_check");
    ASSERT_TRUE(check.next());
    EXPECT_EQ(check.text(0), "ok");
    server::SqliteQuery foreign(connection, "PRAGMA foreign_key_check");
    EXPECT_FALSE(foreign.next());
}

std::string environment_sample(int port) {
    const Json samples = Json::parse(http(port, "GET", "/v1/samples").body)["samples"];
    for (const Json& sample : samples)
        if (sample["kind"] == "environment") return sample["id"];
    throw std::runtime_error("no environment among the samples");
}

TEST(BatchesEndToEnd, LoseNothingWhateverIsKilled) {
    const int batches = setting("SOAK_BATCHES", 8), clients = setting("SOAK_CLIENTS", 4);
    const int frames = setting("SOAK_FRAMES", 30), side = setting("SOAK_SIDE", 160);
    const int shortest_ms = setting("SOAK_KILL_FROM_MS", 300);
    const int longest_ms = setting("SOAK_KILL_TO_MS", 700);
    Restarting relitd({"--max-environment-pixels=1000", "--max-queue=1000"});
    const Work work{uploaded(relitd.port()(), 1, side), environment_sample(relitd.port()()),
                    frames};

    std::vector<Client> all{std::size_t(clients)};
    std::atomic<int> running{clients};
    std::vector<std::thread> threads;
    threads.reserve(all.size());
    for (int c = 0; c < clients; ++c)
        threads.emplace_back([&, c] {
            const int first = batches * c / clients, end = batches * (c + 1) / clients;
            try {
                run_client(all[std::size_t(c)], work, relitd.port(), first, end - first,
                           unsigned(c));
            } catch (const std::exception& error) {
                all[std::size_t(c)].faults += error.what();
            }
            --running;
        });
    const auto begin = Clock::now();
    std::mt19937 random(7);
    while (running > 0) {
        const int pause = shortest_ms + int(random() % unsigned(longest_ms - shortest_ms));
        const auto kill_at = Clock::now() + std::chrono::milliseconds(pause);
        while (running > 0 && Clock::now() < kill_at) std::this_thread::sleep_for(10ms);
        if (running == 0) break;
        relitd.kill();
        relitd.start();
    }
    const std::chrono::duration<double> took = Clock::now() - begin;
    for (std::thread& thread : threads) thread.join();

    int reconnected = 0, submitted = 0, lost = 0;
    for (const Client& client : all) {
        EXPECT_EQ(client.faults, "");
        reconnected += client.reconnected;
        for (const auto& [id, which] : client.batches) {
            lost += retry_worker_lost(relitd.port()(), id);
            expect_whole(relitd.port()(), relitd.batches(), work, id, which);
            ++submitted;
        }
    }
    EXPECT_EQ(submitted, batches);
    const Json list =
        Json::parse(http(relitd.port()(), "GET", "/v1/batches?limit=1000").body)["batches"];
    EXPECT_EQ(int(list.size()), batches) << "repeated keys made no further ones";
    EXPECT_EQ(names_in(relitd.batches() / "results").size(), std::size_t(batches));
    EXPECT_TRUE(names_in(relitd.batches() / "incoming").empty());
    EXPECT_GT(relitd.kills(), 0) << "or nothing was tried";
    relitd.process().signal(SIGTERM);
    EXPECT_EQ(relitd.process().exit_status(), 0);
    expect_sound(relitd.batches() / "batches.db");
    std::printf(
        "%d frames of %d batches by %d clients in %.1f s: %d kills, %d streams resumed, "
        "%d frames lost their worker three times and were tried again\n",
        submitted * frames, submitted, clients, took.count(), relitd.kills(), reconnected, lost);
}

// Given back, not lost: the next run begins it at once, and nothing is held against it.
TEST_F(BatchServer, TermGivesBackTheFrameUnderWay) {
    Restarting relitd({"--threads=1"});
    const std::string body = R"({"scene": {"height": {"image": ")" +
                             uploaded(relitd.port()(), 1, 512) + R"("}, "material": )" + endless +
                             R"(, "light": {"type": "point"}}, "frames": [{}, {}]})";
    const std::string id = submit_until_accepted(relitd.port(), body, "k");
    ASSERT_TRUE(comes_true([&] { return batch_at(relitd.port()(), id)["status"] == "running"; }));
    const auto begin = Clock::now();
    relitd.process().signal(SIGTERM);
    EXPECT_EQ(relitd.process().exit_status(), 0) << relitd.process().log();
    EXPECT_LT(Clock::now() - begin, 5s);
    server::SqliteDatabase database(relitd.batches() / "batches.db", [] { return 0; });
    server::SqliteQuery frames(database,
                               "SELECT count(*) FROM frames WHERE state = 0 AND losses = 0");
    ASSERT_TRUE(frames.next());
    EXPECT_EQ(frames.integer(0), 2);
}

TEST_F(BatchServer, AFrameThatTakesTheProgramAlongThreeTimesIsReportedAndTheOthersAreDone) {
    Restarting relitd({"--threads=1"});
    const std::string body = R"({"scene": {"height": {"image": ")" +
                             uploaded(relitd.port()(), 1, 256) + R"("}, "light": {"type": "point"}},
                                 "frames": [{"material": )" +
                             endless + R"(}, {}, {}]})";
    const std::string id = submit_until_accepted(relitd.port(), body, "k");
    for (int attempt = 1; attempt <= 3; ++attempt) {
        const int others = attempt == 1 ? 0 : 2;  // done while the first one pauses
        ASSERT_TRUE(comes_true([&] {
            return batch_at(relitd.port()(), id)["done"] == others &&
                   metric_of(relitd.port()(), "relit_batch_frames_running") == 1;
        })) << attempt;
        relitd.kill();
        relitd.start();
    }
    const Json batch = batch_at(relitd.port()(), id);
    EXPECT_EQ(batch["status"], "done");
    EXPECT_EQ(batch["done"], 2);
    EXPECT_EQ(batch["problems"][0]["frame"], 0);
    EXPECT_EQ(batch["problems"][0]["problem"]["type"], "/problems/worker-lost");
}

TEST_F(BatchServer, FramesThatTookTheProgramAlongTwiceAreTriedOneByOne) {
    Restarting relitd({"--threads=2"});
    const std::string body = R"({"scene": {"height": {"image": ")" +
                             uploaded(relitd.port()(), 1, 256) + R"("}, "material": )" + endless +
                             R"(, "light": {"type": "point"}}, "frames": [{}, {}]})";
    const std::string id = submit_until_accepted(relitd.port(), body, "k");
    const auto running = [&] { return metric_of(relitd.port()(), "relit_batch_frames_running"); };
    for (int attempt = 1; attempt <= 2; ++attempt) {
        ASSERT_TRUE(comes_true([&] { return running() == 2; })) << attempt;
        relitd.kill();
        relitd.start();
    }
    ASSERT_TRUE(comes_true([&] { return running() == 1; }));
    std::this_thread::sleep_for(500ms);  // both pauses are over
    EXPECT_EQ(running(), 1) << "the other one waits";
    relitd.kill();
    relitd.start();
    ASSERT_TRUE(comes_true([&] { return running() == 1; })) << "now the other one";
    const Json batch = batch_at(relitd.port()(), id);
    ASSERT_EQ(batch["failed"], 1) << batch.dump();
    EXPECT_EQ(batch["problems"][0]["frame"], 0);
    EXPECT_EQ(batch["problems"][0]["problem"]["type"], "/problems/worker-lost");
}

TEST_F(BatchServer, TermEndsStreamsOfEvents) {
    Restarting relitd({"--threads=1"});
    const std::string body = R"({"scene": {"height": {"image": ")" +
                             uploaded(relitd.port()(), 1, 512) + R"("}, "material": )" + endless +
                             R"(, "light": {"type": "point"}}, "frames": [{}]})";
    const std::string id = submit_until_accepted(relitd.port(), body, "k");
    RawConnection stream(relitd.port()());
    stream.send(http_request("GET", "/v1/batches/" + id + "/events"));
    EXPECT_EQ(stream.receive_head().status, 200);
    const auto begin = Clock::now();
    relitd.process().signal(SIGTERM);
    EXPECT_EQ(relitd.process().exit_status(), 0);
    EXPECT_LT(Clock::now() - begin, 5s);
    EXPECT_EQ(stream.next_chunk(), "retry: 1000\n\n");
    EXPECT_FALSE(stream.next_chunk()) << "ended as a whole";
}

TEST_F(BatchServer, ManyIdleStreamsDoNotSlowARender) {
    RelitProcess relitd;
    const std::string image = uploaded(relitd.port(), 1, 256);
    // The batch waits for good: its frames take longer than the test.
    const std::string body = R"({"scene": {"height": {"image": ")" + image + R"("}, "material": )" +
                             endless +
                             R"(, "light": {"type": "point"}}, "frames": [{}], "priority": -1})";
    const std::string blocker = submit_until_accepted([&] { return relitd.port(); }, body, "k");
    const std::string render = R"({"height": {"image": ")" + image + "\"}}";
    // The quickest of many: what else the machine does is not in it.
    const auto render_ms = [&] {
        double least = 1e9;
        for (int i = 0; i < 40; ++i) {
            const auto begin = Clock::now();
            EXPECT_EQ(http(relitd.port(), "POST", "/v1/render", render).status, 200);
            const std::chrono::duration<double, std::milli> took = Clock::now() - begin;
            least = std::min(least, took.count());
        }
        return least;
    };
    const double before = render_ms();
    std::vector<std::unique_ptr<RawConnection>> streams;
    for (int i = 0; i < 200; ++i) {
        streams.push_back(std::make_unique<RawConnection>(relitd.port()));
        streams.back()->send(http_request("GET", "/v1/batches/" + blocker + "/events"));
        ASSERT_EQ(streams.back()->receive_head().status, 200) << i;
    }
    EXPECT_EQ(metric_of(relitd.port(), "relit_streams"), 200);
    const double with = render_ms();
    EXPECT_LT(with, 1.5 * before + 2) << before << " ms without";
    std::printf("a render: %.1f ms alone, %.1f ms beside 200 streams\n", before, with);
}

}  // namespace
}  // namespace relit::test
