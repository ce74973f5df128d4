#include "server/http/problem.h"

#include <gtest/gtest.h>

#include <set>

namespace relit::server {
namespace {

TEST(Problem, SaysCodeStatusDetailAndPointer) {
    const Reply reply =
        problem_reply({error_code::invalid_value, "relief is 11, at most 10", "/relief"});
    EXPECT_EQ(reply.status, 422);
    EXPECT_EQ(reply.content_type, "application/problem+json");
    EXPECT_EQ(reply.error_code, error_code::invalid_value);
    EXPECT_EQ(reply.body,
              R"({"type":"/problems/invalid-value","title":"A value is refused","status":422,)"
              R"("detail":"Relief is 11, at most 10.","pointer":"/relief"})");
    EXPECT_EQ(reply.headers.find("Cache-Control")->second, "no-store");
}

TEST(Problem, OfAFullQueueSaysWhenToComeBack) {
    const Reply reply = problem_reply({error_code::queue_full, "max-queue"});
    EXPECT_EQ(reply.status, 503);
    EXPECT_TRUE(reply.headers.contains("Retry-After"));
    EXPECT_EQ(reply.body.find("pointer"), std::string::npos);
}

TEST(Problem, OfAnUnknownCodeIsInternal) {
    EXPECT_EQ(problem_reply({"never-heard-of", "x"}).status, 500);
}

TEST(Problem, IsWrittenWhateverBytesTheDetailHas) {
    EXPECT_NE(problem_reply({error_code::invalid_value, "a\xff\x01\"b"}).body.find("\\u0001\\\"b"),
              std::string::npos);
}

TEST(ProblemKinds, AreDistinctSortedAndInKebabCase) {
    std::set<std::string_view> codes;
    int status = 400;
    for (const ProblemKind& kind : problem_kinds()) {
        EXPECT_TRUE(codes.insert(kind.code).second) << kind.code;
        EXPECT_EQ(kind.code.find_first_not_of("abcdefghijklmnopqrstuvwxyz-"),
                  std::string_view::npos);
        EXPECT_GE(kind.status, status) << kind.code;
        EXPECT_FALSE(kind.title.empty());
        status = kind.status;
    }
}

}  // namespace
}  // namespace relit::server
