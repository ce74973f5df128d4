// Images over HTTP against the real program: kept across restarts and kill -9, and hostile ones
// refused cheaply.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <csignal>
#include <filesystem>
#include <thread>
#include <vector>

#include "tests/support/http_client.h"
#include "tests/support/relit_process.h"
#include "tests/support/upload_images.h"

namespace relit::test {
namespace {

using namespace std::chrono_literals;

TEST(ImagesEndToEnd, UploadFetchAndDelete) {
    RelitProcess relitd;
    const std::string png = small_png();
    const auto created =
        http(relitd.port(), "POST", "/v1/images", png, {{"Content-Type", "text/plain"}});
    ASSERT_EQ(created.status, 201) << created.body;
    const auto location = created.header("location");
    EXPECT_EQ(http(relitd.port(), "POST", "/v1/images", png).status, 200);

    const auto content = http(relitd.port(), "GET", location + "/content");
    EXPECT_EQ(content.body, png);
    EXPECT_EQ(content.header("content-type"), "image/png");
    EXPECT_EQ(content.header("x-content-type-options"), "nosniff");
    const auto head = http(relitd.port(), "HEAD", location + "/content");
    EXPECT_EQ(head.header("content-length"), std::to_string(png.size()));
    EXPECT_EQ(http(relitd.port(), "GET", location + "/content", "",
                   {{"If-None-Match", content.header("etag")}})
                  .status,
              304);

    EXPECT_EQ(http(relitd.port(), "DELETE", location).status, 204);
    EXPECT_EQ(http(relitd.port(), "GET", location).status, 404);

    const auto [body, type] = form_of({{"note", "", "hello"}, {"file", "a.png", png}});
    EXPECT_EQ(
        http(relitd.port(), "POST", "/v1/images", body, {{"Content-Type", type}}).header("location"),
        location);
}

TEST(ImagesEndToEnd, LargeUploadComesBackUnchanged) {
    RelitProcess relitd;
    const std::string png = small_png(1, 3000, 2000);
    const auto created = http(relitd.port(), "POST", "/v1/images", png);
    ASSERT_EQ(created.status, 201) << created.body;
    EXPECT_EQ(http(relitd.port(), "GET", created.header("location") + "/content").body, png);
}

// What was answered is there after kill -9, whole; what was not is there whole or not at all.
TEST(ImagesEndToEnd, AnsweredUploadsSurviveKill9) {
    const TemporaryFolder folder;
    std::vector<std::string> answered;
    for (int round = 0; round < 4; ++round) {
        RelitProcess relitd({.data_dir = folder.path()});
        const std::string first = small_png(round * 1000, 64, 64);  // waits for the decoders
        ASSERT_EQ(http(relitd.port(), "POST", "/v1/images", first).status, 201);
        std::thread uploads([&] {
            for (int i = 1; i < 1000; ++i) try {
                    const auto reply = http(relitd.port(), "POST", "/v1/images",
                                            small_png(round * 1000 + i, 64, 64));
                    if (reply.status == 201) answered.push_back(reply.header("location"));
                } catch (const std::runtime_error&) {
                    return;
                }
        });
        std::this_thread::sleep_for(150ms + round * 37ms);
        relitd.signal(SIGKILL);
        uploads.join();
        EXPECT_EQ(relitd.exit_status(), 128 + SIGKILL);
    }
    ASSERT_FALSE(answered.empty());
    RelitProcess relitd({.data_dir = folder.path()});
    for (const std::string& location : answered) {
        const auto content = http(relitd.port(), "GET", location + "/content");
        ASSERT_EQ(content.status, 200) << location;
        EXPECT_EQ(http(relitd.port(), "POST", "/v1/images", content.body).header("location"),
                  location)
            << "the bytes still have their hash";
    }
    EXPECT_TRUE(std::filesystem::is_empty(folder.path() / "incoming"));
}

std::uint64_t stored_bytes(const std::filesystem::path& data_dir) {
    std::uint64_t bytes = 0;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(data_dir / "images"))
        if (entry.is_regular_file() && entry.path().extension() != ".info")
            bytes += entry.file_size();
    return bytes;
}

// Four clients keep a store of a few images full while it is killed again and again: what is there
// is whole, within the budget as soon as the program is up, and all of it is known.
TEST(ImagesEndToEnd, FullStoreIsConsistentAfterKill9) {
    const TemporaryFolder folder;
    const std::uint64_t budget = 9 * small_png(0, 64, 64).size();
    const std::vector<std::string> flags{"--max-storage", std::to_string(budget)};
    std::atomic<int> created{0};
    for (int round = 0; round < 5; ++round) {
        RelitProcess relitd({.flags = flags, .data_dir = folder.path()});
        ASSERT_NE(relitd.port(), 0) << relitd.log();
        EXPECT_LE(stored_bytes(folder.path()), budget);
        const std::string first = small_png(20'000 + round, 64, 64);  // waits for the decoders
        ASSERT_EQ(http(relitd.port(), "POST", "/v1/images", first).status, 201);
        std::vector<std::thread> clients;
        clients.reserve(4);
        for (int client = 0; client < 4; ++client)
            clients.emplace_back([&, client] {
                for (int i = 0; i < 1000; ++i) try {
                        const int seed = (round * 4 + client) * 1000 + i;
                        const auto reply =
                            http(relitd.port(), "POST", "/v1/images", small_png(seed, 64, 64));
                        created += reply.status == 201 ? 1 : 0;
                    } catch (const std::runtime_error&) {
                        return;
                    }
            });
        std::this_thread::sleep_for(150ms + round * 37ms);
        relitd.signal(SIGKILL);
        for (auto& client : clients) client.join();
        EXPECT_EQ(relitd.exit_status(), 128 + SIGKILL);
    }
    EXPECT_GT(created, 20) << "or nothing had to be evicted";

    RelitProcess relitd({.flags = flags, .data_dir = folder.path()});
    EXPECT_LE(stored_bytes(folder.path()), budget);
    EXPECT_TRUE(std::filesystem::is_empty(folder.path() / "incoming"));
    const auto listed = http(relitd.port(), "GET", "/v1/images").body;
    int images = 0, facts = 0;
    for (const auto& entry :
         std::filesystem::recursive_directory_iterator(folder.path() / "images")) {
        if (!entry.is_regular_file()) continue;
        if (entry.path().extension() == ".info") {
            ++facts;
            continue;
        }
        ++images;
        const std::string id = entry.path().filename();
        EXPECT_NE(listed.find(id), std::string::npos) << id;
        const auto content = http(relitd.port(), "GET", "/v1/images/" + id + "/content");
        ASSERT_EQ(content.status, 200);
        EXPECT_EQ(http(relitd.port(), "POST", "/v1/images", content.body).header("location"),
                  "/v1/images/" + id)
            << "the bytes still have their hash";
    }
    EXPECT_GT(images, 4);
    EXPECT_LE(facts, images);
}

TEST(ImagesEndToEnd, EvictedImagesAreToBeUploadedAgain) {
    const std::string first = small_png(1, 64, 64), second = small_png(2, 64, 64);
    const auto budget = std::max(first.size(), second.size());
    RelitProcess relitd({.flags = {"--max-storage", std::to_string(budget)}});
    const auto location = http(relitd.port(), "POST", "/v1/images", first).header("location");
    EXPECT_EQ(http(relitd.port(), "POST", "/v1/images", second).status, 201);
    const auto gone = http(relitd.port(), "GET", location);
    EXPECT_EQ(gone.status, 404);
    EXPECT_NE(gone.body.find("upload it (again)"), std::string::npos) << gone.body;
    EXPECT_EQ(http(relitd.port(), "POST", "/v1/images", first).status, 201);
    EXPECT_EQ(http(relitd.port(), "GET", location).status, 200);

    const auto large = http(relitd.port(), "POST", "/v1/images", small_png(3, 200, 200));
    EXPECT_EQ(large.status, 507);
    EXPECT_NE(large.body.find("max-storage"), std::string::npos) << large.body;
    EXPECT_EQ(http(relitd.port(), "GET", location).status, 200) << "nothing was evicted for it";
}

TEST(ImagesEndToEnd, SameImageFromManyAtOnceIsStoredOnce) {
    RelitProcess relitd;
    const std::string png = small_png(5, 200, 200);
    std::atomic<int> created{0}, found{0};
    std::vector<std::thread> clients;
    clients.reserve(16);
    for (int i = 0; i < 16; ++i)
        clients.emplace_back([&] {
            const auto status = http(relitd.port(), "POST", "/v1/images", png).status;
            ++(status == 201 ? created : found);
        });
    for (auto& client : clients) client.join();
    EXPECT_EQ(created, 1);
    EXPECT_EQ(found, 15);
}

TEST(ImagesEndToEnd, HostileImagesAreRefusedAtOnceAndCheaply) {
    RelitProcess relitd;
    const std::pair<std::string, int> rows[] = {
        {lying_png(100'000, 100'000, false), 413},
        {lying_png(60'000, 60'000, true), 413},
        {lying_png(0x7fffffff, 0x7fffffff, false), 413},
        {lying_png(8000, 8000, false), 422},
        {lying_png(0, 10, false), 422},
        {"hello", 415},
        {small_png().substr(0, 100), 422},
    };
    for (const auto& [image, status] : rows) {
        const auto start = std::chrono::steady_clock::now();
        const auto reply = http(relitd.port(), "POST", "/v1/images", image);
        EXPECT_EQ(reply.status / 100, 4) << reply.body;
        EXPECT_EQ(reply.status, status) << reply.body;
        EXPECT_EQ(reply.body.find("/tmp"), std::string::npos);
        EXPECT_LT(std::chrono::steady_clock::now() - start, 2s) << reply.body;
    }
    EXPECT_LT(relitd.peak_memory_mib(), 1000);
    EXPECT_EQ(http(relitd.port(), "GET", "/healthz").status, 200);
}

}  // namespace
}  // namespace relit::test
