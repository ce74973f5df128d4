#include "server/http/connection.h"

#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "server/http/head.h"

namespace relit::server {
namespace {

using Clock = Pace::Clock;
constexpr std::size_t piece = 16 << 10;
constexpr std::chrono::seconds first_words_time{1};
constexpr std::chrono::seconds linger_time{1};
constexpr std::size_t linger_bytes = 64 << 20;

int milliseconds_until(Clock::time_point deadline) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now());
    return int(std::clamp<long long>(left.count(), 0, 3'600'000));
}

// Waits for one of `events`; false when the deadline passes first.
bool wait_for(int socket, short events, Clock::time_point deadline) {
    pollfd waiting{.fd = socket, .events = events, .revents = 0};
    for (;;) {
        const int ready = ::poll(&waiting, 1, milliseconds_until(deadline));
        if (ready > 0) return true;
        if (ready == 0 || errno != EINTR) return false;
    }
}

// Is `other` readable while `socket` is not, by the deadline? -1 never is.
bool asks_first(int other, int socket, Clock::time_point deadline) {
    pollfd waiting[2] = {{.fd = socket, .events = POLLIN, .revents = 0},
                         {.fd = other, .events = POLLIN, .revents = 0}};
    const int ready = ::poll(waiting, 2, milliseconds_until(deadline));
    return ready > 0 && waiting[0].revents == 0;
}

}  // namespace

Connection::~Connection() { ::close(socket_); }

bool Connection::wait_for_request(int give_way) {
    if (!buffered().empty()) return true;
    const auto deadline = Clock::now() + limits_.idle_timeout;
    if (std::exchange(new_, false) &&
        wait_for(socket_, POLLIN, std::min(deadline, Clock::now() + first_words_time)))
        return true;
    pollfd waiting[2] = {{.fd = socket_, .events = POLLIN, .revents = 0},
                         {.fd = give_way, .events = POLLIN, .revents = 0}};
    for (;;) {
        const int ready = ::poll(waiting, 2, milliseconds_until(deadline));
        if (ready < 0 && errno == EINTR) continue;
        return ready > 0 && waiting[0].revents != 0;
    }
}

bool Connection::has_more() const {
    return !buffered().empty() || wait_for(socket_, POLLIN, Clock::now());
}

Connection::Received Connection::receive_from_socket(char* data, std::size_t size,
                                                     Clock::time_point deadline) {
    for (;;) {
        const auto received = ::recv(socket_, data, size, 0);
        if (received > 0) {
            traffic_.received += std::uint64_t(received);
            return {Got::data, std::size_t(received)};
        }
        if (received == 0) return {Got::end, 0};
        if (errno == EINTR) continue;
        if (errno != EAGAIN && errno != EWOULDBLOCK) return {Got::failure, 0};
        if (!wait_for(socket_, POLLIN, deadline)) return {Got::timeout, 0};
    }
}

Connection::ReceivedHead Connection::receive_head(int give_way) {
    buffer_.erase(0, taken_);
    taken_ = 0;
    const auto begin = Clock::now();
    auto deadline = begin + limits_.head_timeout;
    std::size_t looked_at = 0;
    for (;;) {
        while (buffered().starts_with("\r\n")) {  // RFC 9112, 2.2: empty lines before a request
            taken_ += 2;
            looked_at = 0;
        }
        const auto end = find_head_end(buffered(), looked_at);
        if (end.state == HeadEnd::malformed) return {.got = Got::data, .malformed = true};
        const bool whole = end.state == HeadEnd::complete;
        if ((whole ? end.size : buffered().size()) > limits_.max_head_bytes)
            return {.got = Got::data, .too_large = true};
        if (whole) return {.got = Got::data, .size = end.size};
        looked_at = buffered() == "\r" ? 0 : buffered().size();

        char data[piece];
        const auto patience = std::min(deadline, Clock::now() + limits_.read_timeout);
        if (asks_first(give_way, socket_, patience)) {  // somebody waits who has sent all of his
            deadline = std::min(deadline, begin + first_words_time);
            give_way = -1;
            continue;
        }
        const auto received = receive_from_socket(data, sizeof data, patience);
        if (received.got != Got::data) return {.got = received.got};
        buffer_.append(data, received.size);
        if (taken_ > limits_.max_head_bytes) return {.got = Got::data, .malformed = true};
    }
}

Connection::Received Connection::receive(char* data, std::size_t size, Pace& pace) {
    const auto patience = [&] {
        return std::min(pace.deadline(), Clock::now() + limits_.read_timeout);
    };
    if (buffered().empty()) {
        buffer_.clear();
        taken_ = 0;
        if (Clock::now() > pace.deadline()) return {Got::timeout, 0};
        if (size >= piece) {
            const auto received = receive_from_socket(data, size, patience());
            pace.add(received.size);
            return received;
        }
        buffer_.resize(piece);  // small reads come from a parser that reads byte by byte
        const auto received = receive_from_socket(buffer_.data(), piece, patience());
        buffer_.resize(received.size);
        pace.add(received.size);
        if (received.got != Got::data) return received;
    }
    const auto count = std::min(size, buffered().size());
    std::memcpy(data, buffered().data(), count);
    take(count);
    return {Got::data, count};
}

std::size_t Connection::send(std::string_view data, Pace& pace) {
    if (Clock::now() > pace.deadline()) return 0;
    for (;;) {
        const auto sent = ::send(socket_, data.data(), data.size(), MSG_NOSIGNAL);
        if (sent > 0) {
            pace.add(std::size_t(sent));
            traffic_.sent += std::uint64_t(sent);
            return std::size_t(sent);
        }
        if (sent < 0 && errno == EINTR) continue;
        if (sent == 0 || (errno != EAGAIN && errno != EWOULDBLOCK)) return 0;
        const auto patience = std::min(pace.deadline(), Clock::now() + limits_.write_timeout);
        if (!wait_for(socket_, POLLOUT, patience)) return 0;
    }
}

void Connection::close_lingering() {
    ::shutdown(socket_, SHUT_WR);
    const auto deadline = Clock::now() + linger_time;
    char data[piece];
    std::size_t bytes = 0;
    while (Clock::now() < deadline && bytes < linger_bytes) {
        const auto received = receive_from_socket(data, sizeof data, deadline);
        if (received.got != Got::data) return;
        bytes += received.size;
    }
}

}  // namespace relit::server
