#include "server/storage/image_store.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <fstream>
#include <optional>
#include <thread>
#include <vector>

#include "server/error_codes.h"
#include "server/storage/image_info_file.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/upload_images.h"

namespace relit::server {
namespace {

namespace fs = std::filesystem;
using test::TemporaryFolder;

const ImageInfo info{.format = FileFormat::png,
                     .type = SampleType::uint16,
                     .width = 16,
                     .height = 12,
                     .channels = 1,
                     .has_alpha = false};

std::string code_of(const auto& action) {
    try {
        action();
        return "done";
    } catch (const Error& error) {
        EXPECT_EQ(std::string(error.what()).find('/'), std::string::npos)
            << "a path? " << error.what();
        return std::string(error.code);
    }
}

std::size_t files_in(const fs::path& folder) {
    std::size_t count = 0;
    for (const auto& entry : fs::recursive_directory_iterator(folder))
        count += entry.is_regular_file() ? 1 : 0;
    return count;
}

TEST(ImageStore, KeepsBytesUnderTheirHash) {
    const TemporaryFolder folder;
    ImageStore store(folder.path());
    const auto put = store.put("abc", info);
    EXPECT_EQ(
        put.id,
        "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");  // FIPS 180-2, B.1
    EXPECT_TRUE(put.created);
    EXPECT_EQ(put.id, ImageStore::id_of("abc"));
    EXPECT_EQ(store.get(put.id).bytes, "abc");
    EXPECT_EQ(store.info(put.id).size_bytes, 3u);
    EXPECT_EQ(store.info(put.id).info.type, SampleType::uint16);
    EXPECT_FALSE(store.put("abc", info).created);
}

TEST(ImageStore, KeepsThemAcrossRestarts) {
    const TemporaryFolder folder;
    const std::string bytes = test::small_png();
    std::string id;
    {
        ImageStore store(folder.path() / "new" / "folder");
        id = store.put(bytes, info).id;
    }
    const ImageStore store(folder.path() / "new" / "folder");
    EXPECT_EQ(store.get(id).bytes, bytes);
    EXPECT_EQ(store.info(id).info.width, 16);
}

TEST(ImageStore, RemovedImagesAreGoneButStayReadableForWhoHasThem) {
    const TemporaryFolder folder;
    ImageStore store(folder.path());
    const auto id = store.put("abc", info).id;
    const auto held = store.get(id);
    store.remove(id);
    EXPECT_EQ(held.bytes, "abc");
    EXPECT_FALSE(store.contains(id));
    EXPECT_EQ(code_of([&] { (void)store.get(id); }), "not-found");
    EXPECT_EQ(code_of([&] { (void)store.info(id); }), "not-found");
    EXPECT_EQ(code_of([&] { store.remove(id); }), "not-found");
    EXPECT_EQ(files_in(folder.path() / "images"), 0u);
    EXPECT_TRUE(store.put("abc", info).created);
}

TEST(ImageStore, WhatIsNoIdNeverTouchesAPath) {
    const TemporaryFolder folder;
    ImageStore store(folder.path());
    std::ofstream(folder.path() / "secret") << "x";
    for (const std::string& id :
         {std::string(), std::string("../secret"), std::string(64, 'A'), std::string(63, 'a'),
          std::string(65, 'a'), "../" + std::string(61, 'a'), std::string(64, '\0'),
          std::string(63, 'a') + "/"}) {
        EXPECT_FALSE(store.contains(id));
        EXPECT_EQ(code_of([&] { (void)store.get(id); }), "not-found");
        EXPECT_EQ(code_of([&] { store.remove(id); }), "not-found");
    }
}

TEST(ImageStore, FactsThatAreLostAreReadFromTheImageAgain) {
    const TemporaryFolder folder;
    ImageStore store(folder.path());
    const auto id = store.put(test::small_png(), info).id;
    const auto facts =
        folder.path() / "images" / id.substr(0, 2) / id.substr(2, 2) / (id + ".info");
    for (const char* damage : {"", "relit-image 1\nformat png\n", "relit-image 9\n"}) {
        if (*damage) std::ofstream(facts) << damage;
        else fs::remove(facts);
        const auto found = store.info(id).info;
        EXPECT_EQ(found.width, 16);
        EXPECT_EQ(found.height, 12);
        EXPECT_EQ(found.type, SampleType::uint16);
        EXPECT_TRUE(fs::exists(facts)) << "and are written again";
    }
}

TEST(ImageInfoFile, IsReadBackAsWritten) {
    for (const auto format : {FileFormat::png, FileFormat::jpeg, FileFormat::webp, FileFormat::tiff,
                              FileFormat::exr, FileFormat::hdr})
        for (const auto type :
             {SampleType::uint8, SampleType::int16, SampleType::float16, SampleType::float64}) {
            const ImageInfo written{.format = format,
                                    .type = type,
                                    .width = 3,
                                    .height = 5,
                                    .channels = 4,
                                    .has_alpha = true};
            const auto text = image_info_text(written);
            const auto found = parse_image_info(text);
            ASSERT_TRUE(found);
            EXPECT_EQ(image_info_text(*found), text);
            for (std::size_t size = 0; size < text.size(); ++size)
                EXPECT_FALSE(parse_image_info(std::string_view(text).substr(0, size))) << size;
        }
}

TEST(ImageStore, LeftoversOfACrashAreRemovedAtStart) {
    const TemporaryFolder folder;
    const auto id = [&] { return ImageStore(folder.path()).put("abc", info).id; }();
    std::ofstream(folder.path() / "incoming" / "Xyz123") << "half an image";
    const ImageStore store(folder.path());
    EXPECT_EQ(files_in(folder.path() / "incoming"), 0u);
    EXPECT_EQ(store.get(id).bytes, "abc");
}

TEST(ImageStore, PutsOfTheSameBytesAtOnceCreateThemOnce) {
    const TemporaryFolder folder;
    ImageStore store(folder.path());
    std::atomic<int> created{0};
    std::vector<std::thread> threads;
    threads.reserve(8);
    for (int i = 0; i < 8; ++i)
        threads.emplace_back([&] {
            for (int k = 0; k < 10; ++k) {
                const std::string bytes(1000 + std::size_t(k), 'x');
                const auto put = store.put(bytes, info);
                created += put.created ? 1 : 0;
                EXPECT_EQ(store.get(put.id).bytes, bytes);
            }
        });
    for (auto& thread : threads) thread.join();
    EXPECT_EQ(created, 10);
    EXPECT_EQ(files_in(folder.path() / "images"), 20u) << "an image and its facts each";
    EXPECT_EQ(files_in(folder.path() / "incoming"), 0u);
}

TEST(ImageStore, FolderInUseIsRefused) {
    const TemporaryFolder folder;
    auto first = std::make_optional<ImageStore>(folder.path());
    try {
        const ImageStore second(folder.path());
        FAIL() << "two stores in one folder";
    } catch (const std::runtime_error& error) {
        EXPECT_NE(std::string(error.what()).find("in use by another relitd"), std::string::npos)
            << error.what();
    }
    first.reset();
    EXPECT_NO_THROW(ImageStore(folder.path()));
}

TEST(ImageStore, FolderThatCannotBeWrittenIsRefusedByName) {
    if (::geteuid() == 0) GTEST_SKIP() << "root may write everywhere";
    const TemporaryFolder folder;
    fs::permissions(folder.path(), fs::perms::owner_read | fs::perms::owner_exec);
    EXPECT_THROW(ImageStore(folder.path()), std::runtime_error);
    fs::permissions(folder.path(), fs::perms::owner_all);
}

TEST(ImageStore, FileInPlaceOfTheFolderIsRefusedByName) {
    const TemporaryFolder folder;
    std::ofstream(folder.path() / "file") << "x";
    try {
        const ImageStore store(folder.path() / "file");
        FAIL();
    } catch (const std::runtime_error& error) {
        EXPECT_NE(std::string(error.what()).find("data folder"), std::string::npos) << error.what();
    }
}

// A file-size limit fails a write half way through, as a full disk does.
TEST(ImageStore, FullDiskIsAnErrorAndLeavesNothingBehind) {
    const TemporaryFolder folder;
    ImageStore store(folder.path());
    rlimit before{};
    ::getrlimit(RLIMIT_FSIZE, &before);
    const auto old_handler = std::signal(SIGXFSZ, SIG_IGN);
    const rlimit small{.rlim_cur = 100'000, .rlim_max = before.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &small);
    const std::string bytes(200'000, 'x');
    EXPECT_EQ(code_of([&] { store.put(bytes, info); }), "storage-full");
    ::setrlimit(RLIMIT_FSIZE, &before);
    std::signal(SIGXFSZ, old_handler);
    EXPECT_EQ(files_in(folder.path() / "incoming"), 0u);
    EXPECT_EQ(files_in(folder.path() / "images"), 0u);
    EXPECT_TRUE(store.put(bytes, info).created);
}

TEST(ImageStore, VanishedFolderIsAnErrorWithoutAPath) {
    const TemporaryFolder folder;
    ImageStore store(folder.path() / "data");
    fs::remove_all(folder.path() / "data");
    EXPECT_EQ(code_of([&] { store.put("abc", info); }), "storage-failed");
}

}  // namespace
}  // namespace relit::server
