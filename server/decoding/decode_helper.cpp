#include "server/decoding/decode_helper.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/signalfd.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <string>

#include "core/io/decode.h"
#include "server/decoding/decode_process.h"
#include "server/decoding/messages.h"

namespace relit::server {
namespace {

class Helper {
public:
    Helper() : children_changed_(watch_children()), own_pid_(::getpid()) {}

    void run() {
        pollfd waiting[2] = {{.fd = decode_helper_socket, .events = POLLIN, .revents = 0},
                             {.fd = children_changed_, .events = POLLIN, .revents = 0}};
        for (;;) {
            if (::poll(waiting, 2, -1) < 0) continue;
            if (waiting[1].revents != 0) reap();
            if (waiting[0].revents != 0 && !follow_order()) return;
        }
    }

    void end_all() {
        for (const auto& [number, pid] : processes_) ::kill(pid, SIGKILL);
        while (::waitpid(-1, nullptr, 0) > 0 || errno == EINTR) {
        }
    }

private:
    static int watch_children() {
        sigset_t signals;
        ::sigemptyset(&signals);
        ::sigaddset(&signals, SIGCHLD);
        ::sigprocmask(SIG_SETMASK, &signals, nullptr);  // none of what the server blocks
        return ::signalfd(-1, &signals, SFD_CLOEXEC);
    }

    // A number is in the table until its process has been waited for: no other process is killed.
    void reap() {
        signalfd_siginfo info{};
        (void)::read(children_changed_, &info, sizeof info);  // one may stand for several
        for (pid_t pid = 0; (pid = ::waitpid(-1, nullptr, WNOHANG)) > 0;)
            std::erase_if(processes_, [&](const auto& entry) { return entry.second == pid; });
    }

    // @return false: the server is gone
    bool follow_order() {
        Descriptors descriptors;
        const auto order = receive_message<HelperOrder>(decode_helper_socket, &descriptors);
        if (!order) return false;
        if (order->kind == HelperOrder::Kind::start) start(*order, descriptors.take(0));
        else if (const auto found = processes_.find(order->process); found != processes_.end())
            ::kill(found->second, SIGKILL);
        return true;
    }

    // Where it fails, the server sees the end of the process's socket.
    void start(const HelperOrder& order, int socket) {
        if (socket < 0) return;
        const pid_t pid = ::fork();
        if (pid == 0) become_process(order.allowance, socket);
        if (pid > 0) processes_[order.process] = pid;
        ::close(socket);
    }

    [[noreturn]] void become_process(const DecodeAllowance& allowance, int socket) {
        ::prctl(PR_SET_PDEATHSIG, SIGKILL);
        if (::getppid() != own_pid_) ::_exit(1);  // it had ended before it could be told
        // Everything of the helper's goes: what is above the socket of this process, and below.
        if (socket != decode_helper_socket) ::dup2(socket, decode_helper_socket);
        ::close_range(decode_helper_socket + 1, ~0u, 0);
        ::_exit(run_decode_process(decode_helper_socket, allowance));
    }

    int children_changed_;
    pid_t own_pid_;
    std::map<std::uint64_t, pid_t> processes_;
};

// Libraries start threads of their own when they are loaded (log4cplus, which OpenImageIO brings along,
// has four), which then sleep for good: asleep, they hold no lock that a fork would inherit.
void wait_for_other_threads_to_sleep() {
    const auto is_awake = [](const std::filesystem::directory_entry& thread) {
        if (std::stoi(thread.path().filename()) == ::getpid()) return false;
        std::ifstream file(thread.path() / "stat");
        std::string line;
        std::getline(file, line);
        const auto name_end = line.rfind(')');
        return name_end != std::string::npos && line.compare(name_end, 3, ") S") != 0;
    };
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(2);
    const std::filesystem::directory_iterator none;
    while (std::find_if(std::filesystem::directory_iterator("/proc/self/task"), none, is_awake) !=
               none &&
           std::chrono::steady_clock::now() < end)
        ::usleep(1000);
}

bool is_socket(int descriptor) {
    int type = 0;
    socklen_t size = sizeof type;
    return ::getsockopt(descriptor, SOL_SOCKET, SO_TYPE, &type, &size) == 0 &&
           type == SOCK_SEQPACKET;
}

// Signals of a terminal or a supervisor go to all processes; the server alone decides what ends when.
void leave_signals_to_the_server() {
    for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGPIPE}) std::signal(number, SIG_IGN);
}

}  // namespace

int run_decode_helper() {
    if (!is_socket(decode_helper_socket)) {
        std::cerr << "relitd: decode-helper is for relitd itself\n";
        return 2;
    }
    leave_signals_to_the_server();
    prepare_decoders();
    wait_for_other_threads_to_sleep();
    Helper helper;
    helper.run();
    helper.end_all();
    return 0;
}

}  // namespace relit::server
