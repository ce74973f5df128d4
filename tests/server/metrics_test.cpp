#include "server/metrics.h"

#include <gtest/gtest.h>

#include <string>
#include <thread>
#include <vector>

#include "tests/support/metrics_text.h"

namespace relit::server {
namespace {

using namespace std::chrono_literals;
using test::parse_metrics;

TEST(MetricsText, IsReadStrictlyAndSaysWhatWasCounted) {
    Metrics metrics;
    ++metrics.requests.of({"/v1/images/{id}", "GET", 200});
    ++metrics.requests.of({"/v1/images/{id}", "GET", 200});
    ++metrics.requests.of({"/v1/images/{id}", "GET", 404});
    ++metrics.errors.of("not-found");
    ++metrics.limit_refusals.of("max-queue");
    metrics.request_times.of("/healthz").observe(3ms);
    metrics.count(RenderResult::superseded);
    metrics.rendered_pixels += 12345678901;
    const PlainMetric others[] = {{"relit_waiting", "Who waits.", false, 3},
                                  {"relit_seen_total", "What was seen.", true, 1.5}};
    const auto samples = parse_metrics(metrics_text(metrics, "1.2\"\\\n3", others));
    EXPECT_EQ(samples.at(R"(relit_build_info{version="1.2\"\\\n3"})"), 1);
    const std::string requests =
        R"(relit_http_requests_total{route="/v1/images/{id}",method="GET")";
    EXPECT_EQ(samples.at(requests + R"(,status="200"})"), 2);
    EXPECT_EQ(samples.at(requests + R"(,status="404"})"), 1);
    EXPECT_EQ(samples.at(R"(relit_errors_total{code="not-found"})"), 1);
    EXPECT_EQ(samples.at(R"(relit_limit_refusals_total{limit="max-queue"})"), 1);
    EXPECT_EQ(samples.at(R"(relit_request_seconds_bucket{route="/healthz",le="0.0025"})"), 0);
    EXPECT_EQ(samples.at(R"(relit_request_seconds_bucket{route="/healthz",le="0.005"})"), 1);
    EXPECT_EQ(samples.at(R"(relit_request_seconds_sum{route="/healthz"})"), 0.003);
    EXPECT_EQ(samples.at(R"(relit_renders_total{result="superseded"})"), 1);
    EXPECT_EQ(samples.at(R"(relit_renders_total{result="done"})"), 0);
    EXPECT_EQ(samples.at(R"(relit_render_stage_seconds_count{stage="queue"})"), 0);
    EXPECT_EQ(samples.at("relit_rendered_pixels_total"), 12345678901);
    EXPECT_EQ(samples.at("relit_waiting"), 3);
    EXPECT_EQ(samples.at("relit_seen_total"), 1.5);
}

// The reader of these tests refuses what it should.
TEST(MetricsText, ThatBreaksARuleIsNoticed) {
    const std::string head = "# HELP a_total A.\n# TYPE a_total counter\n";
    const std::string times = "# HELP t T.\n# TYPE t histogram\n";
    EXPECT_EQ(parse_metrics(head + "a_total 1\n").at("a_total"), 1);
    const std::vector<std::string> broken = {
        "a_total 1\n",
        head + "a_total 1",
        head + "a_total x1\n",
        head + "a_total -1\n",
        head + "a_total 1\na_total 1\n",
        head + "b_total 1\n",
        head + head,
        head + "a_total{x=\"\"\"} 1\n",
        head + "a_total{x=\"\\\"} 1\n",
        "# TYPE a_total counter\na_total 1\n",
        times + "t_bucket{le=\"1\"} 1\nt_sum 1\nt_count 1\n",
        times + "t_bucket{le=\"1\"} 2\nt_bucket{le=\"+Inf\"} 1\nt_sum 1\nt_count 1\n",
        times +
            "t_bucket{le=\"2\"} 1\nt_bucket{le=\"1\"} 1\nt_bucket{le=\"+Inf\"} 1\n"
            "t_sum 1\nt_count 1\n",
        times + "t_bucket{le=\"+Inf\"} 1\nt_sum 1\nt_count 2\n",
    };
    for (const std::string& text : broken) EXPECT_ANY_THROW((void)parse_metrics(text)) << text;
}

TEST(Histogram, CountsATimeInTheFirstRangeThatHoldsIt) {
    Histogram times;
    for (const auto time : {0ms, 1ms, 2ms, 60000ms, 60001ms}) times.observe(time);
    const auto counts = times.counts();
    EXPECT_EQ(counts[0], 1u) << "0 ms";
    EXPECT_EQ(counts[1], 1u) << "1 ms: an end belongs to its range";
    EXPECT_EQ(counts[2], 1u) << "2 ms";
    EXPECT_EQ(counts[counts.size() - 2], 1u) << "60 s";
    EXPECT_EQ(counts.back(), 1u) << "more than 60 s";
    EXPECT_NEAR(times.sum_s(), 120.004, 1e-9);
}

TEST(Family, KeepsOneMemberForEachSetOfLabelsFromAnyThread) {
    Family<RequestLabels, Count> family;
    std::vector<std::thread> threads;
    threads.reserve(4);
    for (int t = 0; t < 4; ++t)
        threads.emplace_back([&] {
            for (int k = 0; k < 10'000; ++k) ++family.of({"route", "GET", 200 + k % 5});
        });
    for (auto& thread : threads) thread.join();
    int members = 0;
    family.each([&](const RequestLabels&, const Count& count) {
        ++members;
        EXPECT_EQ(count, 8000u);
    });
    EXPECT_EQ(members, 5);
}

}  // namespace
}  // namespace relit::server
