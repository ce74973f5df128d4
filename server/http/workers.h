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
    /// @param max    threads at most, > 0
    /// @param serve  called with each socket handed over, on a thread of its own; owns and closes
    ///               it
    Workers(int max, std::function<void(int socket)> serve);
    ~Workers();  ///< finish()
    Workers(const Workers&) = delete;
    Workers& operator=(const Workers&) = delete;

    /// Are all threads there may be at work?
    [[nodiscard]] bool full() const;

    /// Waits until one is not, or until `release()`.
    void wait_for_room();
    void release();

    /// Has `socket` served. @throws std::system_error when a first thread cannot be started
    void hand_over(int socket);

    /// Lets the sockets handed over be served to their end; returns when all threads are gone.
    void finish();

private:
    void work();

    const std::size_t max_;
    const std::function<void(int)> serve_;
    mutable std::mutex mutex_;
    std::condition_variable work_there_;
    std::condition_variable room_there_;
    std::deque<int> sockets_;
    std::size_t busy_ = 0;  // handed over and not yet served to the end
    bool released_ = false;
    bool finishing_ = false;
    std::vector<std::thread> threads_;
};

}  // namespace relit::server
