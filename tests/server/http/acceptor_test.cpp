// More connections than there are threads: who waits, who gives way, who is refused.
#include "server/http/acceptor.h"

#include <gtest/gtest.h>

#include <thread>

#include "server/routes/meta.h"
#include "tests/server/http/long_work.h"

namespace relit::server {
namespace {

Reply echo(const Request& request, Services&) { return {.body = request.body}; }

std::vector<Route> test_routes() {
    return {{"POST", "/echo", echo, Scope::render, 1000, "max-echo"},
            {"GET", "/work", work_long, Scope::render},
            {"GET", "/healthz", get_health, Scope::open, 0, {}, /*while_stopping=*/true}};
}

using Connections = LongWork;

TEST_F(Connections, HealthAnswersWhileAllConnectionsAreBusyAndOthersWaitTheirTurn) {
    Limits limits;
    limits.max_connections = 2;
    TestServer server(test_routes(), limits);
    std::vector<std::unique_ptr<RawConnection>> busy;
    for (int i = 0; i < 4; ++i) {
        busy.push_back(std::make_unique<RawConnection>(server.port()));
        busy.back()->send(http_request("GET", "/work"));
    }
    work_.wait_until_begun(2);
    for (int i = 0; i < 20; ++i) {
        const auto start = Clock::now();
        const auto reply = http(server.port(), "GET", "/healthz");
        EXPECT_LT(Clock::now() - start, 200ms);
        EXPECT_EQ(reply.status, 200);
        EXPECT_EQ(reply.header("connection"), "close");
    }
    RawConnection in_pieces(server.port());
    in_pieces.send("GET /healthz HT");
    std::this_thread::sleep_for(20ms);
    in_pieces.send("TP/1.1\r\nHost: a\r\n\r\n");
    EXPECT_EQ(in_pieces.receive().status, 200);
    RawConnection leaves(server.port());
    leaves.send(http_request("GET", "/work"));
    leaves.close();
    EXPECT_EQ(work_.begun, 2) << "two threads";
    work_.let_finish();
    for (auto& connection : busy) EXPECT_EQ(connection->receive().body, "done");
}

TEST_F(Connections, TheLineForConnectionsHasAnEndThatSaysSo) {
    Limits limits;
    limits.max_connections = 1;
    limits.max_waiting_connections = 2;
    TestServer server(test_routes(), limits);
    std::vector<std::unique_ptr<RawConnection>> waiting;
    for (int i = 0; i < 3; ++i) {
        waiting.push_back(std::make_unique<RawConnection>(server.port()));
        waiting.back()->send(http_request("GET", "/work"));
    }
    while (server.services().metrics.waiting_connections < 2) std::this_thread::sleep_for(1ms);
    RawConnection refused(server.port());
    refused.send(http_request("POST", "/echo", std::string(1000, 'x')));
    const auto reply = refused.receive();
    EXPECT_EQ(reply.status, 503);
    EXPECT_EQ(reply.header("retry-after"), "1");
    EXPECT_NE(reply.body.find("max-waiting-connections"), std::string::npos) << reply.body;
    EXPECT_TRUE(refused.ends_within(500ms));
    EXPECT_EQ(server.services().metrics.refused_connections, 1u);
    work_.let_finish();
    for (auto& connection : waiting) EXPECT_EQ(connection->receive().body, "done");
}

TEST_F(Connections, SilentClientsInLineGiveWayToNewOnes) {
    Limits limits;
    limits.max_connections = 1;
    limits.max_waiting_connections = 2;
    TestServer server(test_routes(), limits);
    RawConnection busy(server.port());
    busy.send(http_request("GET", "/work"));
    work_.wait_until_begun(1);
    RawConnection silent(server.port()), silent_too(server.port());
    while (server.services().metrics.waiting_connections < 2) std::this_thread::sleep_for(1ms);
    RawConnection speaks(server.port());
    speaks.send(http_request("POST", "/echo", "a"));
    EXPECT_TRUE(silent.ends_within(500ms)) << "the one that has been silent for longest";
    EXPECT_FALSE(silent_too.hears_within(100ms));
    work_.let_finish();
    EXPECT_EQ(busy.receive().body, "done");
    EXPECT_EQ(speaks.receive().body, "a");
}

TEST_F(Connections, AnAddressHasNoMoreConnectionsThanItMay) {
    Limits limits;
    limits.max_address_connections = 3;
    TestServer server(test_routes(), limits);
    std::vector<std::unique_ptr<RawConnection>> open;
    for (int i = 0; i < 3; ++i) {
        open.push_back(std::make_unique<RawConnection>(server.port()));
        open.back()->send(http_request("GET", "/healthz"));
        EXPECT_EQ(open.back()->receive().status, 200);
    }
    for (int i = 0; i < 5; ++i) {
        const auto refused = http(server.port(), "POST", "/echo", "a");
        EXPECT_EQ(refused.status, 429);
        EXPECT_EQ(refused.header("retry-after"), "1");
        EXPECT_NE(refused.body.find("max-address-connections"), std::string::npos);
    }
    open.pop_back();
    const auto is_let_in = [&] { return http(server.port(), "POST", "/echo", "a").status == 200; };
    const auto start = Clock::now();
    bool let_in = is_let_in();
    for (; !let_in && Clock::now() - start < 5s; let_in = is_let_in())
        std::this_thread::sleep_for(5ms);
    EXPECT_TRUE(let_in);
}

}  // namespace
}  // namespace relit::server
