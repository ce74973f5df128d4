// Crowds of rude clients against the real program: honest ones are served all the while, memory stays
// within its bounds, and afterwards nothing is left of them.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <chrono>
#include <thread>

#include "tests/support/http_client.h"
#include "tests/support/metrics_text.h"
#include "tests/support/relit_process.h"
#include "tests/support/upload_images.h"

namespace relit::test {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
using Crowd = std::vector<std::unique_ptr<RawConnection>>;

class RudeClients : public testing::Test {
protected:
    static void SetUpTestSuite() {
        rlimit limit{};
        ASSERT_EQ(::getrlimit(RLIMIT_NOFILE, &limit), 0);
        limit.rlim_cur = limit.rlim_max;
        ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &limit), 0);
        ASSERT_GE(limit.rlim_cur, 3000u);
    }

    void start(const std::vector<std::string>& flags) {
        relitd = std::make_unique<RelitProcess>(RelitProcess::Settings{.flags = flags});
        ASSERT_GT(relitd->port(), 0) << relitd->log();
        before_mib = relitd->peak_memory_mib();
    }
    [[nodiscard]] Crowd crowd_of(int count) const {
        Crowd crowd;
        for (int i = 0; i < count; ++i)
            crowd.push_back(std::make_unique<RawConnection>(relitd->port()));
        return crowd;
    }
    [[nodiscard]] Clock::duration time_of(const std::string& target) const {
        const auto start = Clock::now();
        EXPECT_EQ(http(relitd->port(), "GET", target).status, 200) << target;
        return Clock::now() - start;
    }
    [[nodiscard]] double metric(const std::string& name) const {
        return parse_metrics(http(relitd->port(), "GET", "/metrics").body).at(name);
    }
    [[nodiscard]] long grown_mib() const { return relitd->peak_memory_mib() - before_mib; }

    std::unique_ptr<RelitProcess> relitd;
    long before_mib = 0;
};

TEST_F(RudeClients, ThreeHundredThatDripTheirHeadsKeepNobodyWaiting) {
    start({"--max-connections=64"});
    const Crowd crowd = crowd_of(300);
    const std::string head = "GET /v1/version HTTP/1.1\r\nHost: a\r\nX-Slow: ";
    for (std::size_t i = 0; i < 40; ++i) {  // a byte each, ten times a second
        for (const auto& client : crowd) (void)client->send(head.substr(i % head.size(), 1));
        EXPECT_LT(time_of("/healthz"), 500ms) << i;
        if (i % 5 == 4) {
            EXPECT_LT(time_of("/v1/version"), 3s) << i;
        }
        std::this_thread::sleep_for(50ms);
    }
    EXPECT_LT(grown_mib(), 60);
}

TEST_F(RudeClients, TwoThousandIdleConnectionsWithinTheCapHaveAThreadEachAndLittleMemory) {
    start({"--max-connections=2100"});
    const Crowd crowd = crowd_of(2000);
    EXPECT_LT(time_of("/v1/version"), 2s);
    EXPECT_GE(metric("relit_connections"), 1900);
    EXPECT_LT(grown_mib(), 150);
    EXPECT_EQ(http(relitd->port(), "POST", "/v1/images", small_png(4)).status, 201);
}

TEST_F(RudeClients, TwoThousandIdleConnectionsBeyondTheCapGiveWay) {
    start({});
    const Crowd crowd = crowd_of(2000);
    for (int i = 0; i < 10; ++i) {
        EXPECT_LT(time_of("/healthz"), 2s) << i;
        EXPECT_LT(time_of("/v1/version"), 3s) << i;
    }
    EXPECT_LT(grown_mib(), 60);
}

TEST_F(RudeClients, StormsOfThoseThatLeaveLeaveNothingBehind) {
    start({});
    for (int round = 0; round < 10; ++round) {
        Crowd crowd = crowd_of(300);
        for (std::size_t i = 0; i < crowd.size(); ++i)
            (void)crowd[i]->send(i % 3 == 0   ? http_request("GET", "/v1/samples")
                                 : i % 3 == 1 ? "POST /v1/images HTTP/1.1\r\nHost: a\r\nContent-Le"
                                              : "POST /v1/images HTTP/1.1\r\nHost: a\r\n"
                                                "Content-Length: 100000\r\n\r\nabc");
    }
    const auto begin = Clock::now();
    double open = metric("relit_connections");
    while (open > 1 && Clock::now() - begin < 10s) {
        std::this_thread::sleep_for(20ms);
        open = metric("relit_connections");
    }
    EXPECT_EQ(open, 1) << "the one that asks";
    EXPECT_EQ(metric("relit_waiting_connections"), 0);
    EXPECT_LT(time_of("/v1/version"), 1s);
    EXPECT_LT(grown_mib(), 60);
}

TEST_F(RudeClients, AMillionHeadersAreRefusedAtTheLimit) {
    start({});
    RawConnection client(relitd->port());
    std::string headers;
    for (int i = 0; i < 1000; ++i) headers += "A" + std::to_string(i) + ": b\r\n";
    client.send("GET /v1/version HTTP/1.1\r\nHost: a\r\n");
    for (int i = 0; i < 1000 && client.send(headers);) ++i;
    EXPECT_EQ(client.receive().status, 431);
    EXPECT_LT(grown_mib(), 20);
}

TEST_F(RudeClients, AChunkedBodyEndsAtItsLimitHoweverItIsCut) {
    start({"--max-image-bytes=1MiB"});
    for (const std::size_t size : {std::size_t(1), std::size_t(1000), std::size_t(1) << 20}) {
        char length[20];
        std::snprintf(length, sizeof length, "%zx\r\n", size);
        std::string chunk = length + std::string(size, 'x') + "\r\n";
        while (chunk.size() < 100'000) chunk += chunk;
        RawConnection client(relitd->port());
        client.send("POST /v1/images HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked\r\n\r\n");
        std::size_t sent = 0;
        while (sent < (100u << 20) && !client.hears_within(0ms) && client.send(chunk))
            sent += chunk.size();
        EXPECT_LT(sent, 100u << 20) << size;
        EXPECT_EQ(client.receive().status, 413) << size;
    }
    EXPECT_LT(grown_mib(), 40);
}

}  // namespace
}  // namespace relit::test
