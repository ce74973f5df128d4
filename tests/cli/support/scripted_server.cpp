#include "tests/cli/support/scripted_server.h"

#include <arpa/inet.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <stdexcept>

namespace relit::test {
namespace {

// Waits in short pieces, so that the server can be stopped.
bool readable(int socket, const std::atomic<bool>& stopping) {
    pollfd waiting{.fd = socket, .events = POLLIN, .revents = 0};
    while (!stopping)
        if (::poll(&waiting, 1, 20) > 0) return true;
    return false;
}

std::size_t body_length(const std::string& head) {
    const auto found = head.find("Content-Length: ");
    return found == std::string::npos ? 0 : std::stoul(head.substr(found + 16));
}

}  // namespace

std::string http_reply(const std::string& status, const std::string& body,
                       const std::string& header) {
    return "HTTP/1.1 " + status + "\r\n" + (header.empty() ? "" : header + "\r\n") +
           "Content-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body;
}

ScriptedServer::ScriptedServer(std::vector<std::string> replies) : replies_(std::move(replies)) {
    listener_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    auto* generic = reinterpret_cast<sockaddr*>(&address);
    if (::bind(listener_, generic, size) != 0 || ::listen(listener_, 8) != 0 ||
        ::getsockname(listener_, generic, &size) != 0)
        throw std::runtime_error("cannot listen");
    port_ = ntohs(address.sin_port);
    thread_ = std::thread([this] { serve(); });
}

ScriptedServer::~ScriptedServer() {
    stopping_ = true;
    thread_.join();
    ::close(listener_);
}

std::string ScriptedServer::url() const { return "http://127.0.0.1:" + std::to_string(port_); }

std::vector<std::string> ScriptedServer::requests() const {
    const std::lock_guard lock(mutex_);
    return requests_;
}

void ScriptedServer::serve() {
    while (readable(listener_, stopping_)) {
        const int connection = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
        serve_connection(connection);
        ::close(connection);
    }
}

void ScriptedServer::serve_connection(int connection) {
    std::string received;
    const auto receive = [&] {
        char data[65536];
        if (!readable(connection, stopping_)) return false;
        const auto count = ::read(connection, data, sizeof data);
        if (count > 0) received.append(data, std::size_t(count));
        return count > 0;
    };
    for (;;) {
        std::size_t head = 0;
        while ((head = received.find("\r\n\r\n")) == std::string::npos)
            if (!receive()) return;
        const std::size_t whole = head + 4 + body_length(received.substr(0, head));
        while (received.size() < whole)
            if (!receive()) return;
        {
            const std::lock_guard lock(mutex_);
            requests_.push_back(received.substr(0, received.find(" HTTP/")));
        }
        received.erase(0, whole);
        if (next_ == replies_.size()) continue;
        const std::string& reply = replies_[next_++];
        if (::send(connection, reply.data(), reply.size(), MSG_NOSIGNAL) < 0) return;
    }
}

}  // namespace relit::test
