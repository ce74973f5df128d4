#include "server/process_metrics.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

namespace relit::server {
namespace {

namespace fs = std::filesystem;

// The fields of /proc/self/stat from the third on (proc(5)); the second, the program's name, may
// hold anything, up to the last parenthesis.
std::vector<double> stat_fields() {
    std::ifstream file("/proc/self/stat");
    std::string line;
    std::getline(file, line);
    std::istringstream rest(line.substr(std::min(line.rfind(')'), line.size() - 1) + 1));
    std::vector<double> fields;
    for (std::string word; rest >> word;) fields.push_back(std::strtod(word.c_str(), nullptr));
    return fields;
}

// When the machine was started, in seconds since 1970; 0 when nobody says.
double boot_time_s() {
    std::ifstream file("/proc/stat");
    for (std::string line; std::getline(file, line);)
        if (line.starts_with("btime ")) return std::strtod(line.c_str() + 6, nullptr);
    return 0;
}

void add_from_stat(std::vector<PlainMetric>& metrics) {
    const auto fields = stat_fields();
    const auto field = [&](std::size_t number) { return fields[number - 3]; };  // as in proc(5)
    if (fields.size() < 22) return;
    const auto ticks_per_s = double(::sysconf(_SC_CLK_TCK));
    metrics.push_back({"process_cpu_seconds_total", "Processor time used, in all threads.", true,
                       (field(14) + field(15)) / ticks_per_s});
    metrics.push_back({"process_threads", "Threads.", false, field(20)});
    metrics.push_back(
        {"process_virtual_memory_bytes", "Size of the address space.", false, field(23)});
    metrics.push_back({"process_resident_memory_bytes", "Memory in use.", false,
                       field(24) * double(::sysconf(_SC_PAGESIZE))});
    if (const double boot = boot_time_s(); boot > 0)
        metrics.push_back({"process_start_time_seconds", "Start, in seconds since 1970.", false,
                           boot + field(22) / ticks_per_s});
}

void add_descriptors(std::vector<PlainMetric>& metrics) {
    std::error_code error;
    const fs::directory_iterator open("/proc/self/fd", error);
    if (!error)
        metrics.push_back({"process_open_fds", "Open file descriptors.", false,
                           double(std::distance(begin(open), end(open)))});
    rlimit limit{};
    if (::getrlimit(RLIMIT_NOFILE, &limit) == 0)
        metrics.push_back({"process_max_fds", "File descriptors that may be open.", false,
                           double(limit.rlim_cur)});
}

}  // namespace

std::vector<PlainMetric> process_metrics() {
    std::vector<PlainMetric> metrics;
    add_from_stat(metrics);
    add_descriptors(metrics);
    return metrics;
}

}  // namespace relit::server
