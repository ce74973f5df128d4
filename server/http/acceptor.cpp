#include "server/http/acceptor.h"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <spdlog/spdlog.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

#include "server/error_codes.h"
#include "server/http/head.h"
#include "server/http/peer.h"
#include "server/http/problem.h"
#include "server/http/request_log.h"
#include "server/logging/log.h"

namespace relit::server {
namespace {

constexpr std::chrono::seconds linger_time{1};
constexpr std::size_t most_peeked = 4096;  // a probe's head is smaller

std::string text_of(const Reply& reply) {
    std::string text = fmt::format("HTTP/1.1 {} \r\nContent-Type: {}\r\nContent-Length: {}\r\n",
                                   reply.status, reply.content_type, reply.bytes().size());
    for (const auto& [name, value] : reply.headers)
        text.append(name).append(": ").append(value).append("\r\n");
    return text.append("Connection: close\r\n\r\n").append(reply.bytes());
}

int milliseconds_until(std::chrono::steady_clock::time_point moment) {
    const auto left =
        std::chrono::ceil<std::chrono::milliseconds>(moment - std::chrono::steady_clock::now());
    return int(std::clamp<long long>(left.count(), 0, 3'600'000));
}

}  // namespace

Acceptor::Acceptor(const Limits& limits, Metrics& metrics, Reception reception)
    : limits_(limits),
      metrics_(metrics),
      reception_(std::move(reception)),
      addresses_(limits.max_address_connections),
      give_way_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)),
      wake_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)),
      workers_(limits.max_connections, [this] { ::eventfd_write(wake_, 1); }) {
    if (give_way_ < 0 || wake_ < 0) throw std::runtime_error("out of file descriptors");
}

Acceptor::~Acceptor() {
    workers_.finish();
    ::close(give_way_);
    ::close(wake_);
}

void Acceptor::stop() {
    stopping_ = true;
    ::eventfd_write(give_way_, 1);
    ::eventfd_write(wake_, 1);
}

void Acceptor::run(int listener) {
    while (!stopping_) {
        wait_for_something(listener);
        if (stopping_) break;
        accept_all(listener);
        give_threads();
        give_up_the_late();
        tidy();
    }
    for (const Waiting& client : line_) ::close(client.socket);
    line_.clear();
    metrics_.waiting_connections = 0;
}

// Of clients that are ready, leaving alone is of interest; what they sent stays readable.
void Acceptor::wait_for_something(int listener) {
    std::vector<pollfd> waiting = {{.fd = wake_, .events = POLLIN, .revents = 0},
                                   {.fd = listener, .events = POLLIN, .revents = 0}};
    auto wake_up = Clock::time_point::max();
    for (const Waiting& client : line_) {
        const short events = client.state == Waiting::State::ready ? POLLRDHUP : POLLIN | POLLRDHUP;
        waiting.push_back({.fd = client.socket, .events = events, .revents = 0});
        wake_up = std::min(wake_up, end_of(client));
    }
    const int timeout = line_.empty() ? -1 : milliseconds_until(wake_up);
    if (::poll(waiting.data(), waiting.size(), timeout) < 0) {
        if (errno == EINTR) return;
        throw std::runtime_error("poll failed");
    }
    eventfd_t count = 0;
    if (waiting[0].revents != 0) ::eventfd_read(wake_, &count);
    for (std::size_t i = 2; i < waiting.size(); ++i)
        if (waiting[i].revents != 0) look_at(line_[i - 2]);
}

// One that has sent something or is gone.
void Acceptor::look_at(Waiting& client) {
    std::array<char, most_peeked> data;
    const bool refused = client.state == Waiting::State::refused;
    const auto size = ::recv(client.socket, data.data(), data.size(), refused ? 0 : MSG_PEEK);
    if (size < 0 && (errno == EAGAIN || errno == EINTR)) return;
    if (size <= 0 || client.state == Waiting::State::ready)
        ::close(std::exchange(client.socket, -1));
    else if (!refused)  // what one still sends that was refused is of no interest
        look_at_head(client, {data.data(), std::size_t(size)});
}

void Acceptor::look_at_head(Waiting& client, std::string_view sent) {
    if (reception_.is_probe(sent)) {
        reception_.answer(std::exchange(client.socket, -1));
        return;
    }
    const bool whole = find_head_end(sent).state != HeadEnd::incomplete;
    if (client.state == Waiting::State::silent || whole) client.since = Clock::now();
    client.state =
        whole || sent.size() == most_peeked ? Waiting::State::ready : Waiting::State::begun;
    // Readable again when there is more than that.
    const int more = client.state == Waiting::State::begun ? int(sent.size()) + 1 : 1;
    ::setsockopt(client.socket, SOL_SOCKET, SO_RCVLOWAT, &more, sizeof more);
}

void Acceptor::accept_all(int listener) {
    constexpr int at_once = 64;  // then those in line have their turn
    for (int i = 0; i < at_once; ++i) {
        const int socket = ::accept4(listener, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
        if (socket >= 0) {
            take_in(socket);
        } else if (errno == EMFILE || errno == ENFILE || errno == ENOBUFS || errno == ENOMEM) {
            spdlog::warn("no connection accepted: {}", std::strerror(errno));
            std::this_thread::sleep_for(std::chrono::milliseconds(100));
            return;
        } else if (errno != EINTR && errno != ECONNABORTED) {
            return;
        }
    }
}

void Acceptor::take_in(int socket) {
    const int on = 1;
    ::setsockopt(socket, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    Waiting client{.socket = socket, .slot = {}, .since = Clock::now()};
    client.slot = addresses_.take(limits_.max_address_connections > 0 ? peer_address(socket) : "");
    if (!client.slot) {
        refuse(client, {error_code::rate_limited,
                        "The address has as many connections as max-address-connections allows.",
                        {},
                        "max-address-connections"});
    } else if (line_.empty() && !workers_.full()) {
        hand_over(std::move(client));
        return;
    } else if (!make_place()) {
        refuse(client, {error_code::queue_full,
                        "As many connections wait as max-waiting-connections allows.",
                        {},
                        "max-waiting-connections"});
    }
    if (client.socket >= 0) line_.push_back(std::move(client));
}

// Is there one in line, if need be that of the client whose head has been missing for longest?
bool Acceptor::make_place() {
    if (line_.size() < std::size_t(limits_.max_waiting_connections)) return true;
    const auto silent = std::find_if(line_.begin(), line_.end(), [](const Waiting& client) {
        return client.socket >= 0 && client.state != Waiting::State::ready;
    });
    if (silent == line_.end()) return false;
    ::close(silent->socket);
    line_.erase(silent);
    return true;
}

void Acceptor::hand_over(Waiting client) {
    const int least = 1;
    ::setsockopt(client.socket, SOL_SOCKET, SO_RCVLOWAT, &least, sizeof least);
    workers_.hand_over([this, socket = client.socket, slot = std::move(client.slot)] {
        reception_.serve(socket);
    });
}

// Those that have yet to send a head keep no thread from those that have.
void Acceptor::give_threads() {
    using State = Waiting::State;
    for (const auto state : {State::ready, State::begun, State::silent})
        for (Waiting& client : line_) {
            if (workers_.full()) return;
            if (client.socket < 0 || client.state != state) continue;
            hand_over(std::move(client));
            client.socket = -1;
        }
}

Acceptor::Clock::time_point Acceptor::end_of(const Waiting& client) const {
    switch (client.state) {
        case Waiting::State::silent:
            return client.since + limits_.idle_timeout;
        case Waiting::State::begun:
            return client.since + limits_.head_timeout;
        case Waiting::State::ready:
            return client.since + limits_.render_timeout;
        default:
            return client.since + linger_time;
    }
}

void Acceptor::give_up_the_late() {
    const auto now = Clock::now();
    for (Waiting& client : line_) {
        if (client.socket < 0 || end_of(client) > now) continue;
        if (client.state == Waiting::State::begun)
            refuse(client, {error_code::request_timeout, "The head arrived too slowly."});
        else if (client.state == Waiting::State::ready)
            refuse(client, {error_code::queue_full,
                            "All connections that max-connections allows are busy.",
                            {},
                            "max-connections"});
        else ::close(std::exchange(client.socket, -1));
    }
}

// The id is that of the last one.
void Acceptor::log_refusal(const Error& error, std::string_view id) {
    const std::string_view reason = error.limit.empty() ? error.code : error.limit;
    const std::uint64_t count = refusals_.count(reason, Clock::now());
    if (count == 0) return;
    const LogField fields[] = {{"id", id}, {"reason", reason}, {"count", std::int64_t(count)}};
    log_event(spdlog::level::warn, "connections refused", fields);
}

// The client has a moment to read why: closing with bytes unread would make the kernel throw the
// reply away.
void Acceptor::refuse(Waiting& client, const Error& error) {
    ++metrics_.refused_connections;
    if (!error.limit.empty()) ++metrics_.limit_refusals.of(error.limit);
    Reply reply = problem_reply(error);
    const std::string id = request_id_of({});
    reply.headers.emplace("X-Request-Id", id);
    const std::string text = text_of(reply);
    log_refusal(error, id);
    const bool sent =
        ::send(client.socket, text.data(), text.size(), MSG_NOSIGNAL) == ssize_t(text.size());
    ::shutdown(client.socket, SHUT_WR);
    const int least = 1;
    ::setsockopt(client.socket, SOL_SOCKET, SO_RCVLOWAT, &least, sizeof least);
    client.state = Waiting::State::refused;
    client.since = Clock::now();
    client.slot = nullptr;
    const auto full = 2 * std::size_t(limits_.max_waiting_connections);
    if (!sent || line_.size() >= full) ::close(std::exchange(client.socket, -1));
}

void Acceptor::tidy() {
    std::erase_if(line_, [](const Waiting& client) { return client.socket < 0; });
    const bool somebody = std::any_of(line_.begin(), line_.end(), [](const Waiting& client) {
        return client.state == Waiting::State::ready;
    });
    metrics_.waiting_connections = int(line_.size());
    if (somebody == crowded_) return;
    crowded_ = somebody;
    eventfd_t count = 0;
    if (somebody) ::eventfd_write(give_way_, 1);
    else ::eventfd_read(give_way_, &count);
    if (stopping_) ::eventfd_write(give_way_, 1);  // stop() may have come between
}

}  // namespace relit::server
