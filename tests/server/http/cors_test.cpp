#include "server/http/cors.h"

#include <gtest/gtest.h>

#include <stdexcept>

namespace relit::server {
namespace {

Reply replied(const std::string& policy, const std::string& origin) {
    Request request;
    if (!origin.empty()) request.headers["Origin"] = origin;
    Reply reply;
    add_cors_headers(parse_cors_policy(policy), request, reply);
    return reply;
}

std::string allowed(const std::string& policy, const std::string& origin) {
    const Reply reply = replied(policy, origin);
    const auto header = reply.headers.find("Access-Control-Allow-Origin");
    return header == reply.headers.end() ? "" : header->second;
}

TEST(Cors, AllowsEveryOriginWithAStar) {
    for (const char* origin : {"https://a.org", "null", ""}) {
        EXPECT_EQ(allowed("*", origin), "*");
        const Reply reply = replied("*", origin);
        EXPECT_EQ(reply.headers.at("Vary"), "Origin");
        EXPECT_EQ(reply.headers.at("Timing-Allow-Origin"), "*");
        for (const char* name :
             {"ETag", "Location", "Server-Timing", "Retry-After", "Allow", "Relit-Accuracy",
              "Relit-Height-Range", "X-Request-Id", "traceresponse"})
            EXPECT_NE(reply.headers.at("Access-Control-Expose-Headers").find(name),
                      std::string::npos)
                << name;
    }
}

TEST(Cors, AllowsTheListedOriginsExactly) {
    const std::string list = "https://a.org, http://localhost:3000,http://[::1]:80";
    EXPECT_EQ(allowed(list, "https://a.org"), "https://a.org");
    EXPECT_EQ(allowed(list, "http://localhost:3000"), "http://localhost:3000");
    EXPECT_EQ(allowed(list, "http://[::1]"), "http://[::1]") << "as a browser writes it";
    EXPECT_EQ(replied(list, "https://a.org").headers.at("Timing-Allow-Origin"), "https://a.org");
    for (const char* other : {"https://a.org.evil.org", "http://a.org", "https://a.org:444",
                              "https://sub.a.org", "null", "", "*", "https://A.org"}) {
        EXPECT_EQ(allowed(list, other), "") << other;
        const Reply reply = replied(list, other);
        EXPECT_EQ(reply.headers.at("Vary"), "Origin") << "caches must not mix them up";
        EXPECT_EQ(reply.headers.size(), 1u);
    }
}

TEST(Cors, CanBeSwitchedOff) { EXPECT_TRUE(replied("none", "https://a.org").headers.empty()); }

TEST(Cors, OriginsAreTakenAsBrowsersWriteThem) {
    EXPECT_EQ(parse_cors_policy("HTTPS://Example.ORG:443").origins.front(), "https://example.org");
    EXPECT_EQ(parse_cors_policy("http://a:80").origins.front(), "http://a");
    EXPECT_EQ(parse_cors_policy("https://a:80").origins.front(), "https://a:80");
    EXPECT_EQ(parse_cors_policy("app+x://host").origins.front(), "app+x://host");
}

TEST(Cors, WhatIsNoOriginIsRefusedAndQuoted) {
    for (const char* text : {"",
                             ",",
                             "a.org",
                             "https://",
                             "https://a.org/",
                             "https://a.org/x",
                             "https://a.org,",
                             "https://a.org,*",
                             "none,https://a.org",
                             "null",
                             "https://*.a.org",
                             "https://u@a.org",
                             "https://a.org:0",
                             "https://a.org:99999",
                             "https://a.org:",
                             "https://a.org:8x",
                             "https://a b",
                             "https://a\r\nb",
                             "://a.org",
                             "1x://a",
                             "https://[::1",
                             "https://[]",
                             "https://a?b",
                             "https://\xc3\xa9.org"}) {
        try {
            (void)parse_cors_policy(text);
            ADD_FAILURE() << "accepted: " << text;
        } catch (const std::invalid_argument& error) {
            EXPECT_NE(std::string(error.what()).find("is no origin"), std::string::npos);
        }
    }
}

TEST(Cors, PreflightsSayMethodsHeadersAndForHowLong) {
    Request request;
    request.method = "OPTIONS";
    request.headers["Origin"] = "https://a.org";
    Reply plain;
    add_preflight_headers({}, request, "GET, HEAD", plain);
    EXPECT_TRUE(plain.headers.empty()) << "not a preflight";
    request.headers["Access-Control-Request-Method"] = "POST";
    Reply reply;
    add_preflight_headers({}, request, "GET, HEAD", reply);
    EXPECT_EQ(reply.headers.at("Access-Control-Allow-Methods"), "GET, HEAD");
    EXPECT_EQ(reply.headers.at("Access-Control-Max-Age"), "7200");
    for (const char* name :
         {"Content-Type", "If-None-Match", "Relit-Session", "Idempotency-Key", "Last-Event-ID"})
        EXPECT_NE(reply.headers.at("Access-Control-Allow-Headers").find(name), std::string::npos);
    Reply other;
    add_preflight_headers(parse_cors_policy("https://b.org"), request, "GET", other);
    EXPECT_TRUE(other.headers.empty()) << "not an origin of the list";
}

}  // namespace
}  // namespace relit::server
