#include "server/http/hangup_watch.h"

#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>
#include <vector>

namespace relit::server {
namespace {

[[noreturn]] void fail(const char* what) {
    throw std::system_error(errno, std::generic_category(), what);
}

}  // namespace

HangupWatch::HangupWatch()
    : epoll_(::epoll_create1(EPOLL_CLOEXEC)), wake_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
    epoll_event event{.events = EPOLLIN, .data = {.u64 = 0}};
    if (epoll_ < 0 || wake_ < 0 || ::epoll_ctl(epoll_, EPOLL_CTL_ADD, wake_, &event) != 0)
        fail("watch for closed connections");
    thread_ = std::thread([this] { run(); });
}

HangupWatch::~HangupWatch() {
    const std::uint64_t one = 1;
    [[maybe_unused]] const auto written = ::write(wake_, &one, sizeof one);
    thread_.join();
    ::close(wake_);
    ::close(epoll_);
}

HangupWatch::Entry::Entry(HangupWatch& watch, int socket) : watch_(watch), socket_(socket) {
    const std::scoped_lock lock(watch_.mutex_);
    number_ = watch_.next_number_++;
    watch_.entries_.emplace(number_, this);
    if (watch_.stopped_) gone_.request_stop();
    // One shot: a closed connection is reported once, not until somebody reads its end.
    epoll_event event{.events = EPOLLRDHUP | EPOLLONESHOT, .data = {.u64 = number_}};
    ::epoll_ctl(watch_.epoll_, EPOLL_CTL_ADD, socket_, &event);
}

HangupWatch::Entry::~Entry() {
    ::epoll_ctl(watch_.epoll_, EPOLL_CTL_DEL, socket_, nullptr);
    const std::scoped_lock lock(watch_.mutex_);
    watch_.entries_.erase(number_);
}

void HangupWatch::report(std::uint64_t number) {
    std::stop_source source(std::nostopstate);
    {
        const std::scoped_lock lock(mutex_);
        const auto found = entries_.find(number);
        if (found == entries_.end()) return;
        source = found->second->gone_;
    }
    source.request_stop();  // runs callbacks: never under the lock
}

void HangupWatch::stop_all(bool and_close) {
    std::vector<std::stop_source> sources;
    {
        const std::scoped_lock lock(mutex_);
        stopped_ = true;
        for (const auto& [number, entry] : entries_) {
            sources.push_back(entry->gone_);
            if (and_close) ::shutdown(entry->socket_, SHUT_RDWR);
        }
    }
    for (auto& source : sources) source.request_stop();
}

void HangupWatch::run() {
    for (;;) {
        epoll_event event{};
        if (::epoll_wait(epoll_, &event, 1, -1) != 1) {
            if (errno == EINTR) continue;
            return;
        }
        if (event.data.u64 == 0) return;
        report(event.data.u64);
    }
}

}  // namespace relit::server
