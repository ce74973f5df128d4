// One client's socket with its patience: every wait has an end, and a client that drips its bytes
// is given up like one that sends none. For the transport; knows nothing of HTTP but where a head
// ends.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "server/limits.h"
#include "server/metrics.h"

namespace relit::server {

/// When a transfer that has moved so many bytes is too slow: a grace period, then an average, and in
/// all no longer than transfer_timeout.
class Pace {
public:
    using Clock = std::chrono::steady_clock;
    explicit Pace(const Limits& limits)
        : start_(Clock::now()),
          grace_(limits.write_timeout),
          longest_(limits.transfer_timeout),
          rate_(double(limits.min_bytes_per_second)) {}

    void add(std::size_t bytes) { bytes_ += bytes; }
    [[nodiscard]] Clock::time_point deadline() const {
        const auto for_bytes =
            std::chrono::milliseconds(static_cast<long long>(1000.0 * double(bytes_) / rate_));
        return start_ + std::min<Clock::duration>(grace_ + for_bytes, longest_);
    }

private:
    Clock::time_point start_;
    std::chrono::seconds grace_;
    std::chrono::seconds longest_;
    double rate_;
    std::size_t bytes_ = 0;
};

class Connection {
public:
    enum class Got { data, end, timeout, failure };

    /// @param socket   non-blocking; closed by the destructor
    /// @param traffic  counts the bytes of all connections
    Connection(int socket, const Limits& limits, Traffic& traffic)
        : socket_(socket), limits_(limits), traffic_(traffic) {}
    ~Connection();
    Connection(const Connection&) = delete;
    Connection& operator=(const Connection&) = delete;

    [[nodiscard]] int socket() const { return socket_; }

    /// Waits until the client begins a request. Bytes that are there go before `give_way`.
    /// @param give_way  descriptor that, when readable, ends the wait of an idle connection; a new
    ///                  one has a second to send something all the same
    /// @return false when the connection is to be closed without a word
    [[nodiscard]] bool wait_for_request(int give_way);

    /// Receives until the buffer ends in a whole head, which is left in `buffered()`.
    /// @param give_way  descriptor that, when readable, leaves the head a second in all; -1: none
    struct ReceivedHead {
        Got got = Got::end;    ///< data: see the rest
        std::size_t size = 0;  ///< of the head, when whole
        bool malformed = false;
        bool too_large = false;
    };
    [[nodiscard]] ReceivedHead receive_head(int give_way);

    [[nodiscard]] std::string_view buffered() const {
        return std::string_view(buffer_).substr(taken_);
    }
    void take(std::size_t bytes) { taken_ += bytes; }

    /// Has the client sent more than was read?
    [[nodiscard]] bool has_more() const;

    /// Up to `size` bytes of a body, buffered ones first; never takes more from the socket's stream
    /// than asked.
    struct Received {
        Got got = Got::failure;
        std::size_t size = 0;
    };
    [[nodiscard]] Received receive(char* data, std::size_t size, Pace& pace);

    /// Sends some of `data`. @return how much; 0 when the client is gone or too slow
    [[nodiscard]] std::size_t send(std::string_view data, Pace& pace);

    /// Says the connection is over and reads what is still coming, for a second and 64 MiB at most:
    /// closing with bytes unread would make the kernel throw the reply away that tells the client
    /// why.
    void close_lingering();

private:
    [[nodiscard]] Received receive_from_socket(char* data, std::size_t size,
                                               Pace::Clock::time_point deadline);

    int socket_;
    const Limits& limits_;
    Traffic& traffic_;
    std::string buffer_;
    std::size_t taken_ = 0;
    bool new_ = true;
};

}  // namespace relit::server
