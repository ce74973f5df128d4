#include "server/schema/base64.h"

#include <gtest/gtest.h>

namespace relit::test {
namespace {

using server::decode_base64;
using server::decode_base64url;

TEST(Base64, DecodesTheStandardsExamples) {  // RFC 4648, section 10
    EXPECT_EQ(decode_base64(""), "");
    EXPECT_EQ(decode_base64("Zg=="), "f");
    EXPECT_EQ(decode_base64("Zm8="), "fo");
    EXPECT_EQ(decode_base64("Zm9v"), "foo");
    EXPECT_EQ(decode_base64("Zm9vYmFy"), "foobar");
    EXPECT_EQ(decode_base64("+/8="), "\xfb\xff");
    EXPECT_EQ(decode_base64url("-_8"), "\xfb\xff");
    EXPECT_EQ(decode_base64url("-_8="), "\xfb\xff");
}

TEST(Base64, RefusesEverythingElse) {
    for (const char* wrong : {"Zg", "Zg=", "Z", "Zg===", "Zm9v=", "Zm 9", "Zh==", "Zm9=", "Zm9v\n",
                              "-_8=", "=", "====", "Z=g="})
        EXPECT_FALSE(decode_base64(wrong)) << wrong;
    for (const char* wrong : {"+/8", "Z", "Zh", "Zg=", "Zg==="})
        EXPECT_FALSE(decode_base64url(wrong)) << wrong;
}

}  // namespace
}  // namespace relit::test
