#include "server/http/message.h"

#include <gtest/gtest.h>

namespace relit::server {
namespace {

TEST(Request, HeadersAreFoundInAnyCase) {
    Request request;
    request.headers = {{"Content-Type", "image/png"}};
    EXPECT_EQ(request.header("CONTENT-type"), "image/png");
    EXPECT_EQ(request.header("Content-Typ"), std::nullopt);
}

TEST(HasEtag, ComparesWeaklyWithEveryTagOfTheList) {
    const auto has = [](const std::string& header) {
        Request request;
        request.headers = {{"If-None-Match", header}};
        return has_etag(request, "\"abc\"");
    };
    EXPECT_TRUE(has("\"abc\""));
    EXPECT_TRUE(has("W/\"abc\""));
    EXPECT_TRUE(has("\"x\", W/\"y\" ,\"abc\""));
    EXPECT_TRUE(has(" * "));
    EXPECT_FALSE(has("abc"));
    EXPECT_FALSE(has("\"abcd\", \"ab\""));
    EXPECT_FALSE(has(""));
    EXPECT_FALSE(has_etag(Request{}, "\"abc\""));
}

}  // namespace
}  // namespace relit::server
