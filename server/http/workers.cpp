#include "server/http/workers.h"

#include <system_error>

namespace relit::server {

Workers::Workers(int max, std::function<void(int)> serve)
    : max_(std::size_t(max)), serve_(std::move(serve)) {}

Workers::~Workers() { finish(); }

bool Workers::full() const {
    const std::scoped_lock lock(mutex_);
    return busy_ >= max_;
}

void Workers::wait_for_room() {
    std::unique_lock lock(mutex_);
    room_there_.wait(lock, [&] { return busy_ < max_ || released_; });
}

void Workers::release() {
    {
        const std::scoped_lock lock(mutex_);
        released_ = true;
    }
    room_there_.notify_all();
}

void Workers::hand_over(int socket) {
    const std::scoped_lock lock(mutex_);
    if (threads_.size() <= busy_ && threads_.size() < max_) try {
            threads_.emplace_back([this] { work(); });
        } catch (const std::system_error&) {
            if (threads_.empty()) throw;  // otherwise the socket waits for a thread there is
        }
    sockets_.push_back(socket);
    ++busy_;
    work_there_.notify_one();
}

void Workers::work() {
    std::unique_lock lock(mutex_);
    for (;;) {
        work_there_.wait(lock, [&] { return !sockets_.empty() || finishing_; });
        if (sockets_.empty()) return;
        const int socket = sockets_.front();
        sockets_.pop_front();
        lock.unlock();
        serve_(socket);
        lock.lock();
        --busy_;
        room_there_.notify_one();
    }
}

void Workers::finish() {
    {
        const std::scoped_lock lock(mutex_);
        finishing_ = true;
    }
    work_there_.notify_all();
    for (std::thread& thread : threads_) thread.join();
    threads_.clear();
}

}  // namespace relit::server
