#include "server/http/head.h"

#include <gtest/gtest.h>

namespace relit::server {
namespace {

Head parse(const std::string& text) { return parse_head(text, Limits{}); }

std::string code_of(const std::string& text, const Limits& limits = {}) {
    try {
        (void)parse_head(text, limits);
        return "accepted";
    } catch (const Error& error) {
        return std::string(error.code);
    }
}

std::string get(const std::string& target) {
    return "GET " + target + " HTTP/1.1\r\nHost: a\r\n\r\n";
}
std::string post(const std::string& headers) {
    return "POST / HTTP/1.1\r\nHost: a\r\n" + headers + "\r\n";
}

TEST(Head, HoldsMethodPathQueryAndHeaders) {
    const Head head = parse(
        "POST /v1/r%C3%A9lief?light=1,2&name=a%20b+c&flag&light=3 HTTP/1.1\r\nHOST: example\r\n"
        "Content-Length: 12\r\nX-One:  1 \r\nx-one: 2\r\n\r\n");
    EXPECT_EQ(head.method, "POST");
    EXPECT_EQ(head.path, "/v1/r\xC3\xA9lief");
    EXPECT_EQ(head.query.count("light"), 2u);
    EXPECT_EQ(head.query.find("name")->second, "a b c");
    EXPECT_EQ(head.query.find("flag")->second, "");
    EXPECT_EQ(head.headers.find("host")->second, "example");
    EXPECT_EQ(head.headers.find("X-ONE")->second, "1, 2");
    EXPECT_EQ(head.content_length, 12u);
    EXPECT_TRUE(head.has_body());
}

TEST(Head, TargetMayBeAbsoluteOrTheAsteriskOfOptions) {
    EXPECT_EQ(parse(get("http://a:80/v1/version?x=1")).path, "/v1/version");
    EXPECT_EQ(parse(get("http://a")).path, "/");
    EXPECT_EQ(parse("OPTIONS * HTTP/1.1\r\nHost: a\r\n\r\n").path, "*");
    EXPECT_EQ(code_of(get("*")), "malformed-request");
    EXPECT_EQ(code_of("CONNECT a:80 HTTP/1.1\r\nHost: a\r\n\r\n"), "malformed-request");
}

TEST(Head, PathsThatTwoReadersCouldReadDifferentlyAreRefused) {
    for (const char* target : {"/a%00b", "/a%2fb", "/a%2Fb", "/a%5cb", "/%c0%af", "/%e0%80%af",
                               "/%ed%a0%80", "/%f4%90%80%80", "/%ff", "/a%", "/a%4", "/a%zz",
                               "/%0d%0aX:1", "/a#b", "a", "/?q=%ff", "/?q=%"})
        EXPECT_EQ(code_of(get(target)), "malformed-request") << target;
}

TEST(Head, RequestLinesOfAnotherShapeAreRefused) {
    for (const char* line : {"GET /", "GET  / HTTP/1.1", "GET / HTTP/1.1 ", " GET / HTTP/1.1",
                             "GET / FTP/1.1", "G(T / HTTP/1.1", "/ HTTP/1.1", ""})
        EXPECT_EQ(code_of(std::string(line) + "\r\nHost: a\r\n\r\n"), "malformed-request") << line;
    for (const char* version : {"HTTP/2.0", "HTTP/1.2", "HTTP/0.9"})
        EXPECT_EQ(code_of(std::string("GET / ") + version + "\r\nHost: a\r\n\r\n"),
                  "http-version-not-supported");
}

TEST(Head, HeaderLinesOfAnotherShapeAreRefused) {
    for (const char* line :
         {"NoColon", ": empty", "Sp ace: 1", "Space : 1", " folded", "\tfolded", "A\x80: 1"})
        EXPECT_EQ(code_of(post("Content-Length: 0\r\n" + std::string(line) + "\r\n")),
                  "malformed-request")
            << line;
    EXPECT_EQ(code_of("GET / HTTP/1.1\r\n\r\n"), "malformed-request") << "no Host";
    EXPECT_EQ(code_of("GET / HTTP/1.1\r\nHost: a\r\nHost: a\r\n\r\n"), "malformed-request")
        << "two Hosts";
    EXPECT_EQ(code_of("GET / HTTP/1.0\r\n\r\n"), "accepted") << "HTTP/1.0 needs no Host";
}

TEST(Head, FramingThatTwoReadersCouldReadDifferentlyIsRefused) {
    for (const char* headers :
         {"Content-Length: 1\r\nTransfer-Encoding: chunked\r\n",
          "Content-Length: 0\r\nTransfer-Encoding: chunked\r\n",
          "Content-Length: 1\r\nContent-Length: 1\r\n", "Content-Length: 1, 1\r\n",
          "Content-Length: +1\r\n", "Content-Length: -1\r\n", "Content-Length: 0x1\r\n",
          "Content-Length: 1a\r\n", "Content-Length: %31\r\n", "Content-Length: \r\n",
          "Content-Length: 99999999999999999999\r\n", "Transfer-Encoding: gzip, chunked\r\n",
          "Transfer-Encoding: chunked\r\nTransfer-Encoding: chunked\r\n",
          "Transfer-Encoding: identity\r\n", "Transfer-Encoding: xchunked\r\n",
          "Content-Length: 1\r\nExpect: 200-ok\r\n"})
        EXPECT_EQ(code_of(post(headers)), "malformed-request") << headers;
    EXPECT_EQ(code_of("POST / HTTP/1.0\r\nTransfer-Encoding: chunked\r\n\r\n"),
              "malformed-request");
    EXPECT_EQ(code_of(post("Content-Length: 1\r\nContent-Encoding: gzip\r\n")),
              "unsupported-media-type");
    for (const char* method : {"GET", "HEAD", "DELETE", "OPTIONS"})
        EXPECT_EQ(
            code_of(std::string(method) + " / HTTP/1.1\r\nHost: a\r\nContent-Length: 1\r\n\r\n"),
            "malformed-request")
            << method;
    EXPECT_EQ(code_of("GET / HTTP/1.1\r\nHost: a\r\nContent-Length: 0\r\n\r\n"), "accepted");
}

TEST(Head, ConnectionStaysOpenAsTheVersionAndTheHeaderSay) {
    const auto keeps = [](const std::string& version, const std::string& header) {
        return parse("GET / HTTP/" + version + "\r\nHost: a\r\n" + header + "\r\n").keep_alive;
    };
    EXPECT_TRUE(keeps("1.1", ""));
    EXPECT_FALSE(keeps("1.1", "Connection: Close\r\n"));
    EXPECT_FALSE(keeps("1.1", "Connection: upgrade, close\r\n"));
    EXPECT_FALSE(keeps("1.0", ""));
    EXPECT_TRUE(keeps("1.0", "Connection: keep-alive\r\n"));
}

TEST(Head, OverLongTargetsAndHeadersNameTheirLimits) {
    Limits limits;
    limits.max_uri_bytes = 100;
    limits.max_headers = 3;
    EXPECT_EQ(code_of(get("/" + std::string(99, 'a')), limits), "accepted");
    EXPECT_EQ(code_of(get("/" + std::string(100, 'a')), limits), "uri-too-long");
    EXPECT_EQ(code_of(post("A: 1\r\nB: 1\r\nC: 1\r\n"), limits), "headers-too-large");
    EXPECT_EQ(head_too_large("GET /" + std::string(200, 'a'), limits).code,
              error_code::uri_too_long);
    EXPECT_EQ(head_too_large("GET / HTTP/1.1\r\nA: " + std::string(200, 'a'), limits).code,
              error_code::headers_too_large);
}

// Byte by byte, as a slow client sends it, with the position of the last look passed on.
TEST(HeadEnd, IsFoundHoweverTheBytesArrive) {
    const std::string text = "GET / HTTP/1.1\r\nHost: a\r\n\r\n";
    std::size_t looked_at = 0;
    for (std::size_t size = 0; size < text.size(); ++size) {
        const auto end = find_head_end(std::string_view(text).substr(0, size), looked_at);
        EXPECT_EQ(end.state, HeadEnd::incomplete) << size;
        looked_at = size;
    }
    const auto end = find_head_end(text + "body", looked_at);
    EXPECT_EQ(end.state, HeadEnd::complete);
    EXPECT_EQ(end.size, text.size());
}

TEST(HeadEnd, BareLineFeedsAndControlCharactersAreMalformedAtOnce) {
    for (const std::string text : {"GET / HTTP/1.1\n", "GET / HTTP/1.1\r\nA: b\nC: d", "A\rB",
                                   "A\x01", "\x16\x03\x01\x02", "A: \x7f"})
        EXPECT_EQ(find_head_end(text).state, HeadEnd::malformed) << text;
    EXPECT_EQ(find_head_end(std::string("A\0B", 3)).state, HeadEnd::malformed);
}

// Whatever a head is cut down or changed to, it is parsed or refused with an Error, nothing else.
TEST(Head, EveryTruncationAndEveryChangedByteIsParsedOrRefused) {
    const std::string text = "POST /a%20b?c=d HTTP/1.1\r\nHost: a\r\nContent-Length: 3\r\n\r\n";
    for (std::size_t i = 0; i < text.size(); ++i)
        for (int byte = 0; byte < 256; ++byte) {
            std::string changed = text;
            changed[i] = char(byte);
            if (find_head_end(changed).state == HeadEnd::complete) (void)code_of(changed);
            if (byte == 0) (void)code_of(text.substr(0, i) + "\r\n\r\n");
        }
}

}  // namespace
}  // namespace relit::server
