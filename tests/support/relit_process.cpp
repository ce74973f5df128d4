#include "tests/support/relit_process.h"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <thread>

extern char** environ;  // NOLINT: POSIX declares it nowhere

namespace relit::test {
namespace {

std::string read_file(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

std::vector<char*> pointers_to(std::vector<std::string>& texts) {
    std::vector<char*> pointers;
    pointers.reserve(texts.size() + 1);
    for (std::string& text : texts) pointers.push_back(text.data());
    pointers.push_back(nullptr);
    return pointers;
}

}  // namespace

RelitProcess::RelitProcess(Settings settings) : settings_(std::move(settings)) {
    if (settings_.data_dir.empty()) settings_.data_dir = folder_.path() / "data";
    start();
}

RelitProcess::~RelitProcess() {
    if (exit_status_) return;
    ::kill(pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
}

void RelitProcess::start() {
    std::vector<std::string> arguments = {RELITD_PATH};
    if (settings_.with_usual_flags)
        for (const std::string& flag : {std::string("--host=127.0.0.1"), std::string("--port=0"),
                                        "--data-dir=" + settings_.data_dir.string()})
            arguments.push_back(flag);
    arguments.insert(arguments.end(), settings_.flags.begin(), settings_.flags.end());
    std::vector<std::string> variables = settings_.environment;
    for (char** variable = environ; *variable; ++variable) variables.emplace_back(*variable);

    int output[2];
    if (::pipe2(output, O_CLOEXEC) != 0) throw std::runtime_error("no pipe");
    const std::string log_path = folder_.path() / "log";
    posix_spawn_file_actions_t actions;
    ::posix_spawn_file_actions_init(&actions);
    ::posix_spawn_file_actions_adddup2(&actions, output[1], STDOUT_FILENO);
    ::posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, log_path.c_str(),
                                       O_WRONLY | O_CREAT | O_APPEND, 0600);
    const int failed = ::posix_spawn(&pid_, RELITD_PATH, &actions, nullptr,
                                     pointers_to(arguments).data(), pointers_to(variables).data());
    ::posix_spawn_file_actions_destroy(&actions);
    ::close(output[1]);
    if (failed != 0) throw std::runtime_error("cannot start " RELITD_PATH);
    wait_until_listening(output[0]);
    ::close(output[0]);
}

void RelitProcess::wait_until_listening(int output) {
    const std::string announcement = "relitd listens on http://";
    pollfd waiting{.fd = output, .events = POLLIN, .revents = 0};
    while (::poll(&waiting, 1, 30'000) > 0) {
        char data[4096];
        const auto received = ::read(output, data, sizeof data);
        if (received <= 0) {  // it has ended
            exit_status();
            return;
        }
        output_.append(data, std::size_t(received));
        const auto line = output_.find(announcement);
        const auto end = output_.find('\n', std::min(line, output_.size()));
        if (line == std::string::npos || end == std::string::npos) continue;
        port_ = std::stoi(output_.substr(output_.rfind(':', end) + 1));
        return;
    }
    throw std::runtime_error("relitd neither listens nor ends: " + log());
}

void RelitProcess::signal(int number) const { ::kill(pid_, number); }

std::optional<int> RelitProcess::exit_status(std::chrono::milliseconds patience) {
    const auto deadline = std::chrono::steady_clock::now() + patience;
    while (!exit_status_) {
        int status = 0;
        if (::waitpid(pid_, &status, WNOHANG) == pid_) {
            exit_status_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
        } else if (std::chrono::steady_clock::now() > deadline) {
            return std::nullopt;
        } else {
            std::this_thread::sleep_for(std::chrono::milliseconds(5));
        }
    }
    return exit_status_;
}

std::string RelitProcess::log() const { return read_file(folder_.path() / "log"); }

long RelitProcess::peak_memory_mib() const {
    std::istringstream status(read_file("/proc/" + std::to_string(pid_) + "/status"));
    for (std::string line; std::getline(status, line);)
        if (line.starts_with("VmHWM:")) return std::stol(line.substr(6)) / 1024;
    throw std::runtime_error("no VmHWM");
}

}  // namespace relit::test
