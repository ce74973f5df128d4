#include "tests/cli/support/cli_process.h"

#include <fcntl.h>
#include <poll.h>
#include <pty.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <stdexcept>
#include <thread>

#include "tests/support/data.h"
#include "tests/support/temporary_folder.h"

namespace relit::test {
namespace {

namespace fs = std::filesystem;

int status_of(int waited) {
    return WIFEXITED(waited) ? WEXITSTATUS(waited) : 128 + WTERMSIG(waited);
}

// In the child: does not return.
[[noreturn]] void become(const std::vector<std::string>& arguments, const fs::path& folder) {
    const std::string path = fs::path(RELIT_PATH).parent_path().string() + ":" +
                             fs::path(RELITD_PATH).parent_path().string() + ":" +
                             std::getenv("PATH");
    ::setenv("PATH", path.c_str(), 1);
    ::setenv("TERM", "dumb", 1);
    ::setenv("HOME", folder.c_str(), 1);
    std::vector<char*> pointers;
    for (const std::string& argument : arguments)
        pointers.push_back(const_cast<char*>(argument.c_str()));
    pointers.push_back(nullptr);
    if (::chdir(folder.c_str()) == 0) ::execvp(pointers[0], pointers.data());
    ::_exit(127);
}

void redirect(int descriptor, const fs::path& file, int flags) {
    const int opened = ::open(file.c_str(), flags, 0600);
    if (opened < 0 || ::dup2(opened, descriptor) < 0) ::_exit(126);
    ::close(opened);
}

}  // namespace

Ran shell(const std::string& command, const fs::path& folder, const std::string& input) {
    const TemporaryFolder files;
    std::ofstream(files.path() / "in", std::ios::binary) << input;
    const pid_t pid = ::fork();
    if (pid == 0) {
        redirect(STDIN_FILENO, files.path() / "in", O_RDONLY);
        redirect(STDOUT_FILENO, files.path() / "out", O_WRONLY | O_CREAT);
        redirect(STDERR_FILENO, files.path() / "err", O_WRONLY | O_CREAT);
        become({"bash", "-o", "pipefail", "-c", command}, folder);
    }
    int waited = 0;
    ::waitpid(pid, &waited, 0);
    return {status_of(waited), read_file(files.path() / "out"), read_file(files.path() / "err")};
}

OnTerminal::OnTerminal(const std::vector<std::string>& arguments, const fs::path& folder) {
    winsize size{.ws_row = 24, .ws_col = 100, .ws_xpixel = 0, .ws_ypixel = 0};
    pid_ = ::forkpty(&terminal_, nullptr, nullptr, &size);
    if (pid_ < 0) throw std::runtime_error("no terminal");
    if (pid_ == 0) become(arguments, folder);
}

OnTerminal::~OnTerminal() {
    if (pid_ > 0) {
        ::kill(pid_, SIGKILL);
        ::waitpid(pid_, nullptr, 0);
    }
    ::close(terminal_);
}

void OnTerminal::type(const std::string& keys) const {
    if (::write(terminal_, keys.data(), keys.size()) != ssize_t(keys.size()))
        throw std::runtime_error("the terminal takes no keys");
}

void OnTerminal::signal(int number) const { ::kill(pid_, number); }

bool OnTerminal::read_some(Duration patience) {
    pollfd waiting{.fd = terminal_, .events = POLLIN, .revents = 0};
    if (::poll(&waiting, 1, int(patience.count() * 1000)) <= 0) return false;
    char data[4096];
    const auto received = ::read(terminal_, data, sizeof data);
    if (received > 0) screen_.append(data, std::size_t(received));
    return received > 0;
}

bool OnTerminal::shows(const std::string& text, Duration patience) {
    const auto begin = std::chrono::steady_clock::now();
    while (screen_.find(text) == std::string::npos) {
        const Duration left = patience - (std::chrono::steady_clock::now() - begin);
        if (left.count() <= 0 || !read_some(left)) return false;
    }
    return true;
}

int OnTerminal::exit_status(Duration patience) {
    const auto begin = std::chrono::steady_clock::now();
    while (std::chrono::steady_clock::now() - begin < patience) {
        int waited = 0;
        if (::waitpid(pid_, &waited, WNOHANG) == pid_) {
            while (read_some(Duration(0))) {
            }
            pid_ = -1;
            return status_of(waited);
        }
        if (!read_some(Duration(0.005))) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return -1;
}

}  // namespace relit::test
