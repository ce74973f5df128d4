// Archives byte by byte, as those who unpack them read them.
#include <gtest/gtest.h>

#include "core/io/deflate.h"
#include "server/archive/tar.h"
#include "server/archive/zip.h"

namespace relit::server {
namespace {

std::uint64_t number_at(const std::string& bytes, std::size_t offset, int size) {
    std::uint64_t number = 0;
    for (int i = size - 1; i >= 0; --i)
        number = number << 8 | static_cast<unsigned char>(bytes.at(offset + std::size_t(i)));
    return number;
}

TEST(Crc32, IsThatOfZipAndPng) {
    const std::string text = "123456789";
    const std::span bytes(reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
    EXPECT_EQ(crc32(bytes), 0xcbf43926u);
    EXPECT_EQ(crc32(bytes.subspan(4), crc32(bytes.first(4))), 0xcbf43926u);
}

TEST(Tar, HeadsAreBlocksWithNameSizeAndChecksum) {
    const std::string head = tar_head("0001.png", 1234, 1'000'000'000);
    ASSERT_EQ(head.size(), 512u);
    EXPECT_STREQ(head.c_str(), "0001.png");
    EXPECT_EQ(head.substr(124, 11), "00000002322");
    EXPECT_EQ(head.substr(136, 11), "07346545000");
    EXPECT_EQ(head.substr(257, 5), "ustar");
    unsigned sum = 0;
    for (std::size_t i = 0; i < 512; ++i)
        sum += i >= 148 && i < 156 ? ' ' : static_cast<unsigned char>(head[i]);
    EXPECT_EQ(std::stoul(head.substr(148, 6), nullptr, 8), sum);
}

TEST(Tar, FilesEndAtWholeBlocks) {
    EXPECT_EQ(tar_padding(0).size(), 0u);
    EXPECT_EQ(tar_padding(1).size(), 511u);
    EXPECT_EQ(tar_padding(512).size(), 0u);
    EXPECT_EQ(tar_end(), std::string(1024, '\0'));
    EXPECT_EQ(tar_head(std::string(100, 'n'), (1ull << 33) - 1, 0).substr(0, 100),
              std::string(100, 'n'));
}

TEST(Zip, TheDirectoryLeadsToEveryFile) {
    ZipWriter zip;
    std::string bytes = zip.head("a.png", 3, 0x11223344, 1'000'000'000) + "abc";
    const std::size_t second = bytes.size();
    bytes += zip.head("b.png", 2, 0x55667788, 1'000'000'000) + "de";
    const std::size_t directory = bytes.size();
    bytes += zip.end();
    const std::size_t end = bytes.size() - 22;
    EXPECT_EQ(bytes.substr(end, 4), "PK\5\6");
    EXPECT_EQ(number_at(bytes, end + 10, 2), 2u);
    EXPECT_EQ(number_at(bytes, end + 16, 4), directory);
    EXPECT_EQ(number_at(bytes, end + 12, 4), end - directory);
    const std::size_t entry = directory + 46 + 5;  // the second: behind the first and its name
    EXPECT_EQ(bytes.substr(entry, 4), "PK\1\2");
    EXPECT_EQ(number_at(bytes, entry + 16, 4), 0x55667788u);
    EXPECT_EQ(number_at(bytes, entry + 24, 4), 2u);
    EXPECT_EQ(number_at(bytes, entry + 42, 4), second);
    EXPECT_EQ(bytes.substr(second, 4), "PK\3\4");
    EXPECT_EQ(bytes.substr(second + 30, 7), "b.pngde");
}

TEST(Zip, FarFilesAndManyFilesAreZip64) {
    ZipWriter far;
    (void)far.head("a", 0xfffffffe, 0, 0);
    (void)far.head("b", 1, 0, 0);
    const std::string end = far.end();
    const std::size_t entry = 46 + 1;  // of b
    EXPECT_EQ(number_at(end, entry + 42, 4), 0xffffffffu);
    EXPECT_EQ(number_at(end, entry + 47 + 4, 8), 0xfffffffeull + 31) << "head, name and file of a";
    const std::size_t record = end.size() - 22 - 20 - 56;
    EXPECT_EQ(end.substr(record, 4), "PK\6\6");
    EXPECT_EQ(number_at(end, record + 32, 8), 2u);
    EXPECT_EQ(end.substr(end.size() - 42, 4), "PK\6\7");

    ZipWriter many;
    for (int i = 0; i < 65'535; ++i) (void)many.head("x", 0, 0, 0);
    const std::string list = many.end();
    EXPECT_EQ(number_at(list, list.size() - 22 + 10, 2), 0xffffu);
    EXPECT_EQ(number_at(list, list.size() - 22 - 20 - 56 + 32, 8), 65'535u);
}

}  // namespace
}  // namespace relit::server
