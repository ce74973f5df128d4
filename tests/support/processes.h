// Other processes as /proc shows them: who is whose child, and whether anything is left of them.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <string>
#include <thread>
#include <vector>

namespace relit::test {

struct ProcessFacts {
    pid_t pid = 0;
    pid_t parent = 0;
    char state = '?';  ///< 'R' running, 'S' asleep, 'Z' ended and not waited for
    double cpu_s = 0;  ///< processor time
};

/// The processes that `parent` has started and not waited for.
[[nodiscard]] std::vector<ProcessFacts> children_of(pid_t parent);

/// Of the server `server`: its helper, and the processes that decode for it.
struct DecodingProcesses {
    std::vector<ProcessFacts> helpers;
    std::vector<ProcessFacts> workers;
};
[[nodiscard]] DecodingProcesses decoding_processes_of(pid_t server);

/// One that is at work and has been for 0.05 s of processor time, waited for and then halted (SIGSTOP), so
/// that it cannot finish before the test does to it what it wants; 0 when none has in 10 s.
[[nodiscard]] pid_t halted_decoder_of(pid_t server);

[[nodiscard]] bool is_alive(pid_t pid);  ///< a zombie is not

/// The line `name` of /proc/<pid>/status, without the name; empty where there is none.
[[nodiscard]] std::string status_of(pid_t pid, const std::string& name);

[[nodiscard]] int open_descriptors(pid_t pid);

/// Looks again and again, up to `patience`. @return whether it came true
template <class Condition>
[[nodiscard]] bool comes_true(const Condition& condition,
                              std::chrono::milliseconds patience = std::chrono::seconds(10)) {
    const auto end = std::chrono::steady_clock::now() + patience;
    while (!condition()) {
        if (std::chrono::steady_clock::now() > end) return false;
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    return true;
}

}  // namespace relit::test
