#include "server/http/chunk_framing.h"

#include <gtest/gtest.h>

#include <string>

namespace relit::server {
namespace {

bool follows(const std::string& body) { return ChunkFraming{}.follow(body); }

const std::string body = "5\r\nhello\r\n00A;name=\"v\"\r\n0123456789\r\n0\r\nX: y\r\nZ: 1\r\n\r\n";

TEST(ChunkFraming, FollowsABodyHoweverItIsCut) {
    EXPECT_TRUE(follows(body));
    for (std::size_t at = 0; at <= body.size(); ++at) {
        ChunkFraming chunks;
        EXPECT_TRUE(chunks.follow(body.substr(0, at)) && chunks.follow(body.substr(at))) << at;
    }
    ChunkFraming chunks;
    for (const char c : body) EXPECT_TRUE(chunks.follow({&c, 1}));
    EXPECT_FALSE(chunks.follow("0")) << "after the end";
}

TEST(ChunkFraming, SizesThatTwoReadersCouldReadDifferentlyAreRefused) {
    for (const char* size : {"0x5", "+5", "-5", " 5", "5 ", "5\t", "5zz", "5,5", "", ";a", "g",
                             "\r", "5\n", "5\r\r", "5;a\n", "5;a\x01", "00000000000000005"})
        EXPECT_FALSE(follows(std::string(size) + "\r\nhello\r\n0\r\n\r\n")) << size;
    EXPECT_FALSE(follows(std::string("5\0", 2) + "\r\nhello\r\n0\r\n\r\n"));
    EXPECT_TRUE(follows("0000000000000005\r\nhello\r\n0\r\n\r\n"));
    EXPECT_TRUE(follows("ffffffffffffffff\r\nhello"));
}

TEST(ChunkFraming, DataEndsWhereItsSizeSays) {
    for (const char* wrong :
         {"5\r\nhell\r\n0\r\n\r\n", "5\r\nhello!\r\n0\r\n\r\n", "5\r\nhello0\r\n\r\n",
          "5\r\nhello\n0\r\n\r\n", "5\r\nhello\r0\r\n\r\n"})
        EXPECT_FALSE(follows(wrong)) << wrong;
}

TEST(ChunkFraming, ExtensionsAndTrailersAreTextAndHaveLimits) {
    const auto with_extension = [](std::size_t size) {
        return follows("1;" + std::string(size, 'a') + "\r\nx\r\n0\r\n\r\n");
    };
    EXPECT_TRUE(with_extension(256));
    EXPECT_FALSE(with_extension(257));
    const auto with_trailers = [](const std::string& trailers) {
        return follows("0\r\n" + trailers + "\r\n");
    };
    EXPECT_TRUE(with_trailers("A: " + std::string(8189, 'a') + "\r\n"));
    EXPECT_FALSE(with_trailers("A: " + std::string(8190, 'a') + "\r\n"));
    std::string many;
    for (int i = 0; i < 2000; ++i) many += "A: bcd\r\n";
    EXPECT_FALSE(with_trailers(many));
    for (const char* trailer :
         {" folded: 1\r\n", "\tfolded: 1\r\n", "A: b\n", "A: \x01\r\n", "A: b\rc"})
        EXPECT_FALSE(with_trailers(trailer)) << trailer;
}

}  // namespace
}  // namespace relit::server
