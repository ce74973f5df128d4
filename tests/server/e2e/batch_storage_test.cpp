// Batches on disks that are full, cannot be written, or hold something else: what is not durable is not
// accepted, and what was accepted goes on when it can, without a restart.
#include <gtest/gtest.h>
#include <sys/mount.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "tests/server/e2e/batch_server.h"
#include "tests/support/temporary_folder.h"

namespace relit::test {
namespace {

using namespace std::chrono_literals;
using Json = nlohmann::json;
namespace fs = std::filesystem;

// A file system of its own that is full, as root where the kernel lets us.
class SmallDisk {
public:
    SmallDisk() { mounted_ = ::mount("none", folder_.path().c_str(), "tmpfs", 0, "size=6m") == 0; }
    ~SmallDisk() {
        if (mounted_) ::umount2(folder_.path().c_str(), MNT_DETACH);
    }
    SmallDisk(const SmallDisk&) = delete;
    SmallDisk& operator=(const SmallDisk&) = delete;

    [[nodiscard]] bool is_there() const { return mounted_; }
    [[nodiscard]] const fs::path& path() const { return folder_.path(); }
    void fill(std::size_t leave_bytes) const {
        const fs::path file = path() / "ballast";
        const std::size_t free = fs::space(path()).available;
        std::ofstream(file, std::ios::binary)
            << std::string(free > leave_bytes ? free - leave_bytes : 0, 'x');
    }
    void free() const { fs::remove(path() / "ballast"); }

private:
    TemporaryFolder folder_;
    bool mounted_ = false;
};

// A folder that cannot be written as long as this lives: root writes in spite of permissions, so for
// root it is mounted over itself.
class ReadOnly {
public:
    explicit ReadOnly(fs::path folder) : folder_(std::move(folder)) {
        const char* const path = folder_.c_str();
        if (::geteuid() != 0) {
            permit(false);
            there_ = true;
        } else if (::mount(path, path, nullptr, MS_BIND, nullptr) == 0) {
            constexpr unsigned long flags = MS_REMOUNT | MS_BIND | MS_RDONLY;
            there_ = ::mount(nullptr, path, nullptr, flags, nullptr) == 0;
            if (!there_) ::umount2(path, MNT_DETACH);
        }
    }
    ~ReadOnly() {
        if (!there_) return;
        if (::geteuid() == 0) ::umount2(folder_.c_str(), MNT_DETACH);
        else permit(true);
    }
    ReadOnly(const ReadOnly&) = delete;
    ReadOnly& operator=(const ReadOnly&) = delete;

    [[nodiscard]] bool is_there() const { return there_; }

private:
    void permit(bool writing) const {
        const auto change = writing ? fs::perm_options::add : fs::perm_options::remove;
        for (const auto& entry : fs::recursive_directory_iterator(folder_))
            fs::permissions(entry, fs::perms::owner_write, change);
        fs::permissions(folder_, fs::perms::owner_write, change);
    }

    fs::path folder_;
    bool there_ = false;
};

constexpr const char* no_mount = "this root may not mount";

TEST_F(BatchServer, ADataFolderThatCannotBeWrittenIsToldAtTheStart) {
    const TemporaryFolder folder;
    const ReadOnly read_only(folder.path());
    if (!read_only.is_there()) GTEST_SKIP() << no_mount;
    RelitProcess relitd({.data_dir = folder.path() / "data"});
    EXPECT_EQ(relitd.port(), 0);
    EXPECT_EQ(relitd.exit_status(), 1);
    EXPECT_NE(relitd.log().find("relitd: the data folder"), std::string::npos) << relitd.log();
}

TEST_F(BatchServer, WithADatabaseThatCannotBeWrittenNothingIsAcceptedUntilItCan) {
    const TemporaryFolder folder;
    const std::string id = left_finished_in(folder.path());
    auto read_only = std::make_unique<ReadOnly>(folder.path() / "batches");
    if (!read_only->is_there()) GTEST_SKIP() << no_mount;
    RelitProcess relitd({.data_dir = folder.path()});
    const std::string image = uploaded(relitd.port(), 1, 32);
    const auto post = [&] { return http(relitd.port(), "POST", "/v1/batches", orbit(image, 2)); };
    const auto refused = post();
    EXPECT_EQ(refused.status, 503);
    EXPECT_NE(refused.body.find("/problems/batches-unavailable"), std::string::npos)
        << refused.body;
    EXPECT_EQ(
        http(relitd.port(), "POST", "/v1/render", R"({"height": {"image": ")" + image + "\"}}")
            .status,
        200);
    read_only.reset();
    ASSERT_TRUE(comes_true([&] { return post().status == 202; })) << relitd.log();
    EXPECT_EQ(http(relitd.port(), "GET", "/v1/batches/" + id + "/frames/0").status, 200);
    const Json list = Json::parse(http(relitd.port(), "GET", "/v1/batches").body)["batches"];
    EXPECT_EQ(list.size(), 2u) << "what was refused is not there";
}

// The database is open for writing, and stays so; pictures are new files.
TEST_F(BatchServer, PicturesThatCannotBeWrittenWaitUntilTheyCan) {
    RelitProcess relitd;
    const std::string image = uploaded(relitd.port(), 1, 32);
    const auto post = [&](int count) {
        return http(relitd.port(), "POST", "/v1/batches", orbit(image, count));
    };
    const std::string first = Json::parse(post(1).body)["id"];
    ASSERT_TRUE(comes_true([&] { return batch_at(relitd.port(), first)["status"] == "done"; }));
    std::string id;
    {
        const ReadOnly read_only(relitd.data_dir() / "batches");
        if (!read_only.is_there()) GTEST_SKIP() << no_mount;
        const auto accepted = post(10);
        ASSERT_EQ(accepted.status, 202) << accepted.body;
        id = Json::parse(accepted.body)["id"];
        std::this_thread::sleep_for(300ms);
        const Json batch = batch_at(relitd.port(), id);
        EXPECT_EQ(batch["done"], 0) << "nothing is done that is not durable";
        EXPECT_EQ(batch["failed"], 0) << batch.dump();
    }
    ASSERT_TRUE(comes_true([&] { return batch_at(relitd.port(), id)["status"] == "done"; }))
        << relitd.log();
    EXPECT_EQ(batch_at(relitd.port(), id)["done"], 10);
}

TEST_F(BatchServer, AFullDiskIsToldAndWhatWasAcceptedGoesOnWhenThereIsRoom) {
    const SmallDisk disk;
    if (!disk.is_there()) GTEST_SKIP() << "a file system can be mounted by root only";
    RelitProcess relitd({.data_dir = disk.path() / "data"});
    const std::string image = uploaded(relitd.port(), 1, 256);
    const auto post = [&](const std::string& body) {
        return http(relitd.port(), "POST", "/v1/batches", body);
    };
    const std::string accepted = Json::parse(post(orbit(image, 60)).body)["id"];
    disk.fill(30'000);
    const auto refused = post(orbit(image, 2000));
    EXPECT_EQ(refused.status, 507) << refused.body;
    EXPECT_NE(refused.body.find("/problems/storage-full"), std::string::npos) << refused.body;
    std::this_thread::sleep_for(300ms);
    disk.free();
    ASSERT_TRUE(comes_true([&] { return batch_at(relitd.port(), accepted)["status"] == "done"; }))
        << relitd.log();
    const Json batch = batch_at(relitd.port(), accepted);
    EXPECT_EQ(batch["done"], 60) << batch.dump();
    EXPECT_EQ(post(orbit(image, 2)).status, 202) << "without a restart";
    const Json list = Json::parse(http(relitd.port(), "GET", "/v1/batches").body)["batches"];
    EXPECT_EQ(list.size(), 2u) << "what was refused is not there";
}

TEST_F(BatchServer, ADamagedDatabaseIsToldWhileRendersGoOnAndTakenBackWhenItIsRestored) {
    const TemporaryFolder folder;
    const fs::path database = folder.path() / "batches" / "batches.db";
    const std::string id = left_finished_in(folder.path());
    fs::copy_file(database, folder.path() / "copy");
    std::ofstream(database, std::ios::binary | std::ios::trunc) << std::string(20'000, '?');
    RelitProcess relitd({.data_dir = folder.path()});
    const std::string image = uploaded(relitd.port(), 1, 32);
    const auto refused = http(relitd.port(), "POST", "/v1/batches", orbit(image, 2));
    EXPECT_EQ(refused.status, 503);
    EXPECT_NE(refused.body.find("/problems/batches-unavailable"), std::string::npos)
        << refused.body;
    EXPECT_NE(refused.header("retry-after"), "");
    EXPECT_EQ(
        http(relitd.port(), "POST", "/v1/render", R"({"height": {"image": ")" + image + "\"}}")
            .status,
        200);
    EXPECT_EQ(http(relitd.port(), "GET", "/metrics").status, 200);
    fs::rename(folder.path() / "copy", database);
    EXPECT_TRUE(comes_true([&] {
        return http(relitd.port(), "GET", "/v1/batches/" + id + "/frames/0").status == 200;
    })) << relitd.log();
    EXPECT_EQ(http(relitd.port(), "POST", "/v1/batches", orbit(image, 2)).status, 202);
}

}  // namespace
}  // namespace relit::test
