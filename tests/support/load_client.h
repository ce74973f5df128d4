// Requests at a steady rate, whatever becomes of them: a client that waits for its answers would ask a
// slow server for less. One thread and no allocation a request, for it shares the processors with the
// server that it measures.
#pragma once

#include <chrono>
#include <string>
#include <vector>

namespace relit::test {

struct LoadSettings {
    int port = 0;
    std::string request;  ///< sent again and again, over connections that stay open
    double per_second = 100;
    std::chrono::duration<double> duration{1};
    int connections = 200;  ///< at most; a request for which none is free is not sent
};

struct LoadResult {
    struct Answer {
        double sent_s = 0;   ///< after the beginning
        double took_ms = 0;  ///< from there to its last byte
    };
    std::vector<Answer> admitted;  ///< 200
    std::vector<Answer> refused;   ///< 503 with Retry-After
    int others = 0;                ///< other statuses, 503 without Retry-After, broken connections
    int not_sent = 0;              ///< no connection was free, or it was 50 ms too late for it
    double seconds = 0;            ///< until the last answer
    double client_cpu_s = 0;       ///< of the client itself, in all
};

/// @throws std::runtime_error when nothing comes for 10 s
[[nodiscard]] LoadResult run_load(const LoadSettings& settings);

/// The part-th quantile (0.99 ...) of the times; 0 where there are none.
[[nodiscard]] double quantile_ms(const std::vector<LoadResult::Answer>& answers, double part);

}  // namespace relit::test
