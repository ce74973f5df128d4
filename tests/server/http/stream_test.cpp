// Replies that are made while they are sent, over real sockets.
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "tests/support/http_client.h"
#include "tests/support/test_server.h"

namespace relit::test {
namespace {

using namespace std::chrono_literals;
using server::Reply;
using server::Request;

std::atomic<int> sent{0};
std::atomic<bool> gone{false};

Reply stream_of(std::function<bool(const server::BodyStream::Write&)> send,
                std::optional<std::uint64_t> size = {}) {
    Reply reply{.content_type = "text/plain"};
    reply.stream = {.size_bytes = size, .send = std::move(send)};
    return reply;
}

Reply three_pieces(const Request&, server::Services&) {
    return stream_of([](const auto& write) {
        ++sent;
        return write("one ") && write("") && write("two ") && write("three");
    });
}

Reply known_size(const Request&, server::Services&) {
    return stream_of(
        [](const auto& write) {
            ++sent;
            return write(std::string(100'000, 'a')) && write(std::string(100'000, 'b'));
        },
        200'000);
}

Reply broken(const Request&, server::Services&) {
    return stream_of([](const auto& write) {
        (void)write("begun");
        return false;
    });
}

Reply throwing(const Request&, server::Services&) {
    return stream_of([](const auto& write) -> bool {
        (void)write("begun");
        throw std::runtime_error("no more");
    });
}

Reply endless(const Request& request, server::Services&) {
    return stream_of([stop = request.client_gone](const auto& write) {
        while (!stop.stop_requested() && write("x")) std::this_thread::sleep_for(5ms);
        gone = true;
        return false;
    });
}

std::vector<server::Route> stream_routes() {
    return {{"GET", "/three", three_pieces},
            {"GET", "/known", known_size},
            {"GET", "/broken", broken},
            {"GET", "/throwing", throwing},
            {"GET", "/endless", endless}};
}

TEST(Streams, AreSentInChunksAndTheConnectionGoesOn) {
    TestServer server(stream_routes());
    RawConnection connection(server.port());
    for (int i = 0; i < 2; ++i) {
        connection.send(http_request("GET", "/three"));
        const HttpReply reply = connection.receive();
        EXPECT_EQ(reply.status, 200);
        EXPECT_EQ(reply.header("transfer-encoding"), "chunked");
        EXPECT_EQ(reply.header("content-length"), "");
        EXPECT_EQ(reply.body, "one two three");
        EXPECT_NE(reply.header("x-request-id"), "");
    }
}

TEST(Streams, OfAKnownSizeSayIt) {
    TestServer server(stream_routes());
    RawConnection connection(server.port());
    for (int i = 0; i < 2; ++i) {
        connection.send(http_request("GET", "/known"));
        const HttpReply reply = connection.receive();
        EXPECT_EQ(reply.header("content-length"), "200000");
        EXPECT_EQ(reply.body, std::string(100'000, 'a') + std::string(100'000, 'b'));
    }
}

TEST(Streams, AreNotMadeForHead) {
    TestServer server(stream_routes());
    sent = 0;
    for (const char* path : {"/three", "/known"}) {
        const HttpReply reply = http(server.port(), "HEAD", path);
        EXPECT_EQ(reply.status, 200);
        EXPECT_EQ(reply.body, "");
    }
    EXPECT_EQ(http(server.port(), "HEAD", "/known").header("content-length"), "200000");
    EXPECT_EQ(sent, 0);
}

TEST(Streams, GoToClientsWithoutChunksUntilTheConnectionEnds) {
    TestServer server(stream_routes());
    RawConnection connection(server.port());
    connection.send("GET /three HTTP/1.0\r\nHost: a\r\nConnection: keep-alive\r\n\r\n");
    const HttpReply head = connection.receive_head();
    EXPECT_EQ(head.header("transfer-encoding"), "");
    EXPECT_EQ(head.header("connection"), "close");
    EXPECT_EQ(connection.rest(), "one two three");
}

// Who gets half of a body has to see that it is half.
TEST(Streams, ThatFailAreBrokenOff) {
    TestServer server(stream_routes());
    for (const char* path : {"/broken", "/throwing"}) {
        RawConnection connection(server.port());
        connection.send(http_request("GET", path));
        EXPECT_EQ(connection.receive_head().status, 200);
        EXPECT_EQ(connection.next_chunk(), "begun");
        EXPECT_THROW((void)connection.next_chunk(), std::runtime_error);
    }
}

TEST(Streams, EndSoonAfterTheirClientHasLeft) {
    TestServer server(stream_routes());
    gone = false;
    RawConnection connection(server.port());
    connection.send(http_request("GET", "/endless"));
    (void)connection.receive_head();
    EXPECT_EQ(connection.next_chunk(), "x");
    connection.close();
    for (int i = 0; i < 200 && !gone; ++i) std::this_thread::sleep_for(5ms);
    EXPECT_TRUE(gone);
}

}  // namespace
}  // namespace relit::test
