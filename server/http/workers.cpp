#include "server/http/workers.h"

#include <system_error>
#include <utility>

namespace relit::server {

Workers::Workers(int max, std::function<void()> room)
    : max_(std::size_t(max)), room_(std::move(room)) {}

Workers::~Workers() { finish(); }

bool Workers::full() const {
    const std::scoped_lock lock(mutex_);
    return busy_ >= max_;
}

void Workers::hand_over(std::function<void()> job) {
    const std::scoped_lock lock(mutex_);
    if (threads_.size() <= busy_ && threads_.size() < max_) try {
            threads_.emplace_back([this] { work(); });
        } catch (const std::system_error&) {
            if (threads_.empty()) throw;  // otherwise the job waits for a thread there is
        }
    jobs_.push_back(std::move(job));
    ++busy_;
    work_there_.notify_one();
}

void Workers::work() {
    std::unique_lock lock(mutex_);
    for (;;) {
        work_there_.wait(lock, [&] { return !jobs_.empty() || finishing_; });
        if (jobs_.empty()) return;
        {
            const auto job = std::move(jobs_.front());
            jobs_.pop_front();
            lock.unlock();
            job();
        }
        lock.lock();
        --busy_;
        lock.unlock();
        room_();
        lock.lock();
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
