#include "tests/support/processes.h"

#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <optional>
#include <sstream>

namespace relit::test {
namespace {

namespace fs = std::filesystem;

fs::path folder_of(pid_t pid) { return "/proc/" + std::to_string(pid); }

// proc(5): the name may hold anything, up to the last parenthesis.
std::optional<ProcessFacts> facts_of(pid_t pid) {
    std::ifstream file(folder_of(pid) / "stat");
    std::string line;
    if (!std::getline(file, line)) return std::nullopt;
    std::istringstream rest(line.substr(line.rfind(')') + 1));
    ProcessFacts facts{.pid = pid};
    rest >> facts.state >> facts.parent;
    std::string skipped;
    for (int field = 5; field < 14; ++field) rest >> skipped;
    double user = 0, system = 0;
    rest >> user >> system;
    facts.cpu_s = (user + system) / double(::sysconf(_SC_CLK_TCK));
    return facts;
}

}  // namespace

// Each thread has those that it has started. (A search of all of /proc takes longer than a decoder.)
std::vector<ProcessFacts> children_of(pid_t parent) {
    std::vector<ProcessFacts> children;
    std::error_code gone;
    for (const auto& thread : fs::directory_iterator(folder_of(parent) / "task", gone)) {
        std::ifstream list(thread.path() / "children");
        for (pid_t pid = 0; list >> pid;)
            if (const auto facts = facts_of(pid)) children.push_back(*facts);
    }
    return children;
}

DecodingProcesses decoding_processes_of(pid_t server) {
    DecodingProcesses processes{children_of(server), {}};
    for (const ProcessFacts& helper : processes.helpers) {
        const auto workers = children_of(helper.pid);
        processes.workers.insert(processes.workers.end(), workers.begin(), workers.end());
    }
    return processes;
}

pid_t halted_decoder_of(pid_t server) {
    pid_t busy = 0;
    std::map<pid_t, double> before;  // what it has used for other images
    (void)comes_true([&] {
        for (const ProcessFacts& worker : decoding_processes_of(server).workers)
            if (worker.state == 'R' &&
                worker.cpu_s - before.emplace(worker.pid, worker.cpu_s).first->second >= 0.05)
                busy = worker.pid;
        return busy != 0;
    });
    if (busy != 0) ::kill(busy, SIGSTOP);
    return busy;
}

bool is_alive(pid_t pid) {
    const auto facts = facts_of(pid);
    return facts && facts->state != 'Z';
}

std::string status_of(pid_t pid, const std::string& name) {
    std::ifstream file(folder_of(pid) / "status");
    for (std::string line; std::getline(file, line);)
        if (line.starts_with(name + ":")) {
            const auto begin = line.find_first_not_of(" \t", name.size() + 1);
            return begin == std::string::npos ? "" : line.substr(begin);
        }
    return "";
}

int open_descriptors(pid_t pid) {
    return int(std::distance(fs::directory_iterator(folder_of(pid) / "fd"), {}));
}

}  // namespace relit::test
