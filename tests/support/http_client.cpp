#include "tests/support/http_client.h"

#include <arpa/inet.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <stdexcept>
#include <system_error>

namespace relit::test {
namespace {

constexpr std::chrono::milliseconds longest_wait{10'000};

bool readable_within(int socket, std::chrono::milliseconds time) {
    const auto end = std::chrono::steady_clock::now() + time;
    pollfd waiting{.fd = socket, .events = POLLIN, .revents = 0};
    int ready = ::poll(&waiting, 1, int(time.count()));
    while (ready < 0 && errno == EINTR) {
        const auto left =
            std::chrono::ceil<std::chrono::milliseconds>(end - std::chrono::steady_clock::now());
        ready = ::poll(&waiting, 1, std::max(0, int(left.count())));
    }
    return ready > 0;
}

std::string lower(std::string text) {
    std::transform(text.begin(), text.end(), text.begin(),
                   [](unsigned char c) { return char(std::tolower(c)); });
    return text;
}

HttpReply parse_reply_head(std::string_view head) {
    HttpReply reply;
    if (!head.starts_with("HTTP/1.1 ")) throw std::runtime_error("no reply: " + std::string(head));
    reply.status = std::stoi(std::string(head.substr(9, 3)));
    head.remove_prefix(head.find("\r\n") + 2);
    while (!head.starts_with("\r\n")) {
        const auto line = head.substr(0, head.find("\r\n"));
        const auto colon = line.find(": ");
        reply.headers.emplace(lower(std::string(line.substr(0, colon))), line.substr(colon + 2));
        head.remove_prefix(line.size() + 2);
    }
    return reply;
}

}  // namespace

std::string HttpReply::header(const std::string& lower_case_name) const {
    const auto found = headers.find(lower_case_name);
    return found == headers.end() ? "" : found->second;
}

int connected_socket(int port) {
    const int socket = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const int on = 1;
    ::setsockopt(socket, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    if (::connect(socket, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0) {
        const std::error_code reason(errno, std::generic_category());
        ::close(socket);
        throw std::system_error(reason, "cannot connect to port " + std::to_string(port));
    }
    return socket;
}

RawConnection::RawConnection(int port) : socket_(connected_socket(port)) {}

RawConnection::~RawConnection() { close(); }

void RawConnection::close() {
    if (socket_ >= 0) ::close(std::exchange(socket_, -1));
}

bool RawConnection::send(std::string_view bytes) {
    while (!bytes.empty()) {
        const auto sent = ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
        if (sent <= 0) return false;
        bytes.remove_prefix(std::size_t(sent));
    }
    return true;
}

void RawConnection::finish_sending() { ::shutdown(socket_, SHUT_WR); }

bool RawConnection::receive_more() {
    if (!readable_within(socket_, longest_wait)) throw std::runtime_error("no answer within 10 s");
    char data[65536];
    const auto received = ::recv(socket_, data, sizeof data, 0);
    if (received <= 0) return false;
    buffer_.append(data, std::size_t(received));
    return true;
}

HttpReply RawConnection::receive_head() {
    std::size_t head_size = 0;
    while ((head_size = buffer_.find("\r\n\r\n")) == std::string::npos)
        if (!receive_more()) throw std::runtime_error("closed without a reply: " + buffer_);
    head_size += 4;
    HttpReply reply = parse_reply_head(std::string_view(buffer_).substr(0, head_size));
    buffer_.erase(0, head_size);
    return reply;
}

std::string RawConnection::receive_bytes(std::size_t size) {
    while (buffer_.size() < size)
        if (!receive_more()) throw std::runtime_error("closed within a reply");
    std::string bytes = buffer_.substr(0, size);
    buffer_.erase(0, size);
    return bytes;
}

std::optional<std::string> RawConnection::next_chunk() {
    std::size_t line = 0;
    while ((line = buffer_.find("\r\n")) == std::string::npos)
        if (!receive_more()) throw std::runtime_error("closed within a reply");
    const std::size_t size = std::stoul(receive_bytes(line + 2), nullptr, 16);
    std::string chunk = receive_bytes(size);
    (void)receive_bytes(2);
    if (size == 0) return std::nullopt;
    return chunk;
}

HttpReply RawConnection::receive(bool to_head) {
    HttpReply reply = receive_head();
    if (to_head) return reply;
    if (reply.header("transfer-encoding") == "chunked") {
        while (const auto chunk = next_chunk()) reply.body += *chunk;
        return reply;
    }
    const auto length = reply.header("content-length");
    reply.body = receive_bytes(length.empty() ? 0 : std::stoul(length));
    return reply;
}

std::string RawConnection::rest() {
    while (receive_more()) continue;
    return std::exchange(buffer_, {});
}

bool RawConnection::hears_within(std::chrono::milliseconds patience) {
    return !buffer_.empty() || readable_within(socket_, patience);
}

bool RawConnection::ends_within(std::chrono::milliseconds patience) {
    if (!buffer_.empty() || !readable_within(socket_, patience)) return false;
    char byte = 0;
    return ::recv(socket_, &byte, 1, 0) <= 0;
}

std::string http_request(const std::string& method, const std::string& target,
                         std::string_view body, const HttpHeaders& headers) {
    std::string text = method + " " + target + " HTTP/1.1\r\nHost: 127.0.0.1\r\n";
    for (const auto& [name, value] : headers)
        text.append(name).append(": ").append(value).append("\r\n");
    if (!body.empty() || method == "POST")
        text += "Content-Length: " + std::to_string(body.size()) + "\r\n";
    return text.append("\r\n").append(body);
}

HttpReply http(int port, const std::string& method, const std::string& target,
               std::string_view body, const HttpHeaders& headers) {
    RawConnection connection(port);
    connection.send(http_request(method, target, body, headers));
    return connection.receive(method == "HEAD");
}

std::pair<std::string, std::string> form_of(const std::vector<FormFile>& files) {
    const std::string boundary = "relit-test-boundary";
    std::string body;
    for (const FormFile& file : files) {
        body += "--" + boundary + "\r\nContent-Disposition: form-data; name=\"" + file.name + "\"";
        if (!file.filename.empty()) body += "; filename=\"" + file.filename + "\"";
        body += "\r\nContent-Type: application/octet-stream\r\n\r\n" + file.content + "\r\n";
    }
    return {body + "--" + boundary + "--\r\n", "multipart/form-data; boundary=" + boundary};
}

}  // namespace relit::test
