// Requests that are refused before a handler sees them, against the real program: what the client
// is told, that the connection ends, and above all that unread bytes are never taken for the next
// request.
#include <gtest/gtest.h>

#include "tests/support/http_client.h"
#include "tests/support/relit_process.h"
#include "tests/support/upload_images.h"

namespace relit::test {
namespace {

using namespace std::chrono_literals;

// A request that would be answered if it were read as one.
const std::string smuggled = "GET /v1/version HTTP/1.1\r\nHost: a\r\n\r\n";

class Refusals : public testing::Test {
protected:
    static void SetUpTestSuite() { relitd = std::make_unique<RelitProcess>(); }
    static void TearDownTestSuite() { relitd.reset(); }

    // The reply to `request`, after which nothing more may come, whatever followed.
    static HttpReply refusal(const std::string& request) {
        RawConnection connection(relitd->port());
        connection.send(request + smuggled + smuggled);
        HttpReply reply = connection.receive(request.starts_with("HEAD "));
        EXPECT_EQ(reply.header("connection"), "close") << request.substr(0, 80);
        EXPECT_FALSE(reply.header("x-request-id").empty());
        EXPECT_TRUE(connection.ends_within(500ms)) << request.substr(0, 80);
        return reply;
    }
    static std::string type_of(const HttpReply& reply) {
        const auto begin = reply.body.find("/problems/") + 10;
        return reply.body.substr(begin, reply.body.find('"', begin) - begin);
    }
    static inline std::unique_ptr<RelitProcess> relitd;
};

struct Row {
    int status;
    const char* code;
    std::string request;
};

TEST_F(Refusals, AreAnsweredByTheirProblemAndEndTheConnection) {
    const std::string upload = "POST /v1/images HTTP/1.1\r\nHost: a\r\n";
    const std::string get = "GET /healthz HTTP/1.1\r\nHost: a\r\n";
    const Row rows[] = {
        {413, "body-too-large", upload + "Content-Length: 268435457\r\n\r\n"},
        {404, "not-found", "POST /nothing HTTP/1.1\r\nHost: a\r\nContent-Length: 100000000\r\n\r\n"},
        {404, "not-found",
         "POST /nothing HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked\r\n\r\n"},
        {405, "method-not-allowed",
         "POST /healthz HTTP/1.1\r\nHost: a\r\nContent-Length: 10\r\n\r\n"},
        {405, "method-not-allowed",
         "PUT /v1/images HTTP/1.1\r\nHost: a\r\nContent-Length: 10\r\n\r\n"},
        {411, "length-required", upload + "\r\n"},
        {400, "malformed-request", get + "Content-Length: 5\r\n\r\n"},
        {400, "malformed-request", get + "Transfer-Encoding: chunked\r\n\r\n"},
        {400, "malformed-request",
         "DELETE /v1/images/x HTTP/1.1\r\nHost: a\r\nContent-Length: 5\r\n\r\n"},
        {400, "malformed-request",
         upload + "Content-Length: 5\r\nTransfer-Encoding: chunked\r\n\r\n"},
        {400, "malformed-request", upload + "Content-Length: 5\r\nContent-Length: 6\r\n\r\n"},
        {400, "malformed-request", upload + "Content-Length: five\r\n\r\n"},
        {400, "malformed-request", upload + "Transfer-Encoding: gzip, chunked\r\n\r\n"},
        {400, "malformed-request", upload + "Transfer-Encoding: chunked\r\n\r\nnonsense\r\n"},
        {415, "unsupported-media-type",
         upload + "Content-Encoding: gzip\r\nContent-Length: 5\r\n\r\n"},
        {400, "malformed-request", "GET /healthz\r\n\r\n"},
        {400, "malformed-request", "GET /healthz HTTP/1.1\nHost: a\n\n"},
        {400, "malformed-request", "\x16\x03\x01\x02"},
        {400, "malformed-request", "GET /healthz HTTP/1.1\r\n\r\n"},
        {400, "malformed-request", "GET /v1/images/%00 HTTP/1.1\r\nHost: a\r\n\r\n"},
        {400, "malformed-request", "GET /v1/images/..%2f..%2fetc HTTP/1.1\r\nHost: a\r\n\r\n"},
        {400, "malformed-request", "GET /v1/images/%c0%ae%c0%ae HTTP/1.1\r\nHost: a\r\n\r\n"},
        {505, "http-version-not-supported", "PRI * HTTP/2.0\r\nHost: a\r\n\r\n"},
        {414, "uri-too-long", "GET /" + std::string(20'000, 'a') + " HTTP/1.1\r\nHost: a\r\n\r\n"},
        {414, "uri-too-long", "GET /" + std::string(100'000, 'a')},
        {431, "headers-too-large", get + "A: " + std::string(40'000, 'a') + "\r\n\r\n"},
        {431, "headers-too-large", get + "A: " + std::string(100'000, 'a')},
    };
    for (const Row& row : rows) {
        const auto reply = refusal(row.request);
        EXPECT_EQ(reply.status, row.status) << row.request.substr(0, 120) << "\n" << reply.body;
        EXPECT_EQ(type_of(reply), row.code) << row.request.substr(0, 120);
        EXPECT_EQ(reply.header("content-type"), "application/problem+json");
    }
    std::string many = get;
    for (int i = 0; i < 200; ++i) many += "A" + std::to_string(i) + ": 1\r\n";
    EXPECT_EQ(refusal(many + "\r\n").status, 431);
    EXPECT_EQ(refusal("HEAD /healthz HTTP/1.1\r\n\r\n").status, 400);
    EXPECT_EQ(
        refusal("PUT /v1/images HTTP/1.1\r\nHost: a\r\nContent-Length: 1\r\n\r\n").header("allow"),
        "GET, HEAD, OPTIONS, POST");
}

// The client is still sending when the answer comes; it has to get it all the same.
TEST_F(Refusals, ReachClientsThatAreStillSending) {
    for (int i = 0; i < 20; ++i) {
        RawConnection connection(relitd->port());
        connection.send("POST /nothing HTTP/1.1\r\nHost: a\r\nContent-Length: 4000000\r\n\r\n");
        connection.send(std::string(4'000'000, 'x'));
        EXPECT_EQ(connection.receive().status, 404);
    }
}

TEST_F(Refusals, LongPathsAreOnlyNotFound) {
    for (const std::string piece : {"a", "/", "a/", "%61", "{id}/"}) {
        std::string path = "/";
        while (path.size() + piece.size() < 16'000) path += piece;
        EXPECT_EQ(http(relitd->port(), "GET", path).status, 404) << piece;
    }
}

TEST_F(Refusals, FloodsCostNoMemory) {
    for (const std::string begin :
         {"GET /", "GET / HTTP/1.1\r\nHost: a\r\nA: ",
          "POST /v1/images HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked\r\n\r\nfffffff;"}) {
        RawConnection connection(relitd->port());
        connection.send(begin);
        const std::string megabyte(1 << 20, 'a');
        int sent = 0;
        while (sent < 300 && connection.send(megabyte)) ++sent;
        EXPECT_LT(sent, 300) << "took all of it: " << begin.substr(0, 20);
    }
    EXPECT_LT(relitd->peak_memory_mib(), 400);
}

TEST_F(Refusals, ServerIsWellAfterAllOfThem) {
    EXPECT_EQ(http(relitd->port(), "GET", "/healthz").status, 200);
    EXPECT_EQ(http(relitd->port(), "POST", "/v1/images", small_png(77)).status, 201);
}

}  // namespace
}  // namespace relit::test
