// Takes connections in: each gets a thread while there is one, and waits in line while there is none,
// where it costs a descriptor and nothing else. Who has sent a whole head is served first, and idle
// and dripping connections give way to it. Health is told from the line, so that it answers whatever
// goes on. For the transport.
#pragma once

#include <atomic>
#include <chrono>
#include <deque>
#include <functional>
#include <string_view>

#include "core/base/error.h"
#include "server/http/address_slots.h"
#include "server/http/refusal_log.h"
#include "server/http/workers.h"
#include "server/limits.h"
#include "server/metrics.h"

namespace relit::server {

/// What an Acceptor does with sockets, which are non-blocking; whoever is called closes them.
struct Reception {
    std::function<void(int socket)> serve;  ///< on a thread of its own, to the connection's end
    /// Is what a client has sent a whole request that answer() answers?
    std::function<bool(std::string_view sent)> is_probe;
    std::function<void(int socket)> answer;  ///< at once, on the accepting thread
};

class Acceptor {
public:
    Acceptor(const Limits& limits, Metrics& metrics, Reception reception);
    ~Acceptor();
    Acceptor(const Acceptor&) = delete;
    Acceptor& operator=(const Acceptor&) = delete;

    /// Accepts until stop(), then closes those in line; those that are served go on.
    /// @param listener  non-blocking
    /// @throws std::runtime_error where the system gives up
    void run(int listener);
    void stop();

    /// Returns when the connections that are served have come to their end.
    void finish() { workers_.finish(); }

    /// Readable while somebody waits for an idle connection to end, and from stop() on.
    [[nodiscard]] int give_way() const { return give_way_; }
    /// The same, for who decides whether a connection stays open.
    [[nodiscard]] bool crowded() const { return crowded_; }

private:
    using Clock = std::chrono::steady_clock;
    struct Waiting {
        /// Of its first head: nothing, a part, all (or more than is looked at); or it has its answer.
        enum class State { silent, begun, ready, refused } state = State::silent;
        int socket = -1;  ///< -1: no longer in line
        AddressSlots::Slot slot;
        Clock::time_point since;
    };

    void wait_for_something(int listener);
    void look_at(Waiting& client);
    void look_at_head(Waiting& client, std::string_view sent);
    void accept_all(int listener);
    void take_in(int socket);
    [[nodiscard]] bool make_place();
    void hand_over(Waiting client);
    void give_threads();
    void give_up_the_late();
    void refuse(Waiting& client, const Error& error);
    void log_refusal(const Error& error, std::string_view id);
    void tidy();
    [[nodiscard]] Clock::time_point end_of(const Waiting& client) const;

    const Limits& limits_;
    Metrics& metrics_;
    const Reception reception_;
    AddressSlots addresses_;
    RefusalLog refusals_;
    std::deque<Waiting> line_;  // in the order of arrival
    std::atomic<bool> crowded_{false};
    std::atomic<bool> stopping_{false};
    int give_way_ = -1;
    int wake_ = -1;  // a thread is free, or stop()
    Workers workers_;
};

}  // namespace relit::server
