#include "server/logging/line_writer.h"

#include <poll.h>
#include <pthread.h>
#include <unistd.h>

#include <cerrno>
#include <condition_variable>
#include <csignal>
#include <mutex>
#include <thread>
#include <utility>

namespace relit::server {
namespace {

constexpr std::chrono::seconds last_patience{1};
constexpr std::chrono::milliseconds gather_for{2};  // waking a thread costs more than a line

// All of it, or as much as the other end takes before it is gone.
void write_all(int descriptor, std::string_view text) {
    while (!text.empty()) {
        const auto written = ::write(descriptor, text.data(), text.size());
        if (written > 0) {
            text.remove_prefix(std::size_t(written));
        } else if (written < 0 && errno == EAGAIN) {
            pollfd room{.fd = descriptor, .events = POLLOUT, .revents = 0};
            ::poll(&room, 1, -1);
        } else if (written == 0 || errno != EINTR) {
            return;
        }
    }
}

// That nobody reads the log is no reason to end.
void ignore_broken_pipes() {
    sigset_t signals;
    ::sigemptyset(&signals);
    ::sigaddset(&signals, SIGPIPE);
    ::pthread_sigmask(SIG_BLOCK, &signals, nullptr);
}

}  // namespace

struct LineWriter::State {
    explicit State(Settings its_settings) : settings(std::move(its_settings)) {}

    const Settings settings;
    std::mutex mutex;
    std::condition_variable there;  // something to write, or nothing more to come
    std::condition_variable empty;
    std::string waiting;
    std::uint64_t lost = 0;
    bool writing = false;
    int hurrying = 0;  // who waits until all is written
    bool ending = false;
};

LineWriter::LineWriter(Settings settings) : state_(std::make_shared<State>(std::move(settings))) {
    std::thread([state = state_] { write(state); }).detach();
}

LineWriter::~LineWriter() {
    flush(last_patience);
    const std::scoped_lock lock(state_->mutex);
    state_->ending = true;
    state_->there.notify_one();
}

void LineWriter::add(std::string_view line) {
    const std::scoped_lock lock(state_->mutex);
    if (state_->waiting.size() + line.size() > state_->settings.max_bytes) {
        ++state_->lost;
        return;
    }
    const bool first = state_->waiting.empty();
    state_->waiting += line;
    if (first) state_->there.notify_one();
}

bool LineWriter::flush(std::chrono::milliseconds patience) {
    std::unique_lock lock(state_->mutex);
    ++state_->hurrying;
    state_->there.notify_one();
    const bool all = state_->empty.wait_for(
        lock, patience, [&] { return state_->waiting.empty() && !state_->writing; });
    --state_->hurrying;
    return all;
}

// Everything that has come within a moment, or while the last piece was written, goes in one piece.
void LineWriter::write(const std::shared_ptr<State>& state) {
    ignore_broken_pipes();
    std::string piece;
    std::unique_lock lock(state->mutex);
    for (;;) {
        state->there.wait(lock, [&] { return !state->waiting.empty() || state->ending; });
        if (state->waiting.empty()) return;
        state->there.wait_for(lock, gather_for,
                              [&] { return state->hurrying > 0 || state->ending; });
        piece.clear();
        std::swap(piece, state->waiting);
        const auto lost = std::exchange(state->lost, 0);
        state->writing = true;
        lock.unlock();
        if (lost > 0) piece += state->settings.tell_lost(lost);
        write_all(state->settings.descriptor, piece);
        lock.lock();
        state->writing = false;
        if (state->waiting.empty()) state->empty.notify_all();
    }
}

}  // namespace relit::server
