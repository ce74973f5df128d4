#include "server/storage/image_index.h"

#include <gtest/gtest.h>

namespace relit::server {
namespace {

FileTime at(int nanoseconds) { return FileTime(std::chrono::nanoseconds(nanoseconds)); }

ImageIndex::Entry entry(std::uint64_t size_bytes, int created) {
    return {.size_bytes = size_bytes,
            .created = at(created),
            .use_written = at(created),
            .info = {},
            .mapped = {}};
}

using Ids = std::vector<std::string>;

Ids newest(const ImageIndex& index, std::size_t limit,
           const std::optional<ImagePlace>& after = {}) {
    Ids ids;
    for (const ImagePlace& place : index.newest(limit, after)) ids.push_back(place.id);
    return ids;
}

TEST(ImageIndex, CountsWhatIsThere) {
    ImageIndex index;
    index.add("a", entry(10, 1));
    index.add("b", entry(5, 2));
    EXPECT_EQ(index.size_bytes(), 15u);
    EXPECT_EQ(index.count(), 2u);
    index.remove("a");
    EXPECT_EQ(index.size_bytes(), 5u);
    EXPECT_EQ(index.count(), 1u);
    EXPECT_EQ(index.find("a"), nullptr);
    EXPECT_EQ(index.find("b")->size_bytes, 5u);
    EXPECT_EQ(newest(index, 9), Ids{"b"});
}

TEST(ImageIndex, LeastRecentAreAsManyAsAreNeeded) {
    ImageIndex index;
    for (const char* id : {"a", "b", "c"}) index.add(id, entry(10, 1));
    EXPECT_EQ(index.least_recent(0), Ids{});
    EXPECT_EQ(index.least_recent(1), Ids{"a"});
    EXPECT_EQ(index.least_recent(10), Ids{"a"});
    EXPECT_EQ(index.least_recent(11), (Ids{"a", "b"}));
    EXPECT_EQ(index.least_recent(30), (Ids{"a", "b", "c"}));
    EXPECT_EQ(index.least_recent(31), std::nullopt);
    index.use("a");
    EXPECT_EQ(index.least_recent(20), (Ids{"b", "c"}));
    const auto reader = std::make_shared<int>(0);
    index.find("b")->mapped = reader;
    EXPECT_EQ(index.least_recent(20), (Ids{"c", "a"})) << "b is held";
    EXPECT_EQ(index.least_recent(21), std::nullopt);
}

TEST(ImageIndex, NewestFirstThenById) {
    ImageIndex index;
    index.add("c", entry(1, 5));
    index.add("a", entry(1, 5));
    index.add("b", entry(1, 7));
    index.add("d", entry(1, 3));
    EXPECT_EQ(newest(index, 9), (Ids{"b", "c", "a", "d"}));
    EXPECT_EQ(newest(index, 2), (Ids{"b", "c"}));
    EXPECT_EQ(newest(index, 9, ImagePlace{at(5), "c"}), (Ids{"a", "d"}));
    EXPECT_EQ(newest(index, 9, ImagePlace{at(5), "b"}), (Ids{"a", "d"})) << "of one that is gone";
    EXPECT_EQ(newest(index, 9, ImagePlace{at(3), "d"}), Ids{});
    EXPECT_EQ(newest(index, 0), Ids{});
}

}  // namespace
}  // namespace relit::server
