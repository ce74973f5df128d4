#include "server/http/multipart.h"

#include <gtest/gtest.h>

#include "server/error_codes.h"

namespace relit::server {
namespace {

constexpr const char* type = "multipart/form-data; boundary=xyz";

std::string code_of(const std::string& body, const std::string& content_type = type,
                    const Limits& limits = {.max_parts = 10}) {
    try {
        (void)parse_multipart(body, content_type, limits);
        return "accepted";
    } catch (const Error& error) {
        return std::string(error.code);
    }
}

const std::string body =
    "preamble\r\n--xyz\r\nContent-Disposition: form-data; name=\"scene\"\r\n\r\n{}\r\n"
    "--xyz\r\ncontent-disposition: form-data; filename=\"a;\\\"b.png\"; name=height\r\n"
    "Content-Type: image/png\r\n\r\n\x89PNG\r\n--xy\r\n\r\n"
    "--xyz\r\nContent-Disposition: form-data; name=\"empty\"\r\n\r\n\r\n--xyz--\r\nepilogue";

TEST(Multipart, PartsComeInOrderWithTheirBytesUnchanged) {
    const auto parts = parse_multipart(body, type, {.max_parts = 3});
    ASSERT_EQ(parts.size(), 3u);
    EXPECT_EQ(parts[0].name, "scene");
    EXPECT_EQ(parts[0].filename, "");
    EXPECT_EQ(parts[0].content, "{}");
    EXPECT_EQ(parts[1].name, "height");
    EXPECT_EQ(parts[1].filename, "a;\"b.png");
    EXPECT_EQ(parts[1].content_type, "image/png");
    EXPECT_EQ(parts[1].content, "\x89PNG\r\n--xy\r\n");
    EXPECT_EQ(parts[2].name, "empty");
    EXPECT_EQ(parts[2].content, "");
}

TEST(Multipart, BoundaryMayBeQuotedAndTheTypeInAnyCase) {
    EXPECT_TRUE(is_multipart("Multipart/Form-Data; boundary=a"));
    EXPECT_FALSE(is_multipart("multipart/mixed; boundary=a"));
    EXPECT_EQ(code_of(body, "multipart/form-data; charset=utf-8; boundary=\"xyz\""), "accepted");
}

TEST(Multipart, EveryTruncationIsRefused) {
    for (std::size_t size = 0; size < body.find("--\r\nepilogue"); ++size)
        EXPECT_EQ(code_of(body.substr(0, size)), "malformed-request") << size;
}

TEST(Multipart, BrokenFormsAreRefused) {
    EXPECT_EQ(code_of(body, "multipart/form-data"), "malformed-request");
    EXPECT_EQ(code_of(body, "multipart/form-data; boundary="), "malformed-request");
    EXPECT_EQ(code_of(body, "multipart/form-data; boundary=" + std::string(71, 'x')),
              "malformed-request");
    EXPECT_EQ(code_of(body, "multipart/form-data; boundary=other"), "malformed-request");
    EXPECT_EQ(code_of("--xyz\r\nContent-Disposition: form-data\r\n\r\na\r\n--xyz--"),
              "malformed-request");
    EXPECT_EQ(code_of("--xyz\r\nno colon\r\n\r\na\r\n--xyz--"), "malformed-request");
    EXPECT_EQ(code_of("--xyzz\r\n\r\n\r\n--xyz--"), "malformed-request");
    EXPECT_EQ(code_of("--xyz\r\nA: " + std::string(20'000, 'a') + "\r\n\r\na\r\n--xyz--"),
              "body-too-large");
    EXPECT_EQ(code_of("--xyz\r\nA: " + std::string(20'000, 'a') + "\r\n\r\na\r\n--xyz--", type,
                      {.max_part_head_bytes = 30'000}),
              "malformed-request")
        << "it has no name";
}

TEST(Multipart, MorePartsThanAllowedAreRefused) {
    EXPECT_EQ(code_of(body, type, {.max_parts = 2}), "body-too-large");
}

// A parser that looks for the boundary anew with every piece would take minutes here.
TEST(Multipart, LongBodyWithoutItsBoundaryIsRefusedInLinearTime) {
    EXPECT_EQ(code_of(std::string(64 << 20, '-')), "malformed-request");
}

}  // namespace
}  // namespace relit::server
