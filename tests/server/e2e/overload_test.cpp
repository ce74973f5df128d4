// Ten times what the server can do, with its default settings: who is let in is served nearly as fast as
// ever, the others hear so at once, health is told throughout, and nothing of it remains. Times are
// compared with the same machine's own, and the client's share of its processors is small and printed.
//
// OVERLOAD_SECONDS makes it long and strict: tests/soak/overload.
#include <gtest/gtest.h>
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <thread>

#include "tests/support/http_client.h"
#include "tests/support/load_client.h"
#include "tests/support/metrics_text.h"
#include "tests/support/processes.h"
#include "tests/support/relit_process.h"
#include "tests/support/upload_images.h"

namespace relit::test {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool sanitized = true;
#else
constexpr bool sanitized = false;
#endif

// What is promised of a machine that has nothing else to do; and what holds on one that compiles beside
// it: medians, and bounds that only a server without this protection misses (64 wait in its line).
struct Bounds {
    double seconds = 3;
    double part = 0.5;  ///< the quantile that is looked at
    bool from_the_first =
        false;          ///< also those who come while the line fills, and wait for all of it
    double slower = 8;  ///< those let in, than without load
    double refused_ms = 50;
    double health_part = 0.5;
    double health_ms = 50;
    double memory = 1.5;
};
constexpr Bounds promised = {.seconds = 60,
                             .part = 0.99,
                             .from_the_first = true,
                             .slower = 3,
                             .refused_ms = 10,
                             .health_part = 1,
                             .memory = 1.1};

Bounds bounds() {
    const char* const seconds = std::getenv("OVERLOAD_SECONDS");
    if (!seconds) return {};
    Bounds strict = promised;
    strict.seconds = std::stod(seconds);
    return strict;
}

constexpr int line = 64;  // max-queue, unless set

double memory_mib(const RelitProcess& relitd) {
    return std::stod(status_of(relitd.pid(), "VmRSS")) / 1024;
}

// Asks for health every 50 ms, over a new connection each time, for as long as it lives.
class HealthProbe {
public:
    explicit HealthProbe(int port)
        : thread_([this, port](const std::stop_token& stop) {
              while (!stop.stop_requested()) {
                  const auto start = Clock::now();
                  if (http(port, "GET", "/healthz").status != 200) ++failed_;
                  const std::chrono::duration<double, std::milli> took = Clock::now() - start;
                  answers_.push_back({0, took.count()});
                  std::this_thread::sleep_for(50ms);
              }
          }) {}

    /// Ends it.
    std::vector<LoadResult::Answer> answers() {
        thread_ = {};
        return std::move(answers_);
    }
    [[nodiscard]] int failed() const { return failed_; }

private:
    std::vector<LoadResult::Answer> answers_;
    int failed_ = 0;
    std::jthread thread_;
};

// A picture of some milliseconds, most of them rendering, and small, so that the client has little to do.
std::string request_for(int port) {
    const HttpReply reply = http(port, "POST", "/v1/images", small_png(1, 256, 256));
    EXPECT_EQ(reply.status, 201) << reply.body;
    return http_request("POST", "/v1/render",
                        R"({"height": {"image": ")" +
                            reply.body.substr(reply.body.find(':') + 2, 64) +
                            R"("}, "output": {"width": 32}})");
}

// One after the other, as they come back.
std::vector<LoadResult::Answer> one_by_one(int port, const std::string& request, Seconds duration) {
    RawConnection connection(port);
    std::vector<LoadResult::Answer> answers;
    const auto begin = Clock::now();
    while (Clock::now() - begin < duration) {
        const auto start = Clock::now();
        connection.send(request);
        EXPECT_EQ(connection.receive().status, 200);
        answers.push_back({Seconds(start - begin).count(),
                           std::chrono::duration<double, std::milli>(Clock::now() - start).count()});
    }
    return answers;
}

// Every connection has a thread and renders once: what threads keep for the next time is there.
void warm_up(int port, const std::string& request) {
    std::vector<std::unique_ptr<RawConnection>> all;
    for (int i = 0; i < LoadSettings().connections; ++i)
        all.push_back(std::make_unique<RawConnection>(port));
    for (const auto& connection : all) {
        connection->send(request);
        EXPECT_EQ(connection->receive().status, 200);
    }
    all.clear();
    std::this_thread::sleep_for(500ms);
}

std::string times_of(const std::vector<LoadResult::Answer>& answers) {
    return fmt::format("{} (p50 {:.2f}, p99 {:.2f}, longest {:.2f} ms)", answers.size(),
                       quantile_ms(answers, 0.5), quantile_ms(answers, 0.99),
                       quantile_ms(answers, 1));
}

TEST(Overload, IsRefusedAtOnceAndWhoIsLetInIsServedNearlyAsFastAsEver) {
    if (sanitized) GTEST_SKIP() << "times mean nothing here";
    const Bounds wanted = bounds();
    RelitProcess relitd({.flags = {"--log-level=warn"}});
    const int port = relitd.port();
    const std::string request = request_for(port);
    const double memory_at_first = memory_mib(relitd);
    warm_up(port, request);
    const auto alone = one_by_one(port, request, std::max<Seconds>(1s, 0.1 * wanted.seconds * 1s));
    const double per_second = 1000 / quantile_ms(alone, 0.05);  // a render has all threads
    const double lead_in_s = wanted.from_the_first ? 0 : 2 * line / per_second;
    const double memory_before = memory_mib(relitd);

    HealthProbe health(port);
    LoadResult load =
        run_load({port, request, 10 * per_second, Seconds(lead_in_s + wanted.seconds)});
    std::this_thread::sleep_for(1s);
    const auto after = one_by_one(port, request, 1s);
    const double memory_after = memory_mib(relitd);
    const auto probes = health.answers();

    std::erase_if(load.admitted, [&](const auto& it) { return it.sent_s < lead_in_s; });
    std::cout << fmt::format(
        "alone {}; with {:.0f}/s let in {}, refused {}, not sent {}; after it {}; health {}; "
        "memory {:.0f}, then {:.0f}, after it {:.0f} MiB; the client took {:.1f} % of a "
        "processor\n",
        times_of(alone), 10 * per_second, times_of(load.admitted), times_of(load.refused),
        load.not_sent, times_of(after), times_of(probes), memory_at_first, memory_before,
        memory_after, 100 * load.client_cpu_s / load.seconds);
    EXPECT_EQ(load.others, 0) << "all are 200, or 503 with Retry-After";
    EXPECT_GT(load.refused.size(), load.admitted.size());
    EXPECT_LE(quantile_ms(load.refused, wanted.part), wanted.refused_ms);
    const double usual = quantile_ms(alone, wanted.part);
    const double slowest = wanted.slower * usual;
    EXPECT_LE(quantile_ms(load.admitted, wanted.part), slowest);
    EXPECT_LE(quantile_ms(after, wanted.part), slowest) << "1 to 2 s after it";
    EXPECT_GT(load.admitted.size(), 20u) << "it goes on working";
    EXPECT_EQ(health.failed(), 0);
    EXPECT_LE(quantile_ms(probes, wanted.health_part), wanted.health_ms);
    EXPECT_LE(memory_after, wanted.memory * memory_before);
    EXPECT_GT(metric_of(port, R"(relit_limit_refusals_total{limit="max-queue"})"), 0);
}

}  // namespace
}  // namespace relit::test
