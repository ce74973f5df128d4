#include "core/io/deflate.h"

#include <cmath>
#include <memory>
#include <vector>

#include <gtest/gtest.h>
#include <zlib.h>

#include "tests/core/io/fixtures.h"
#include "tests/support/maps.h"

namespace relit {
namespace {

using namespace relit::test;
using Bytes = std::vector<std::uint8_t>;

// From flat to without any order, in pieces.
Bytes mixture(std::size_t size, std::uint64_t seed) {
    Random random(seed);
    Bytes bytes(size);
    int noise = 1;
    for (std::size_t i = 0; i < size; ++i) {
        if (i % 4001 == 0) noise = 1 << int(random() * 9);
        bytes[i] = std::uint8_t(int(100 + 20 * std::sin(double(i) / 50)) + int(random() * noise));
    }
    return bytes;
}

std::string deflated(Effort effort, const Bytes& bytes, bool last) {
    std::string out(deflate_bound(bytes.size()), '\x55');
    out.resize(deflate_strip(effort, bytes, last, reinterpret_cast<std::uint8_t*>(out.data())));
    return out;
}

TEST(DeflateStrip, StripsBehindEachOtherAreOneZlibStream) {
    for (const Effort effort : {Effort::fast, Effort::small})
        for (const std::size_t size : {1, 2, 3, 77, 1000, 65535, 65536, 300000}) {
            SCOPED_TRACE(testing::Message() << "strips of " << size);
            constexpr int strips = 12;
            std::string stream = zlib_header;
            Bytes whole;
            std::uint32_t checksum = 1;
            for (int i = 0; i < strips; ++i) {
                const Bytes strip = mixture(size + std::size_t(i), std::uint64_t(i) + size);
                stream += deflated(effort, strip, i + 1 == strips);
                checksum = adler32_joined(checksum, adler32(strip), strip.size());
                whole.insert(whole.end(), strip.begin(), strip.end());
            }
            EXPECT_EQ(checksum, adler32(whole));
            stream += big(checksum, 4);
            Bytes inflated(whole.size() + 1);
            uLongf inflated_size = inflated.size();
            ASSERT_EQ(uncompress(inflated.data(), &inflated_size,
                                 reinterpret_cast<const Bytef*>(stream.data()), stream.size()),
                      Z_OK);
            inflated.resize(inflated_size);
            EXPECT_TRUE(inflated == whole);
        }
}

// What the heap held before is nothing to the encoder: its state is only partly set by itself.
TEST(DeflateStrip, GivesTheSameBytesWhateverMemoryHeldBefore) {
    const Bytes bytes = mixture(250000, 1);
    const std::string first = deflated(Effort::fast, bytes, false);
    for (int value = 0; value < 20; ++value) {
        // Lies where the encoder's state will.
        (void)std::vector<std::uint16_t>(std::size_t(200) << 10, std::uint16_t(value));
        ASSERT_TRUE(deflated(Effort::fast, bytes, false) == first) << value;
    }
}

// ISA-L must not hash where its state lies. So short a strip has a table of 32 hashes, and loses
// its only long match, with what begins at its second byte, when another thing is filed there.
TEST(DeflateStrip, GivesTheSameBytesWhereverTheHeapPutsTheEncoder) {
    Bytes bytes = {2};
    for (int i = 0; i < 60; ++i) bytes.push_back(std::uint8_t(86 + i % 24 / 3 * 5));
    const std::string first = deflated(Effort::fast, bytes, false);
    std::vector<std::unique_ptr<char[]>> in_the_way;
    for (int i = 0; i < 1000; ++i) {
        in_the_way.push_back(std::make_unique_for_overwrite<char[]>(std::size_t(1) << 16));
        ASSERT_TRUE(deflated(Effort::fast, bytes, false) == first) << i;
    }
}

TEST(DeflateStrip, OfNoiseFitsIntoItsBound) {
    Random random(7);
    for (const std::size_t size : {1, 4, 5, 300, 65535, 65537, 131073, 300000, 3000000}) {
        Bytes bytes(size);
        for (std::uint8_t& byte : bytes) byte = std::uint8_t(random() * 256);
        for (const bool last : {false, true})
            EXPECT_LE(deflated(Effort::fast, bytes, last).size(), size + 30 + size / 6000);
    }
}

TEST(DeflateStrip, SmallIsSmallerThanFast) {
    const Bytes bytes = mixture(250000, 1);
    EXPECT_LT(deflated(Effort::small, bytes, true).size(),
              deflated(Effort::fast, bytes, true).size());
}

}  // namespace
}  // namespace relit
