#include "server/schema/log_json.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

namespace relit::server {
namespace {

using nlohmann::json;
constexpr std::chrono::system_clock::time_point moment{std::chrono::milliseconds(1795357319042)};

TEST(LogJson, ALineHasItsFieldsInTheirOrder) {
    const LogField fields[] = {{"path", "/v1/render"},
                               {"status", std::int64_t(200)},
                               {"queue", 1.23456, "spans_ms"},
                               {"render", 20.0, "spans_ms"},
                               {"disconnected", true}};
    EXPECT_EQ(log_line_json(moment, "info", "request", fields),
              R"({"time":"2026-11-22T14:21:59.042Z","level":"info","message":"request",)"
              R"("path":"/v1/render","status":200,"spans_ms":{"queue":1.23,"render":20.0},)"
              R"("disconnected":true})");
}

// Bytes that end lines, quotes or strings, are not UTF-8, or are orders for a terminal.
TEST(LogJson, WhateverBytesAreInItALineIsOneObjectInPrintableAscii) {
    std::vector<std::string> hostile = {"\"}\n{\"level\":\"error",
                                        "\x1b[2J\x9b"
                                        "1m",
                                        "\xff\xfe",
                                        "\xc2\x9b",
                                        "\xe2\x80\xa8",
                                        "\\",
                                        std::string("\0x", 2),
                                        "\xed\xa0\x80",
                                        "\xf4\x90\x80\x80",
                                        "\xc3",
                                        std::string(100'000, '"')};
    std::string all;
    for (int byte = 0; byte < 256; ++byte) all += char(byte);
    hostile.push_back(all);
    for (const std::string& text : hostile) {
        const LogField fields[] = {{"path", text}, {"key", text, "group"}};
        const std::string line = log_line_json(moment, "info", text, fields);
        EXPECT_TRUE(
            std::all_of(line.begin(), line.end(), [](char c) { return c >= ' ' && c < 0x7f; }));
        const json parsed = json::parse(line);
        EXPECT_EQ(parsed.size(), 5u) << "nothing was added";
        EXPECT_EQ(parsed["level"], "info");
        EXPECT_EQ(parsed["path"], parsed["group"]["key"]);
    }
}

TEST(LogJson, NumbersThatJsonDoesNotHaveAreNull) {
    const LogField field{"ms", std::numeric_limits<double>::quiet_NaN()};
    EXPECT_TRUE(json::parse(log_line_json(moment, "info", "m", {&field, 1}))["ms"].is_null());
}

TEST(LogText, ValuesAreAWordOrAString) {
    EXPECT_EQ(log_value_text(std::string_view("/v1/images/ab.png")), "/v1/images/ab.png");
    EXPECT_EQ(log_value_text(std::string_view("a b=c\n")), R"("a b=c\n")");
    EXPECT_EQ(log_value_text(std::string_view("\xc2\x9b\xff\"")), R"("\u009b\ufffd\"")");
    EXPECT_EQ(log_value_text(std::string_view("")), R"("")");
    EXPECT_EQ(log_value_text(1.0), "1.00");
    EXPECT_EQ(log_value_text(std::int64_t(-7)), "-7");
    EXPECT_EQ(log_value_text(true), "true");
}

}  // namespace
}  // namespace relit::server
