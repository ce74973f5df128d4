#include "server/http/server.h"

#include <gtest/gtest.h>

#include <thread>

#include "server/error_codes.h"
#include "server/routes/meta.h"
#include "tests/server/http/long_work.h"

namespace relit::server {
namespace {

Reply echo(const Request& request, Services&) {
    std::string body = request.body;
    for (const Part& part : request.parts) body += part.name + ":" + part.content + ";";
    return {.content_type = "text/plain", .body = body};
}

Reply large(const Request&, Services&) {
    return {.content_type = "text/plain", .body = std::string(8 << 20, 'x')};
}

Reply render_with_slot(const Request& request, Services& services) {
    const auto slot = services.renders.wait_for_slot(request.deadline, request.client_gone);
    return work_long(request, services);
}

std::vector<Route> test_routes() {
    return {{"POST", "/echo", echo, Scope::render, 1000, "max-echo"},
            {"POST", "/echo-large", echo, Scope::render, 64 << 20, "max-echo"},
            {"GET", "/large", large},
            {"GET", "/work", work_long},
            {"POST", "/work", work_long, Scope::render, 1000, "max-work"},
            {"GET", "/render", render_with_slot},
            {"GET", "/healthz", get_health}};
}

using Transport = LongWork;

TEST_F(Transport, RequestsOfOneConnectionAreAnsweredInTurnAlsoWhenSentAtOnce) {
    TestServer server(test_routes());
    RawConnection connection(server.port());
    connection.send(http_request("POST", "/echo", "first") + http_request("GET", "/healthz") +
                    "\r\n" + http_request("POST", "/echo", "third") +
                    http_request("HEAD", "/healthz") + http_request("POST", "/echo", "last"));
    EXPECT_EQ(connection.receive().body, "first");
    EXPECT_EQ(connection.receive().body, R"({"status":"ok"})");
    EXPECT_EQ(connection.receive().body, "third");
    EXPECT_EQ(connection.receive(/*to_head=*/true).header("content-length"), "15");
    EXPECT_EQ(connection.receive().body, "last");
}

TEST_F(Transport, BodiesMayBeChunkedAndAreCounted) {
    TestServer server(test_routes());
    RawConnection connection(server.port());
    const std::string head = "POST /echo HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked\r\n\r\n";
    connection.send(head + "3\r\nabc\r\n0a;x=y\r\n0123456789\r\n0\r\n\r\n" +
                    http_request("POST", "/echo", "next"));
    EXPECT_EQ(connection.receive().body, "abc0123456789");
    EXPECT_EQ(connection.receive().body, "next");
    const std::string piece(500, 'x');
    connection.send(head + "1f4\r\n" + piece + "\r\n1f4\r\n" + piece + "\r\n1\r\nx\r\n");
    const auto refused = connection.receive();
    EXPECT_EQ(refused.status, 413);
    EXPECT_NE(refused.body.find("max-echo, 1000 bytes"), std::string::npos) << refused.body;
    EXPECT_TRUE(connection.ends_within(500ms));
}

TEST_F(Transport, BrokenChunksAreRefused) {
    TestServer server(test_routes());
    for (const char* chunks :
         {"xyz\r\n", "3\r\nabcd\r\n0\r\n\r\n", "ffffffffffffffff\r\nabc\r\n", "-5\r\nabc"}) {
        RawConnection connection(server.port());
        connection.send(
            std::string("POST /echo HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked\r\n\r\n") +
            chunks);
        if (std::string_view(chunks).starts_with("-5")) connection.send(std::string(5000, 'x'));
        const auto status = connection.receive().status;
        EXPECT_TRUE(status == 400 || status == 413) << chunks << " " << status;
        EXPECT_TRUE(connection.ends_within(500ms));
    }
}

TEST_F(Transport, FormsArriveAsParts) {
    TestServer server(test_routes());
    const auto [body, type] = test::form_of({{"scene", "", "{}"}, {"height", "h.png", "PNG\r\n"}});
    EXPECT_EQ(http(server.port(), "POST", "/echo", body, {{"Content-Type", type}}).body,
              "scene:{};height:PNG\r\n;");
    RawConnection connection(server.port());
    connection.send(http_request("POST", "/echo", "no boundary in here", {{"Content-Type", type}}));
    EXPECT_EQ(connection.receive().status, 400);
}

TEST_F(Transport, RefusalsBeforeTheBodyAndEmptyRepliesMayBeReadByOtherOrigins) {
    TestServer server(test_routes());
    const std::string origin = "Host: a\r\nOrigin: https://a.org\r\n";
    const std::pair<int, std::string> requests[] = {
        {413, "POST /echo HTTP/1.1\r\n" + origin + "Content-Length: 5000\r\n\r\n"},
        {411, "POST /echo HTTP/1.1\r\n" + origin + "\r\n"},
        {400, "nonsense\r\n\r\n"},
        {204, "OPTIONS /echo HTTP/1.1\r\n" + origin + "\r\n"},
    };
    for (const auto& [status, request] : requests) {
        RawConnection connection(server.port());
        connection.send(request);
        const auto reply = connection.receive();
        EXPECT_EQ(reply.status, status);
        EXPECT_EQ(reply.header("access-control-allow-origin"), "*") << status;
        EXPECT_EQ(reply.header("vary"), "Origin") << status;
    }
}

TEST_F(Transport, CountsConnectionsAndBytes) {
    TestServer server(test_routes());
    const auto& metrics = server.services().metrics;
    const std::string request = http_request("GET", "/large");
    {
        RawConnection connection(server.port());
        connection.send(request);
        EXPECT_EQ(connection.receive().body.size(), 8u << 20);
        EXPECT_EQ(metrics.connections, 1);
    }
    const auto closed = Clock::now();
    while (metrics.connections > 0 && Clock::now() - closed < 5s) std::this_thread::sleep_for(1ms);
    EXPECT_EQ(metrics.connections, 0);
    EXPECT_EQ(metrics.traffic.received, request.size());
    EXPECT_GT(metrics.traffic.sent, 8u << 20);
    EXPECT_LT(metrics.traffic.sent, (8u << 20) + 2000) << "the body and a head";
}

TEST_F(Transport, ExpectingClientsAreToldToGoOnOrWhyNot) {
    TestServer server(test_routes());
    RawConnection connection(server.port());
    const std::string head =
        "POST /echo HTTP/1.1\r\nHost: a\r\nExpect: 100-continue\r\nContent-Length: ";
    connection.send(head + "5\r\n\r\n");
    EXPECT_EQ(connection.receive().status, 100);
    connection.send("hello");
    EXPECT_EQ(connection.receive().body, "hello");
    connection.send(head + "5000\r\n\r\n");
    EXPECT_EQ(connection.receive().status, 413);
    EXPECT_TRUE(connection.ends_within(500ms));
}

TEST_F(Transport, HeadAndEmptyRepliesHaveTheRightLength) {
    TestServer server(test_routes());
    RawConnection connection(server.port());
    connection.send(http_request("HEAD", "/large"));
    EXPECT_EQ(connection.receive(/*to_head=*/true).header("content-length"),
              std::to_string(8 << 20));
    connection.send(http_request("OPTIONS", "/large"));
    const auto options = connection.receive();
    EXPECT_EQ(options.status, 204);
    EXPECT_EQ(options.headers.count("content-length"), 0u);
    EXPECT_EQ(options.header("allow"), "GET, HEAD, OPTIONS");
    connection.send(http_request("GET", "/large", "", {{"Range", "bytes=0-,0-,0-"}}));
    const auto whole = connection.receive();
    EXPECT_EQ(whole.status, 200) << "ranges are ignored";
    EXPECT_EQ(whole.body.size(), 8u << 20);
    EXPECT_EQ(whole.headers.count("accept-ranges"), 0u);
}

TEST_F(Transport, ErrorsAfterAWholeBodyKeepTheConnection) {
    TestServer server(test_routes());
    RawConnection connection(server.port());
    connection.send(http_request("GET", "/nothing"));
    EXPECT_EQ(connection.receive().status, 404);
    connection.send(http_request("DELETE", "/healthz"));
    EXPECT_EQ(connection.receive().status, 405);
    connection.send(http_request("GET", "/healthz", "", {{"Connection", "close"}}));
    const auto last = connection.receive();
    EXPECT_EQ(last.status, 200);
    EXPECT_EQ(last.header("connection"), "close");
    EXPECT_TRUE(connection.ends_within(500ms));
}

TEST_F(Transport, OldClientsKeepTheirConnectionWhereTheyAskForIt) {
    TestServer server(test_routes());
    RawConnection connection(server.port());
    connection.send("GET /healthz HTTP/1.0\r\nConnection: keep-alive\r\n\r\n");
    EXPECT_EQ(connection.receive().header("connection"), "keep-alive");
    connection.send("GET /healthz HTTP/1.0\r\n\r\n");
    EXPECT_EQ(connection.receive().header("connection"), "close");
    EXPECT_TRUE(connection.ends_within(500ms));
}

TEST_F(Transport, ClosedConnectionStopsItsHandlerWithin50Ms) {
    TestServer server(test_routes());
    for (const std::string& request :
         {http_request("GET", "/work"), http_request("POST", "/work", "body")}) {
        RawConnection connection(server.port());
        connection.send(request);
        work_.wait_until_begun(work_.abandoned + 1);
        std::this_thread::sleep_for(20ms);
        EXPECT_EQ(work_.abandoned, work_.begun - 1);
        const auto closed = Clock::now();
        const int before = work_.abandoned;
        connection.close();
        while (work_.abandoned == before && Clock::now() - closed < 5s)
            std::this_thread::sleep_for(1ms);
        EXPECT_LT(work_.abandoned_at.load() - closed, 50ms);
    }
}

TEST_F(Transport, HealthAnswersWhileSlotsAndQueueAreFull) {
    Limits limits;
    limits.max_queue = 3;
    TestServer server(test_routes(), limits);
    std::vector<std::unique_ptr<RawConnection>> waiting;
    for (int i = 0; i < 4; ++i) {
        waiting.push_back(std::make_unique<RawConnection>(server.port()));
        waiting.back()->send(http_request("GET", "/render"));
    }
    auto& renders = server.services().renders;
    while (renders.running() + renders.waiting() < 4) std::this_thread::sleep_for(1ms);
    const auto refused = http(server.port(), "GET", "/render");
    EXPECT_EQ(refused.status, 503);
    EXPECT_NE(refused.body.find("max-queue"), std::string::npos);
    EXPECT_EQ(refused.header("retry-after"), "1");
    const auto start = Clock::now();
    EXPECT_EQ(http(server.port(), "GET", "/healthz").status, 200);
    EXPECT_LT(Clock::now() - start, 200ms);
    work_.let_finish();
    for (auto& connection : waiting) EXPECT_EQ(connection->receive().body, "done");
}

TEST_F(Transport, IdleConnectionsGiveWayWhenAllAreTaken) {
    Limits limits;
    limits.max_connections = 4;
    TestServer server(test_routes(), limits);
    std::vector<std::unique_ptr<RawConnection>> idle;
    for (int i = 0; i < 4; ++i) {
        idle.push_back(std::make_unique<RawConnection>(server.port()));
        idle.back()->send(http_request("GET", "/healthz"));
        EXPECT_EQ(idle.back()->receive().status, 200);
    }
    for (auto& connection : idle)
        EXPECT_FALSE(connection->hears_within(50ms)) << "nobody else is there yet";
    const auto start = Clock::now();
    EXPECT_EQ(http(server.port(), "POST", "/echo", "a").status, 200);
    EXPECT_LT(Clock::now() - start, 1s);
}

TEST_F(Transport, SilentAndDrippingClientsAreGivenUp) {
    Limits limits;
    limits.idle_timeout = limits.head_timeout = limits.read_timeout = limits.write_timeout = 1s;
    TestServer server(test_routes(), limits);
    RawConnection silent(server.port());
    EXPECT_TRUE(silent.ends_within(2s)) << "nothing sent: closed without a word";

    RawConnection half(server.port());
    half.send("GET / HTTP/1.1\r\nHost:");
    EXPECT_EQ(half.receive().status, 408) << "half a head";

    RawConnection dripping_head(server.port());
    const auto start = Clock::now();
    for (const char c : std::string("GET /healthz HTTP/1.1\r\nHost: "))
        if (!dripping_head.hears_within(100ms)) dripping_head.send(std::string(1, c));
    EXPECT_EQ(dripping_head.receive().status, 408) << "a head in drops";
    EXPECT_LT(Clock::now() - start, 4s);

    RawConnection dripping_body(server.port());
    dripping_body.send("POST /echo HTTP/1.1\r\nHost: a\r\nContent-Length: 1000\r\n\r\n");
    for (int i = 0; i < 30 && !dripping_body.hears_within(100ms); ++i) dripping_body.send("x");
    EXPECT_EQ(dripping_body.receive().status, 408) << "a body in drops";
    EXPECT_TRUE(dripping_body.ends_within(500ms));
}

TEST_F(Transport, SteadyBodiesAndRepliesEndWithTheirTimeToo) {
    Limits limits;
    limits.min_bytes_per_second = 1;
    limits.transfer_timeout = 1s;
    TestServer server(test_routes(), limits);
    RawConnection steady(server.port());
    steady.send("POST /echo-large HTTP/1.1\r\nHost: a\r\nContent-Length: 8000000\r\n\r\n");
    const auto start = Clock::now();
    for (int i = 0; i < 100 && !steady.hears_within(20ms); ++i) steady.send(std::string(1000, 'x'));
    EXPECT_EQ(steady.receive().status, 408);
    EXPECT_LT(Clock::now() - start, 2s);
}

TEST_F(Transport, ClientThatReadsNothingIsGivenUp) {
    Limits limits;
    limits.write_timeout = 1s;
    TestServer server(test_routes(), limits);
    RawConnection connection(server.port());
    connection.send(http_request("GET", "/large") + http_request("GET", "/large"));
    std::this_thread::sleep_for(2500ms);
    const auto receive_both = [&] {
        (void)connection.receive();
        (void)connection.receive();
    };
    EXPECT_THROW(receive_both(), std::runtime_error);
}

TEST_F(Transport, BodiesUnderWayShareTheirMemory) {
    Limits limits;
    limits.max_body_memory_bytes = 10 << 20;
    TestServer server(test_routes(), limits);
    const std::string head =
        "POST /echo-large HTTP/1.1\r\nHost: a\r\nContent-Length: 8388608\r\n\r\n";
    RawConnection first(server.port());
    first.send(head + std::string(8 << 20, 'x').substr(1));
    std::this_thread::sleep_for(200ms);
    const auto refused = http(server.port(), "POST", "/echo-large", std::string(4 << 20, 'x'));
    EXPECT_EQ(refused.status, 503);
    EXPECT_EQ(refused.header("retry-after"), "2");
    first.send("x");
    EXPECT_EQ(first.receive().body.size(), 8u << 20);
    EXPECT_EQ(http(server.port(), "POST", "/echo-large", std::string(4 << 20, 'x')).status, 200);
}

TEST_F(Transport, StopFinishesTheRequestsUnderWay) {
    TestServer server(test_routes());
    RawConnection busy(server.port()), idle(server.port());
    idle.send(http_request("GET", "/healthz"));
    EXPECT_EQ(idle.receive().status, 200);
    busy.send(http_request("GET", "/work"));
    work_.wait_until_begun(1);
    server.server().stop();
    EXPECT_TRUE(idle.ends_within(500ms));
    std::this_thread::sleep_for(50ms);
    EXPECT_THROW(RawConnection{server.port()}, std::runtime_error) << "no longer listening";
    work_.let_finish();
    const auto reply = busy.receive();
    EXPECT_EQ(reply.body, "done");
    EXPECT_EQ(reply.header("connection"), "close");
    server.join();
}

TEST_F(Transport, LargeRepliesAreFinishedAfterStop) {
    TestServer server(test_routes());
    RawConnection connection(server.port());
    connection.send(http_request("GET", "/large"));
    EXPECT_TRUE(connection.hears_within(5s));
    server.server().stop();
    EXPECT_EQ(connection.receive().body.size(), 8u << 20);
}

TEST_F(Transport, CancelStopsHandlersAndAnswers503) {
    TestServer server(test_routes());
    RawConnection busy(server.port());
    busy.send(http_request("GET", "/work"));
    work_.wait_until_begun(1);
    server.server().stop();
    server.server().cancel();
    EXPECT_EQ(busy.receive().status, 503);
    server.join();
}

TEST_F(Transport, PortInUseIsRefusedWithAReason) {
    TestServer server(test_routes());
    test::TestServices services;
    const Router router(test_routes());
    Server second(router, services.services, services.limits);
    try {
        second.bind("127.0.0.1", server.port());
        FAIL() << "two servers on one port";
    } catch (const std::runtime_error& error) {
        EXPECT_NE(std::string(error.what()).find("in use"), std::string::npos) << error.what();
    }
    Server third(router, services.services, services.limits);
    EXPECT_THROW(third.bind("no.such.host.invalid", 0), std::runtime_error);
}

}  // namespace
}  // namespace relit::server
