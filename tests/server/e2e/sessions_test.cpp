// Streams of frames and full queues, through the real program.
#include <gtest/gtest.h>

#include <thread>

#include "tests/support/http_client.h"
#include "tests/support/metrics_text.h"
#include "tests/support/relit_process.h"
#include "tests/support/upload_images.h"

namespace relit::test {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

class SessionsEndToEnd : public testing::Test {
protected:
    SessionsEndToEnd() {
        const HttpReply reply = http(port(), "POST", "/v1/images", small_png(1, 512, 512));
        id_ = reply.body.substr(reply.body.find(':') + 2, 64);
    }

    [[nodiscard]] int port() const { return relitd_.port(); }
    [[nodiscard]] std::string scene(const std::string& rest) const {
        return R"({"height": {"image": ")" + id_ + "\"}, " + rest + "}";
    }
    [[nodiscard]] std::string quick() const { return scene(R"("output": {"width": 16})"); }

    // A render that takes minutes; it has been let in when this returns.
    std::unique_ptr<RawConnection> begin_slow(const std::string& session) {
        const auto before = let_in();
        auto connection = std::make_unique<RawConnection>(port());
        HttpHeaders headers;
        if (!session.empty()) headers.emplace_back("Relit-Session", session);
        connection->send(http_request(
            "POST", "/v1/render", scene(R"("material": {"illumination": "count", "steps": 10000})"),
            headers));
        const auto start = Clock::now();
        while (let_in() == before && Clock::now() - start < 5s) std::this_thread::sleep_for(2ms);
        return connection;
    }
    [[nodiscard]] double let_in() const {
        const auto samples = parse_metrics(http(port(), "GET", "/metrics").body);
        return samples.at("relit_renders_running") + samples.at("relit_renders_waiting") +
               samples.at(R"(relit_renders_total{result="superseded"})");
    }
    static void expect_superseded(RawConnection& connection) {
        const auto start = Clock::now();
        const HttpReply reply = connection.receive();
        EXPECT_EQ(reply.status, 409);
        EXPECT_NE(reply.body.find("/problems/superseded"), std::string::npos) << reply.body;
        EXPECT_LT(Clock::now() - start, 500ms);
    }

    RelitProcess relitd_{{.flags = {"--max-renders=1", "--max-queue=2", "--threads=1"}}};
    std::string id_;
};

TEST_F(SessionsEndToEnd, NewerFrameStopsTheOneThatRenders) {
    const auto older = begin_slow("drag-1");
    const auto start = Clock::now();
    const HttpReply newer =
        http(port(), "POST", "/v1/render", quick(), {{"Relit-Session", "drag-1"}});
    EXPECT_EQ(newer.status, 200) << newer.body;
    EXPECT_LT(Clock::now() - start, 2s) << "the older one went on";
    expect_superseded(*older);
}

TEST_F(SessionsEndToEnd, NewerFrameTakesThePlaceOfTheOneThatWaitsAlsoInAFullQueue) {
    const auto running = begin_slow("");
    const auto first = begin_slow("drag-1");
    const auto other = begin_slow("drag-2");
    EXPECT_EQ(http(port(), "POST", "/v1/render", quick()).status, 503) << "the queue is full";
    const auto second = begin_slow("drag-1");
    expect_superseded(*first);
    EXPECT_FALSE(other->hears_within(50ms));
    EXPECT_FALSE(running->hears_within(0ms));
}

TEST_F(SessionsEndToEnd, TokensAreShortVisibleWords) {
    for (const std::string& token :
         {std::string(), std::string("a b"), std::string(129, 'x'), std::string("\xc3\xa4")}) {
        const HttpReply reply =
            http(port(), "POST", "/v1/render", quick(), {{"Relit-Session", token}});
        EXPECT_EQ(reply.status, 400) << token;
        EXPECT_NE(reply.body.find("Relit-Session"), std::string::npos) << reply.body;
    }
    EXPECT_EQ(
        http(port(), "POST", "/v1/render", quick(), {{"Relit-Session", std::string(128, '~')}})
            .status,
        200);
}

TEST_F(SessionsEndToEnd, HealthReadinessAndMetricsAnswerWhileTheQueueIsFull) {
    std::vector<std::unique_ptr<RawConnection>> busy;
    for (int k = 0; k < 3; ++k) busy.push_back(begin_slow(""));
    const HttpReply refused = http(port(), "POST", "/v1/render", quick());
    EXPECT_EQ(refused.status, 503);
    EXPECT_NE(refused.body.find("/problems/queue-full"), std::string::npos) << refused.body;
    EXPECT_NE(refused.body.find("max-queue allows, 2"), std::string::npos) << refused.body;
    EXPECT_EQ(refused.header("retry-after"), "1");
    EXPECT_NE(refused.header("access-control-expose-headers").find("Retry-After"),
              std::string::npos);
    for (const char* path : {"/healthz", "/readyz", "/metrics"}) {
        const auto start = Clock::now();
        EXPECT_EQ(http(port(), "GET", path).status, 200) << path;
        EXPECT_LT(Clock::now() - start, 500ms) << path;
    }
    EXPECT_EQ(metric_of(port(), "relit_renders_running"), 1);
    EXPECT_EQ(metric_of(port(), "relit_renders_waiting"), 2);
    EXPECT_EQ(metric_of(port(), R"(relit_errors_total{code="queue-full"})"), 1);
}

TEST_F(SessionsEndToEnd, MetricsCountRendersAndTheirStages) {
    for (int k = 0; k < 3; ++k) ASSERT_EQ(http(port(), "POST", "/v1/render", quick()).status, 200);
    const auto samples = parse_metrics(http(port(), "GET", "/metrics").body);
    EXPECT_EQ(samples.at(R"(relit_renders_total{result="done"})"), 3);
    for (const char* stage : {"decode", "queue", "render", "encode"})
        EXPECT_EQ(
            samples.at("relit_render_stage_seconds_count{stage=\"" + std::string(stage) + "\"}"), 3)
            << stage;
    EXPECT_EQ(samples.at("relit_rendered_pixels_total"), 3 * 16 * 16);
    EXPECT_EQ(
        samples.at(R"(relit_http_requests_total{route="/v1/render",method="POST",status="200"})"),
        3);
    EXPECT_EQ(samples.at(R"(relit_request_seconds_count{route="/v1/render"})"), 3);
    EXPECT_GE(samples.at("relit_connections"), 1) << "its own";
}

}  // namespace
}  // namespace relit::test
