// Pictures of batches as files: put, found, and gone at once however many there are.
#include "server/storage/result_files.h"

#include <gtest/gtest.h>

#include <chrono>
#include <fstream>
#include <thread>

#include "core/base/error.h"
#include "server/error_codes.h"
#include "tests/support/temporary_folder.h"

namespace relit::server {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

class ResultFilesTest : public testing::Test {
protected:
    void put(ResultFiles& files, const std::string& batch, int count) const {
        std::vector<std::string> bytes;
        for (int i = 0; i < count; ++i) bytes.push_back(batch + std::to_string(i));
        std::vector<ResultFiles::NewPicture> pictures;
        for (const std::string& one : bytes) pictures.push_back({batch, one});
        EXPECT_EQ(files.put(pictures).size(), std::size_t(count));
    }
    [[nodiscard]] std::size_t entries_in(const char* name) const {
        std::error_code none;
        const fs::directory_iterator entries(folder.path() / name, none);
        return std::size_t(std::distance(begin(entries), end(entries)));
    }
    // Within a time that no machine needs.
    [[nodiscard]] bool becomes_empty(const char* name) const {
        for (int i = 0; i < 2000 && entries_in(name) > 0; ++i) std::this_thread::sleep_for(10ms);
        return entries_in(name) == 0;
    }

    test::TemporaryFolder folder;
};

TEST_F(ResultFilesTest, OfSeveralBatchesArePutTogetherAndNamedInTheirOrder) {
    ResultFiles files(folder.path());
    const ResultFiles::NewPicture pictures[] = {
        {"a", "one"}, {"b", "two"}, {"a", "one"}, {"a", "three"}};
    const auto names = files.put(pictures);
    ASSERT_EQ(names.size(), 4u);
    for (std::size_t i = 0; i < names.size(); ++i)
        EXPECT_EQ(files.get(pictures[i].batch, names[i]).bytes, pictures[i].bytes) << i;
    EXPECT_EQ(names[0], names[2]) << "the same bytes are there once";
    EXPECT_EQ(entries_in("results/a"), 2u);
    EXPECT_EQ(entries_in("incoming"), 0u);
    EXPECT_TRUE(files.put({}).empty());
}

TEST_F(ResultFilesTest, OfARemovedBatchAreGoneAtOnceAndTheirRoomIsFreedAfterwards) {
    ResultFiles files(folder.path());
    put(files, "a", 30);
    put(files, "b", 1);
    const ResultFiles::NewPicture more{"a", "more"};
    const std::string name = files.put({&more, 1}).front();
    EXPECT_EQ(files.get("a", name).bytes, "more");
    files.remove("a");
    EXPECT_FALSE(fs::exists(folder.path() / "results" / "a"));
    EXPECT_THROW((void)files.get("a", name), Error);
    EXPECT_TRUE(becomes_empty("removed"));
    EXPECT_EQ(entries_in("results"), 1u) << "those of others stay";
    put(files, "a", 1);
    files.remove("a");
    files.remove("a");
    files.remove("never there");
    EXPECT_TRUE(becomes_empty("removed")) << "a batch may be removed again";
}

TEST_F(ResultFilesTest, ThatWereToBeRemovedWhenTheProgramEndedAreSweptByTheNext) {
    {
        ResultFiles files(folder.path());
        put(files, "kept", 1);
    }
    fs::create_directories(folder.path() / "removed" / "a-01234567");
    std::ofstream(folder.path() / "removed" / "a-01234567" / "left") << "over";
    fs::create_directories(folder.path() / "results" / "forgotten");
    std::ofstream(folder.path() / "results" / "forgotten" / "left") << "over";
    ResultFiles files(folder.path());
    files.sweep([&](const std::string& batch) {
        std::set<std::string> names;
        if (batch == "kept")
            for (const auto& file : fs::directory_iterator(folder.path() / "results" / batch))
                names.insert(file.path().filename());
        return names;
    });
    EXPECT_TRUE(becomes_empty("removed"));
    EXPECT_EQ(entries_in("results"), 1u);
    EXPECT_EQ(entries_in("results/kept"), 1u);
}

TEST_F(ResultFilesTest, DoNotKeepTheProgramFromEnding) {
    const auto took = [&] {
        auto files = std::make_optional<ResultFiles>(folder.path());
        fs::create_directories(folder.path() / "results" / "a");
        for (int i = 0; i < 20'000; ++i)
            std::ofstream(folder.path() / "results" / "a" / std::to_string(i)) << "x";
        const auto begin = std::chrono::steady_clock::now();
        files->remove("a");
        files.reset();
        return std::chrono::steady_clock::now() - begin;
    }();
    EXPECT_LT(took, 1s);
    ResultFiles files(folder.path());
    files.sweep([](const std::string&) { return std::set<std::string>{}; });
    EXPECT_TRUE(becomes_empty("removed"));
}

}  // namespace
}  // namespace relit::server
