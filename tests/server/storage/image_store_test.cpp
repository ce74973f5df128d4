#include "server/storage/image_store.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <fstream>
#include <optional>
#include <set>
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

fs::path image_file(const fs::path& folder, const std::string& id) {
    return folder / "images" / id.substr(0, 2) / id.substr(2, 2) / id;
}

fs::path facts_file(const fs::path& folder, const std::string& id) {
    return image_file(folder, id).string() + ".info";
}

// An image of 100 bytes, another one for each letter.
std::string hundred(char letter) { return std::string(100, letter); }

std::string id_of(char letter) { return ImageStore::id_of(hundred(letter)); }

// The letters of those that are there.
std::string stored_of(const ImageStore& store, const std::string& letters) {
    std::string stored;
    for (const char letter : letters)
        if (store.contains(id_of(letter))) stored += letter;
    return stored;
}

std::string sentence_of(const auto& action) {
    try {
        action();
        return "done";
    } catch (const Error& error) {
        return error.what();
    }
}

std::vector<std::string> ids_of(const std::vector<StoredImage>& images) {
    std::vector<std::string> ids;
    ids.reserve(images.size());
    for (const StoredImage& image : images) ids.push_back(image.id);
    return ids;
}

std::uint64_t bytes_in(const fs::path& folder) {
    std::uint64_t bytes = 0;
    for (const auto& entry : fs::recursive_directory_iterator(folder))
        if (entry.is_regular_file() && entry.path().extension() != ".info")
            bytes += entry.file_size();
    return bytes;
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
    const auto id = ImageStore(folder.path()).put(test::small_png(), info).id;
    const auto facts = facts_file(folder.path(), id);
    for (const char* damage : {"", "relit-image 1\nformat png\n", "relit-image 9\n"}) {
        if (*damage) std::ofstream(facts) << damage;
        else fs::remove(facts);
        const ImageStore store(folder.path());
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
    EXPECT_FALSE(fs::exists(folder.path() / "data")) << "nothing of it is made anew";
}

TEST(ImageStore, LeastRecentlyUsedImagesGoFirst) {
    const TemporaryFolder folder;
    ImageStore store(folder.path(), {.max_bytes = 350});
    for (const char letter : {'a', 'b', 'c'}) store.put(hundred(letter), info);
    (void)store.get(id_of('a'));
    EXPECT_FALSE(store.put(hundred('b'), info).created);
    (void)store.list(10);  // is no use of any
    store.put(hundred('d'), info);
    EXPECT_EQ(stored_of(store, "abcd"), "abd");
    (void)store.info(id_of('a'));
    store.put(hundred('e'), info);
    EXPECT_EQ(stored_of(store, "abcde"), "ade");
    EXPECT_TRUE(store.find(id_of('a')));
    store.put(hundred('f'), info);
    store.put(hundred('g'), info);
    EXPECT_EQ(stored_of(store, "abcdefg"), "afg");

    EXPECT_EQ(store.stored_bytes(), 300u);
    EXPECT_EQ(store.stored_images(), 3u);
    EXPECT_EQ(store.evicted_images(), 4u);
    EXPECT_EQ(files_in(folder.path() / "images"), 6u) << "the evicted ones' files are gone";
    EXPECT_EQ(code_of([&] { (void)store.get(id_of('b')); }), "not-found");
    EXPECT_EQ(sentence_of([&] { (void)store.get(id_of('b')); }),
              "There is no image with this id: upload it (again).");
    EXPECT_TRUE(store.put(hundred('b'), info).created) << "it may come again";
}

TEST(ImageStore, AnImageThatJustFillsTheBudgetIsKeptAlone) {
    const TemporaryFolder folder;
    ImageStore store(folder.path(), {.max_bytes = 200});
    store.put(hundred('a'), info);
    store.put(hundred('b'), info);
    EXPECT_EQ(stored_of(store, "ab"), "ab");
    const auto id = store.put(std::string(200, 'x'), info).id;
    EXPECT_EQ(stored_of(store, "ab"), "");
    EXPECT_EQ(store.get(id).bytes.size(), 200u);
}

TEST(ImageStore, AnImageLargerThanTheBudgetIsRefusedAndNothingEvicted) {
    const TemporaryFolder folder;
    ImageStore store(folder.path(), {.max_bytes = 200});
    store.put(hundred('a'), info);
    const std::string large(201, 'x');
    EXPECT_EQ(code_of([&] { store.put(large, info); }), "storage-full");
    EXPECT_EQ(
        sentence_of([&] { store.put(large, info); }),
        "The image has 201 bytes, and all stored images together may have 200 (max-storage).");
    EXPECT_EQ(stored_of(store, "a"), "a");
    EXPECT_EQ(store.evicted_images(), 0u);
}

TEST(ImageStore, ImagesInUseAreNeverEvicted) {
    const TemporaryFolder folder;
    ImageStore store(folder.path(), {.max_bytes = 300});
    for (const char letter : {'a', 'b', 'c'}) store.put(hundred(letter), info);
    std::optional<SharedBytes> a = store.get(id_of('a'));
    const auto b = store.get(id_of('b'));
    const auto c = store.get(id_of('c'));
    EXPECT_EQ(code_of([&] { store.put(hundred('d'), info); }), "storage-full");
    const auto sentence = sentence_of([&] { store.put(hundred('d'), info); });
    EXPECT_NE(sentence.find("300 bytes (max-storage)"), std::string::npos) << sentence;
    EXPECT_EQ(stored_of(store, "abc"), "abc");

    const auto again = store.get(id_of('a'));
    EXPECT_EQ(again.bytes.data(), a->bytes.data()) << "one mapping for all";
    a.reset();
    EXPECT_EQ(code_of([&] { store.put(hundred('d'), info); }), "storage-full")
        << "one of its two readers is left";
    EXPECT_EQ(again.bytes, hundred('a'));
}

// What would not make room enough is not given up in vain.
TEST(ImageStore, NothingIsEvictedWhereThatIsNotEnough) {
    const TemporaryFolder folder;
    ImageStore store(folder.path(), {.max_bytes = 300});
    for (const char letter : {'a', 'b', 'c'}) store.put(hundred(letter), info);
    std::optional<SharedBytes> a = store.get(id_of('a'));
    EXPECT_EQ(code_of([&] { store.put(std::string(250, 'x'), info); }), "storage-full");
    EXPECT_EQ(stored_of(store, "abc"), "abc");
    a.reset();
    EXPECT_EQ(code_of([&] { store.put(std::string(250, 'x'), info); }), "done");
    EXPECT_EQ(stored_of(store, "abc"), "");
}

TEST(ImageStore, UseIsRememberedAcrossRestarts) {
    const TemporaryFolder folder;
    {
        ImageStore store(folder.path());
        for (const char letter : {'a', 'b', 'c', 'd'}) store.put(hundred(letter), info);
    }
    const auto now = fs::file_time_type::clock::now();
    int hours = 0;
    for (const char letter : {'c', 'a', 'd', 'b'})
        fs::last_write_time(facts_file(folder.path(), id_of(letter)),
                            now - std::chrono::hours(10 - hours++));
    const auto stored = fs::last_write_time(image_file(folder.path(), id_of('c')));
    fs::remove(facts_file(folder.path(), id_of('d')));  // then it was used last when it was stored
    {
        ImageStore store(folder.path());
        (void)store.get(id_of('c'));
    }
    EXPECT_LT(now - fs::last_write_time(facts_file(folder.path(), id_of('c'))),
              std::chrono::seconds(1));
    EXPECT_EQ(fs::last_write_time(image_file(folder.path(), id_of('c'))), stored)
        << "the time of its creation stays";
    ImageStore store(folder.path(), {.max_bytes = 400});
    std::string order;
    for (const char letter : {'e', 'f', 'g'}) {
        const auto before = stored_of(store, "abcd");
        store.put(hundred(letter), info);
        for (const char old : before)
            if (!store.contains(id_of(old))) order += old;
    }
    EXPECT_EQ(order, "abd");
    EXPECT_EQ(stored_of(store, "abcd"), "c");
}

TEST(ImageStore, TheFolderHearsOfUseAtMostOnceAMinute) {
    const TemporaryFolder folder;
    const auto id = ImageStore(folder.path()).put("abc", info).id;
    const auto facts = facts_file(folder.path(), id);
    const auto now = fs::file_time_type::clock::now();
    for (const auto& [age, is_written] :
         {std::pair(std::chrono::seconds(40), false), std::pair(std::chrono::seconds(61), true),
          std::pair(std::chrono::seconds(-3600), true)}) {  // the clock has been set back
        fs::last_write_time(facts, now - age);
        const auto before = fs::last_write_time(facts);
        const ImageStore store(folder.path());
        (void)store.get(id);
        EXPECT_EQ(fs::last_write_time(facts) != before, is_written) << age.count();
        const auto after = fs::last_write_time(facts);
        (void)store.get(id);
        EXPECT_EQ(fs::last_write_time(facts), after);
    }
}

TEST(ImageStore, StartWithASmallerBudgetEvictsDownToIt) {
    const TemporaryFolder folder;
    {
        ImageStore store(folder.path());
        for (const char letter : {'a', 'b', 'c', 'd'}) store.put(hundred(letter), info);
    }
    const ImageStore store(folder.path(), {.max_bytes = 250});
    EXPECT_EQ(stored_of(store, "abcd"), "cd");
    EXPECT_EQ(store.evicted_images(), 2u);
    EXPECT_EQ(files_in(folder.path() / "images"), 4u);
}

TEST(ImageStore, ForeignFilesAreLeftAloneAndCountNothing) {
    const TemporaryFolder folder;
    const auto id = ImageStore(folder.path()).put("abc", info).id;
    const auto place = image_file(folder.path(), id).parent_path();
    const fs::path foreign[] = {folder.path() / "images" / "note.txt", place / "note",
                                place / "note.info", place / std::string(64, 'f'),
                                place / (std::string(64, 'f') + ".info")};
    for (const auto& path : foreign) std::ofstream(path) << std::string(5000, 'x');
    fs::create_directories(image_file(folder.path(), id_of('a')).parent_path());
    fs::create_symlink(place / id, image_file(folder.path(), id_of('a')));
    ImageStore store(folder.path(), {.max_bytes = 200});
    EXPECT_EQ(store.stored_images(), 1u);
    EXPECT_EQ(store.stored_bytes(), 3u);
    EXPECT_FALSE(store.contains(std::string(64, 'f')));
    EXPECT_FALSE(store.contains(id_of('a')));
    for (const char letter : {'b', 'c', 'd'}) store.put(hundred(letter), info);
    for (const auto& path : foreign) EXPECT_TRUE(fs::exists(path)) << path;
}

// A crash between the two renames of put(), or between the two deletions of an eviction.
TEST(ImageStore, FactsWithoutTheirImageAreRemovedAtStart) {
    const TemporaryFolder folder;
    const auto id = ImageStore(folder.path()).put("abc", info).id;
    fs::remove(image_file(folder.path(), id));
    ImageStore store(folder.path());
    EXPECT_FALSE(store.contains(id));
    EXPECT_EQ(files_in(folder.path() / "images"), 0u);
    EXPECT_TRUE(store.put("abc", info).created);
    EXPECT_EQ(store.get(id).bytes, "abc");
}

TEST(ImageStore, AnImageDeletedOrCutByOthersIsForgottenAndMayComeAgain) {
    const TemporaryFolder folder;
    ImageStore store(folder.path());
    const auto id = store.put("abc", info).id;
    const auto file = image_file(folder.path(), id);
    for (const bool cut : {false, true}) {
        if (cut) fs::resize_file(file, 1);
        else fs::remove(file);
        EXPECT_EQ(code_of([&] { (void)store.get(id); }), "not-found");
        EXPECT_EQ(store.stored_bytes(), 0u);
        EXPECT_TRUE(store.put("abc", info).created);
        EXPECT_EQ(store.get(id).bytes, "abc");
    }
}

TEST(ImageStore, AFailedPutGivesItsRoomBack) {
    const TemporaryFolder folder;
    ImageStore store(folder.path(), {.max_bytes = 100});
    fs::rename(folder.path() / "incoming", folder.path() / "away");
    for (int i = 0; i < 3; ++i)
        EXPECT_EQ(code_of([&] { store.put(hundred('a'), info); }), "storage-failed");
    fs::rename(folder.path() / "away", folder.path() / "incoming");
    EXPECT_TRUE(store.put(hundred('a'), info).created);
    EXPECT_EQ(store.stored_bytes(), 100u);
}

// Readers hold images now and then, writers fill the store again and again: the budget holds at
// every moment, no reader finds wrong bytes, and the index is the folder's in the end.
TEST(ImageStore, TheBudgetHoldsWhileManyPutReadAndRemove) {
    const TemporaryFolder folder;
    constexpr std::uint64_t budget = 1000;
    std::atomic<int> refused{0};
    std::atomic<std::uint64_t> most{0};
    {
        ImageStore store(folder.path(), {.max_bytes = budget});
        std::vector<std::thread> threads;
        threads.reserve(8);
        for (int thread = 0; thread < 8; ++thread)
            threads.emplace_back([&, thread] {
                for (int i = 0; i < 60; ++i) {
                    const char letter = char('a' + (thread % 4 * 60 + i * 7) % 26);
                    const auto put = code_of([&] { store.put(hundred(letter), info); });
                    if (put != "done") {
                        EXPECT_EQ(put, "storage-full");
                        ++refused;
                    }
                    if (const auto now = store.stored_bytes(); now > most) most = now;
                    try {
                        const auto held = store.get(id_of(letter));
                        EXPECT_EQ(held.bytes, hundred(letter));
                        if (i % 5 == 0) store.remove(id_of(letter));
                    } catch (const Error& error) {
                        EXPECT_EQ(error.code, "not-found");
                    }
                }
            });
        for (auto& thread : threads) thread.join();
        EXPECT_LE(most, budget);
        EXPECT_GT(store.evicted_images(), 0u);
        EXPECT_EQ(bytes_in(folder.path() / "images"), store.stored_bytes());
        EXPECT_EQ(files_in(folder.path() / "images"), 2 * store.stored_images());
        EXPECT_LT(refused, 8 * 60);
    }
    EXPECT_EQ(files_in(folder.path() / "incoming"), 0u);
    const ImageStore store(folder.path(), {.max_bytes = budget});
    EXPECT_EQ(bytes_in(folder.path() / "images"), store.stored_bytes());
}

TEST(ImageStore, ListsNewestFirstInPages) {
    const TemporaryFolder folder;
    std::vector<std::string> expected;
    {
        ImageStore store(folder.path());
        for (const char letter : {'a', 'b', 'c', 'd', 'e'}) {
            store.put(hundred(letter), info);
            expected.insert(expected.begin(), id_of(letter));
        }
        store.put(hundred('a'), info);  // there before: no newer for that
        EXPECT_EQ(ids_of(store.list(10).images), expected);
    }
    const ImageStore store(folder.path());  // creation is in the folder
    EXPECT_EQ(ids_of(store.list(10).images), expected);
    EXPECT_EQ(ids_of(store.list(5).images), expected);
    EXPECT_FALSE(store.list(5).next) << "there is no sixth";
    std::vector<std::string> listed;
    std::optional<ImagePlace> after;
    do {
        const auto page = store.list(2, after);
        for (const auto& image : page.images) {
            listed.push_back(image.id);
            EXPECT_EQ(image.info.width, 16);
            EXPECT_EQ(image.size_bytes, 100u);
            EXPECT_EQ(image.created, store.info(image.id).created);
        }
        after = page.next;
    } while (after);
    EXPECT_EQ(listed, expected);
}

TEST(ImageStore, APageGoesOnWhereTheLastImageIsGone) {
    const TemporaryFolder folder;
    ImageStore store(folder.path());
    for (const char letter : {'a', 'b', 'c', 'd'}) store.put(hundred(letter), info);
    const auto first = store.list(2);
    ASSERT_TRUE(first.next);
    store.remove(id_of('c'));
    store.put(hundred('e'), info);
    EXPECT_EQ(ids_of(store.list(2, first.next).images), (std::vector{id_of('b'), id_of('a')}));
    store.put(hundred('c'), info);
    EXPECT_EQ(ids_of(store.list(2, first.next).images), (std::vector{id_of('b'), id_of('a')}))
        << "what is back is new";
}

TEST(ImageStore, ListsWhatStaysExactlyOnceWhileOthersComeAndGo) {
    const TemporaryFolder folder;
    ImageStore store(folder.path());
    std::set<std::string> lasting;
    for (int i = 0; i < 40; ++i) {
        lasting.insert(store.put("lasting " + std::to_string(i), info).id);
        store.put("passing " + std::to_string(i), info);
    }
    std::atomic<bool> stop{false};
    std::vector<std::thread> changing;
    changing.reserve(2);
    for (int thread = 0; thread < 2; ++thread)
        changing.emplace_back([&, thread] {
            for (int i = thread; !stop; i = (i + 2) % 40) {
                const std::string bytes = "passing " + std::to_string(i);
                if (store.contains(ImageStore::id_of(bytes)))
                    store.remove(ImageStore::id_of(bytes));
                else store.put(bytes, info);
            }
        });
    for (int round = 0; round < 30; ++round) {
        std::set<std::string> listed;
        std::optional<ImagePlace> after;
        do {
            const auto page = store.list(7, after);
            for (const auto& image : page.images)
                EXPECT_TRUE(listed.insert(image.id).second) << "twice";
            after = page.next;
        } while (after);
        for (const auto& id : lasting) EXPECT_TRUE(listed.contains(id)) << "missing";
    }
    stop = true;
    for (auto& thread : changing) thread.join();
}

TEST(ImageStore, AnImageThatCannotBeDecodedDoesNotHideTheOthers) {
    const TemporaryFolder folder;
    {
        ImageStore store(folder.path());
        store.put("no image at all", info);
        store.put(hundred('a'), info);
    }
    fs::remove(facts_file(folder.path(), ImageStore::id_of("no image at all")));
    EXPECT_EQ(ids_of(ImageStore(folder.path()).list(10).images), std::vector{id_of('a')});
}

class BuiltInImages : public testing::Test {
protected:
    const std::string png_ = test::small_png();
    const std::string id_ = ImageStore::id_of(png_);
    const TemporaryFolder folder_;
    ImageStore store_{folder_.path(), {.max_bytes = png_.size() + 100, .built_in = {{id_, png_}}}};
};

TEST_F(BuiltInImages, AreThereWithoutBeingStored) {
    EXPECT_EQ(store_.get(id_).bytes.data(), png_.data()) << "not a copy";
    const auto image = store_.info(id_);
    EXPECT_EQ(image.id, id_);
    EXPECT_EQ(image.info.width, 16);
    EXPECT_EQ(image.size_bytes, png_.size());
    EXPECT_FALSE(image.created);
    EXPECT_FALSE(store_.contains(id_));
    EXPECT_FALSE(store_.find(id_));
    EXPECT_FALSE(store_.place(id_));
    EXPECT_TRUE(store_.list(10).images.empty());
    EXPECT_EQ(store_.stored_images(), 0u);
    EXPECT_EQ(store_.stored_bytes(), 0u);
}

TEST_F(BuiltInImages, AreNotDeleted) {
    EXPECT_EQ(code_of([&] { store_.remove(id_); }), "conflict");
    EXPECT_EQ(sentence_of([&] { store_.remove(id_); }),
              "This image is a sample that ships with the server: it cannot be deleted.");
    EXPECT_EQ(store_.get(id_).bytes, png_);
}

TEST_F(BuiltInImages, AreStoredAsAnyOtherWhenTheyAreUploaded) {
    EXPECT_TRUE(store_.put(png_, info).created);
    EXPECT_TRUE(store_.contains(id_));
    EXPECT_TRUE(store_.info(id_).created);
    EXPECT_EQ(ids_of(store_.list(10).images), std::vector{id_});
    EXPECT_NE(store_.get(id_).bytes.data(), png_.data());
    for (const char letter : {'a', 'b'}) store_.put(hundred(letter), info);
    EXPECT_FALSE(store_.contains(id_)) << "the copy is evicted as any other";
    EXPECT_EQ(store_.get(id_).bytes, png_) << "and the built-in one is still there";

    store_.put(png_, info);
    EXPECT_EQ(code_of([&] { store_.remove(id_); }), "done");
    EXPECT_EQ(code_of([&] { store_.remove(id_); }), "conflict");
}

}  // namespace
}  // namespace relit::server
