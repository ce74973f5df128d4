// Threads for connections: one each, started when needed up to a cap, kept for the next ones. A
// thread here only waits for sockets and slots; computing is done by the executor.
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace relit::server {

class Workers {
public:
    /// @param max   threads at most, > 0
    /// @param room  called on a thread that has come to the end of a job and is free for another
    Workers(int max, std::function<void()> room);
    ~Workers();  ///< finish()
    Workers(const Workers&) = delete;
    Workers& operator=(const Workers&) = delete;

    /// Are all threads there may be at work?
    [[nodiscard]] bool full() const;

    /// Has `job` done on a thread of its own. @throws std::system_error when a first thread cannot
    /// be started
    void hand_over(std::function<void()> job);

    /// Lets the jobs handed over come to their end; returns when all threads are gone.
    void finish();

private:
    void work();

    const std::size_t max_;
    const std::function<void()> room_;
    mutable std::mutex mutex_;
    std::condition_variable work_there_;
    std::deque<std::function<void()>> jobs_;
    std::size_t busy_ = 0;  // handed over and not yet at their end
    bool finishing_ = false;
    std::vector<std::thread> threads_;
};

}  // namespace relit::server
