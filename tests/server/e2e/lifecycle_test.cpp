// How relitd starts, refuses to start, and stops.
#include <gtest/gtest.h>

#include <atomic>
#include <csignal>
#include <mutex>
#include <thread>
#include <vector>

#include "tests/support/http_client.h"
#include "tests/support/processes.h"
#include "tests/support/relit_process.h"
#include "tests/support/upload_images.h"

namespace relit::test {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

TEST(Lifecycle, AnnouncesItsAddressAndItsSettings) {
    RelitProcess relitd({.flags = {"--max-queue=7"}});
    EXPECT_EQ(relitd.output(),
              "relitd listens on http://127.0.0.1:" + std::to_string(relitd.port()) + "\n");
    EXPECT_EQ(http(relitd.port(), "GET", "/healthz").body, R"({"status":"ok"})");
    EXPECT_NE(relitd.log().find("max-queue=7"), std::string::npos) << relitd.log();
    EXPECT_TRUE(comes_true([&] {
        return relitd.log().find("path=/healthz status=200") != std::string::npos;
    })) << relitd.log();
}

TEST(Lifecycle, TermAndIntEndIdleServersWithStatus0) {
    for (const int signal : {SIGTERM, SIGINT}) {
        RelitProcess relitd;
        RawConnection idle(relitd.port());
        const auto start = Clock::now();
        relitd.signal(signal);
        EXPECT_EQ(relitd.exit_status(), 0) << relitd.log();
        EXPECT_LT(Clock::now() - start, 5s);
        EXPECT_TRUE(idle.ends_within(100ms));
    }
}

TEST(Lifecycle, TermLetsAnUploadUnderWayFinish) {
    RelitProcess relitd;
    const std::string request = http_request("POST", "/v1/images", small_png());
    RawConnection upload(relitd.port());
    upload.send(request.substr(0, request.size() - 10));
    ASSERT_EQ(http(relitd.port(), "GET", "/healthz").status, 200);
    relitd.signal(SIGTERM);
    EXPECT_FALSE(relitd.exit_status(300ms)) << "it waits for the upload";
    upload.send(request.substr(request.size() - 10));
    EXPECT_EQ(upload.receive().status, 201);
    EXPECT_EQ(relitd.exit_status(), 0) << relitd.log();
}

// A head is on its way when the signal comes: its answer is the last of the connection.
TEST(Lifecycle, ReadinessEndsWithTheSignalAndHealthDoesNot) {
    RelitProcess relitd;
    EXPECT_EQ(http(relitd.port(), "GET", "/readyz").body, R"({"status":"ready"})");
    RawConnection ready(relitd.port()), healthy(relitd.port());
    ready.send("GET /readyz HTTP/1.1\r\n");
    healthy.send("GET /healthz HTTP/1.1\r\n");
    std::this_thread::sleep_for(50ms);
    relitd.signal(SIGTERM);
    std::this_thread::sleep_for(50ms);
    ready.send("Host: a\r\n\r\n");
    const HttpReply reply = ready.receive();
    EXPECT_EQ(reply.status, 503);
    EXPECT_NE(reply.body.find("/problems/shutting-down"), std::string::npos) << reply.body;
    EXPECT_EQ(reply.header("retry-after"), "5");
    EXPECT_FALSE(relitd.exit_status(50ms)) << "it waits for the other";
    healthy.send("Host: a\r\n\r\n");
    EXPECT_EQ(healthy.receive().status, 200);
    EXPECT_EQ(relitd.exit_status(), 0) << relitd.log();
}

// Balancers that look while the last work is being finished hear it, and do not run into a wall.
TEST(Lifecycle, WhileWorkIsFinishedProbesAreAnsweredAndNewWorkIsRefused) {
    RelitProcess relitd;
    const std::string request = http_request("POST", "/v1/images", small_png());
    RawConnection upload(relitd.port());
    upload.send(request.substr(0, request.size() - 10));
    ASSERT_EQ(http(relitd.port(), "GET", "/healthz").status, 200);
    relitd.signal(SIGTERM);
    std::this_thread::sleep_for(100ms);
    EXPECT_EQ(http(relitd.port(), "GET", "/readyz").status, 503);
    EXPECT_EQ(http(relitd.port(), "GET", "/healthz").status, 200);
    EXPECT_EQ(http(relitd.port(), "GET", "/metrics").status, 200);
    const HttpReply refused = http(relitd.port(), "POST", "/v1/images", small_png(1));
    EXPECT_EQ(refused.status, 503);
    EXPECT_NE(refused.body.find("/problems/shutting-down"), std::string::npos) << refused.body;
    EXPECT_EQ(refused.header("connection"), "close");
    upload.send(request.substr(request.size() - 10));
    EXPECT_EQ(upload.receive().status, 201);
    EXPECT_EQ(relitd.exit_status(), 0) << relitd.log();
}

TEST(Lifecycle, ReadinessNeedsTheDataFolder) {
    RelitProcess relitd;
    const auto moved = relitd.data_dir().parent_path() / "moved";
    std::filesystem::rename(relitd.data_dir(), moved);
    const HttpReply reply = http(relitd.port(), "GET", "/readyz");
    EXPECT_EQ(reply.status, 503);
    EXPECT_NE(reply.body.find("data folder"), std::string::npos) << reply.body;
    EXPECT_EQ(reply.body.find(moved.parent_path().string()), std::string::npos) << "no path";
    std::filesystem::rename(moved, relitd.data_dir());
    EXPECT_EQ(http(relitd.port(), "GET", "/readyz").status, 200);
}

// What needs the folder is refused, what does not goes on, and nothing ends.
TEST(Lifecycle, ADataFolderThatIsDeletedUnderTheServerCostsWhatNeedsIt) {
    RelitProcess relitd;
    const int port = relitd.port();
    const auto kept = http(port, "POST", "/v1/images", small_png()).header("location");
    const long before_mib = relitd.peak_memory_mib();
    std::filesystem::remove_all(relitd.data_dir());
    const std::string plato = "c19f4389c237ad9b4f5e8e7ab97c7e4770f41eee5cedf994967fa8e5eca91908";
    const std::string of_plato = R"({"height": {"image": ")" + plato + "\"}}";
    const auto [form, type] = form_of(
        {{"scene", "", R"({"height": {"part": "map"}})"}, {"map", "map.png", small_png(2)}});
    for (int round = 0; round < 6; ++round) {
        for (const HttpReply& reply :
             {http(port, "POST", "/v1/images", small_png(3 + round)), http(port, "GET", "/readyz"),
              http(port, "POST", "/v1/batches",
                   R"({"scenes": [{"height": {"image": ")" + plato + "\"}}]}")}) {
            EXPECT_GE(reply.status, 500) << reply.body;
            EXPECT_EQ(reply.header("content-type"), "application/problem+json");
            EXPECT_EQ(reply.body.find(relitd.data_dir().string()), std::string::npos) << reply.body;
        }
        EXPECT_EQ(http(port, "GET", kept + "/content").status, 404);
        EXPECT_EQ(http(port, "GET", "/healthz").status, 200);
        EXPECT_EQ(http(port, "GET", "/v1/images").status, 200);
        EXPECT_EQ(http(port, "POST", "/v1/render", of_plato).status, 200);
        EXPECT_EQ(http(port, "POST", "/v1/render", form, {{"Content-Type", type}}).status, 200);
    }
    EXPECT_LT(relitd.peak_memory_mib(), before_mib + 60);
    relitd.signal(SIGTERM);
    EXPECT_EQ(relitd.exit_status(), 0) << relitd.log();
}

// Everybody hears of it in whole replies or not at all, and what was acknowledged is there afterwards.
TEST(Lifecycle, TermUnderLoadBreaksNoReplyAndLosesNoUpload) {
    const TemporaryFolder folder;
    std::vector<std::string> stored;
    std::mutex mutex;
    {
        RelitProcess relitd({.flags = {"--log-level=warn"}, .data_dir = folder.path()});
        const long before_mib = relitd.peak_memory_mib();
        std::atomic<int> good{0}, broken{0};
        const auto load = [&](int client) {
            for (int i = 0; i < 100'000; ++i) try {
                    RawConnection connection(relitd.port());
                    const std::string map = small_png(client * 1000 + i % 1000, 32, 32);
                    const auto [form, type] = form_of(
                        {{"scene", "", R"({"height": {"part": "map"}})"}, {"map", "m", map}});
                    connection.send(client % 2 ? http_request("POST", "/v1/images", map)
                                               : http_request("POST", "/v1/render", form,
                                                              {{"Content-Type", type}}));
                    const HttpReply reply = connection.receive();
                    const bool fine = reply.status / 100 == 2;
                    ++(fine || reply.status == 503 ? good : broken);
                    if (!fine) return;
                    const std::lock_guard lock(mutex);
                    if (client % 2) stored.push_back(reply.header("location"));
                } catch (const std::runtime_error& error) {
                    const std::string_view words = error.what();
                    if (words.starts_with("closed") && words != "closed without a reply: ")
                        ++broken;
                    return;
                }
        };
        std::vector<std::jthread> clients;
        for (int client = 0; client < 16; ++client) clients.emplace_back(load, client);
        std::this_thread::sleep_for(500ms);
        EXPECT_LT(relitd.peak_memory_mib(), before_mib + 100);
        const auto start = Clock::now();
        relitd.signal(SIGTERM);
        EXPECT_EQ(relitd.exit_status(), 0) << relitd.log();
        EXPECT_LT(Clock::now() - start, 5s);
        clients.clear();
        EXPECT_EQ(broken, 0);
        EXPECT_GT(good, 50);
        EXPECT_LT(relitd.log().size(), 100'000u);
    }
    RelitProcess relitd({.data_dir = folder.path()});
    for (const std::string& location : stored)
        EXPECT_EQ(http(relitd.port(), "GET", location).status, 200) << location;
    EXPECT_FALSE(stored.empty());
    EXPECT_TRUE(std::filesystem::is_empty(folder.path() / "incoming"));
}

TEST(Lifecycle, OriginsThatAreNoneAreRefusedAtStart) {
    RelitProcess relitd({.flags = {"--cors-origins=https://a.org/page"}});
    EXPECT_EQ(relitd.exit_status(), 2);
    EXPECT_NE(relitd.log().find("--cors-origins"), std::string::npos) << relitd.log();
}

TEST(Lifecycle, TermWaitsNoLongerThanItsTimeout) {
    RelitProcess relitd({.flags = {"--stop-timeout=1", "--read-timeout=60", "--write-timeout=60"}});
    RawConnection upload(relitd.port());
    upload.send("POST /v1/images HTTP/1.1\r\nHost: a\r\nContent-Length: 100\r\n\r\n");
    ASSERT_EQ(http(relitd.port(), "GET", "/healthz").status, 200);
    const auto start = Clock::now();
    relitd.signal(SIGTERM);
    EXPECT_EQ(relitd.exit_status(), 0) << relitd.log();
    EXPECT_GT(Clock::now() - start, 900ms);
    EXPECT_LT(Clock::now() - start, 6s);
}

TEST(Lifecycle, SecondSignalEndsItAtOnce) {
    RelitProcess relitd({.flags = {"--read-timeout=60", "--write-timeout=60"}});
    RawConnection upload(relitd.port());
    upload.send("POST /v1/images HTTP/1.1\r\nHost: a\r\nContent-Length: 100\r\n\r\n");
    ASSERT_EQ(http(relitd.port(), "GET", "/healthz").status, 200);
    relitd.signal(SIGTERM);
    EXPECT_FALSE(relitd.exit_status(200ms));
    const auto start = Clock::now();
    relitd.signal(SIGTERM);
    EXPECT_EQ(relitd.exit_status(), 1) << relitd.log();
    EXPECT_LT(Clock::now() - start, 1s);
}

TEST(Lifecycle, SecondServerOnThePortIsRefused) {
    RelitProcess first;
    RelitProcess second(
        {.flags = {"--port=" + std::to_string(first.port()), "--host=127.0.0.1",
                   "--data-dir=" + (first.data_dir().parent_path() / "other").string()},
         .with_usual_flags = false});
    EXPECT_EQ(second.exit_status(), 1);
    EXPECT_NE(second.log().find("in use"), std::string::npos) << second.log();
}

TEST(Lifecycle, SecondServerOnTheDataFolderIsRefused) {
    RelitProcess first;
    RelitProcess second({.data_dir = first.data_dir()});
    EXPECT_EQ(second.exit_status(), 1);
    EXPECT_NE(second.log().find("is in use by another relitd"), std::string::npos) << second.log();
    EXPECT_EQ(http(first.port(), "GET", "/healthz").status, 200);
}

TEST(Lifecycle, UnknownFlagsAndVariablesAreRefused) {
    RelitProcess flag({.flags = {"--colour=red"}});
    EXPECT_EQ(flag.exit_status(), 2);
    EXPECT_NE(flag.log().find("--colour"), std::string::npos) << flag.log();
    RelitProcess variable({.environment = {"RELIT_COLOUR=red"}});
    EXPECT_EQ(variable.exit_status(), 2);
    EXPECT_NE(variable.log().find("RELIT_COLOUR"), std::string::npos) << variable.log();
}

TEST(Lifecycle, VariablesSet) {
    RelitProcess relitd({.environment = {"RELIT_MAX_QUEUE=11"}});
    EXPECT_NE(relitd.log().find("max-queue=11"), std::string::npos) << relitd.log();
}

}  // namespace
}  // namespace relit::test
