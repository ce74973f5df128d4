// Notices that a client has closed its connection while its request is still being worked on. One
// thread for all connections, asleep until the kernel reports a hang-up: a connection costs two
// system calls, a request none.
#pragma once

#include <cstdint>
#include <map>
#include <mutex>
#include <stop_token>
#include <thread>

namespace relit::server {

class HangupWatch {
public:
    HangupWatch();
    ~HangupWatch();
    HangupWatch(const HangupWatch&) = delete;
    HangupWatch& operator=(const HangupWatch&) = delete;

    /// A watched connection; watching ends with it. Make it after the socket, destroy it before.
    class Entry {
    public:
        ~Entry();
        Entry(const Entry&) = delete;
        Entry& operator=(const Entry&) = delete;

        /// Set within milliseconds of the client's closing, also of its sending side alone: whoever
        /// asks for an answer keeps the connection open.
        [[nodiscard]] std::stop_token token() const { return gone_.get_token(); }

    private:
        friend class HangupWatch;
        Entry(HangupWatch& watch, int socket);
        HangupWatch& watch_;
        int socket_;
        std::uint64_t number_ = 0;
        std::stop_source gone_;
    };

    [[nodiscard]] Entry watch(int socket) { return {*this, socket}; }

    /// Sets every token there is and will be, and shuts all sockets down when `and_close` says so.
    void stop_all(bool and_close);

private:
    void run();
    void report(std::uint64_t number);

    int epoll_ = -1;
    int wake_ = -1;
    std::mutex mutex_;
    std::map<std::uint64_t, Entry*> entries_;
    std::uint64_t next_number_ = 1;  // 0 is the wake-up
    bool stopped_ = false;
    std::thread thread_;
};

}  // namespace relit::server
