#include "server/http/server.h"

#include <fcntl.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

// The library's own backlog is 5: a burst of connections would fail.
#define CPPHTTPLIB_LISTEN_BACKLOG 1024
#include <httplib.h>
#include <spdlog/spdlog.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <limits>
#include <new>
#include <optional>
#include <stdexcept>
#include <thread>

#include "server/error_codes.h"
#include "server/http/connection.h"
#include "server/http/hangup_watch.h"
#include "server/http/head.h"
#include "server/http/multipart.h"
#include "server/http/workers.h"

namespace relit::server {
namespace {

constexpr std::size_t copied_body_bytes = 64 << 10;  // up to here one send() for head and body

// What the library reads and writes instead of the socket: a head of our making with nothing in it
// but the method and the body's framing, so that no header of a client's reaches its parser; then
// the body.
class LibraryStream final : public httplib::Stream {
public:
    LibraryStream(Connection& connection, std::string head, const Limits& limits)
        : connection_(connection), head_(std::move(head)), limits_(limits) {}

    ssize_t read(char* data, std::size_t size) override {
        if (head_read_ < head_.size()) {
            const auto count = head_.copy(data, size, head_read_);
            head_read_ += count;
            return ssize_t(count);
        }
        if (reply_begun_ || last_ != Connection::Got::data) return -1;
        const auto received = connection_.receive(data, size, pace_);
        last_ = received.got;
        return last_ == Connection::Got::data ? ssize_t(received.size) : -1;
    }

    ssize_t write(const char* data, std::size_t size) override {
        const auto sent = connection_.send({data, size}, pace_);
        return sent > 0 || size == 0 ? ssize_t(sent) : -1;
    }

    /// From here on nothing is read: the library would look for the rest of a refused body.
    void begin_reply() {
        reply_begun_ = true;
        pace_ = Pace(limits_.write_timeout, limits_.min_bytes_per_second);
    }

    [[nodiscard]] Connection::Got last() const { return last_; }

    bool is_readable() const override { return true; }
    bool wait_readable() const override { return true; }
    bool wait_writable() const override { return true; }  // write() does the waiting
    bool is_peer_alive() const override { return true; }
    void get_remote_ip_and_port(std::string&, int&) const override {}
    void get_local_ip_and_port(std::string&, int&) const override {}
    socket_t socket() const override { return connection_.socket(); }
    time_t duration() const override { return 0; }

private:
    Connection& connection_;
    std::string head_;
    const Limits& limits_;
    Pace pace_{limits_.write_timeout, limits_.min_bytes_per_second};
    std::size_t head_read_ = 0;
    Connection::Got last_ = Connection::Got::data;
    bool reply_begun_ = false;
};

// The parts of the library that its connection loop is made of. Ours replaces that loop: it has to
// see heads first, keep pipelined bytes, give every wait an end, and survive an accept() that
// fails.
struct Library : httplib::Server {
    using httplib::Server::process_request;
    using httplib::Server::svr_sock_;
};

// Counts the bytes of bodies in flight, over all connections; gives them back when the request is
// over.
class BodyMemory {
public:
    BodyMemory(std::atomic<std::size_t>& total, std::size_t max) : total_(total), max_(max) {}
    ~BodyMemory() { total_ -= mine_; }
    BodyMemory(const BodyMemory&) = delete;
    BodyMemory& operator=(const BodyMemory&) = delete;

    [[nodiscard]] bool add(std::size_t bytes) {
        mine_ += bytes;
        return total_.fetch_add(bytes) + bytes <= max_;
    }

private:
    std::atomic<std::size_t>& total_;
    std::size_t max_;
    std::size_t mine_ = 0;
};

// One request and its reply on their way through the library.
struct Exchange {
    Head head;
    Request request;
    const Route* route = nullptr;  // of a request with a body
    std::optional<Error> refusal;  // answered without reading further, then the connection is closed
    bool keep_open = false;
    LibraryStream* stream = nullptr;
};

// The library hands its callbacks nothing of ours; a connection is served by one thread from end to
// end.
thread_local Exchange* current = nullptr;

std::string library_head(const Exchange& exchange) {
    const Head& head = exchange.head;
    if (exchange.refusal || !head.has_body())
        return exchange.request.head ? "HEAD / HTTP/1.1\r\n\r\n" : "GET / HTTP/1.1\r\n\r\n";
    std::string text = "POST / HTTP/1.1\r\n";
    if (head.expects_continue) text += "Expect: 100-continue\r\n";
    if (head.chunked) return text + "Transfer-Encoding: chunked\r\n\r\n";
    return text + "Content-Length: " + std::to_string(*head.content_length) + "\r\n\r\n";
}

std::string http_date() {  // RFC 9110, 5.6.7
    const std::time_t now = std::time(nullptr);
    std::tm utc{};
    ::gmtime_r(&now, &utc);
    char text[40];
    return {text, std::strftime(text, sizeof text, "%a, %d %b %Y %H:%M:%S GMT", &utc)};
}

void give_to_library(Reply reply, httplib::Response& response) {
    response.status = reply.status;
    for (const auto& [name, value] : reply.headers) response.set_header(name, value);
    if (reply.bytes().empty()) return;
    if (reply.bytes().size() <= copied_body_bytes) {
        response.set_content(reply.bytes().data(), reply.bytes().size(), reply.content_type);
        return;
    }
    const auto size = reply.bytes().size();
    const auto type = reply.content_type;
    const auto held = std::make_shared<const Reply>(std::move(reply));
    response.set_content_provider(
        size, type, [held](std::size_t offset, std::size_t length, httplib::DataSink& sink) {
            return sink.write(held->bytes().data() + offset, length);
        });
}

// What was sent of a head that could not be parsed, as far as the reply and the log can use it.
void describe_unparsed(std::string_view text, Request& request) {
    const auto line = text.substr(0, text.find_first_of("\r\n"));
    const auto method = line.substr(0, line.find(' '));
    const auto rest = line.substr(std::min(method.size() + 1, line.size()));
    request.head = method == "HEAD";
    request.method = "?";
    request.path = rest.substr(0, rest.find_first_of(" ?"));
}

void fill_request(Head& head, Request& request) {
    request.head = head.method == "HEAD";
    request.method = request.head ? "GET" : head.method;
    request.path = head.path;
    request.query = std::move(head.query);
    request.headers = std::move(head.headers);
}

Error too_large(const Route& route) {
    if (route.max_body_bytes == 0)
        return {error_code::body_too_large, "A request to this path has no body."};
    return {error_code::body_too_large, "The body is larger than " + std::string(route.limit_name) +
                                            ", " + std::to_string(route.max_body_bytes) +
                                            " bytes."};
}

std::optional<Error> refusal_of_piece(std::size_t received, std::size_t size, const Route& route,
                                      BodyMemory& memory) {
    if (received + size > route.max_body_bytes) return too_large(route);
    if (memory.add(size)) return std::nullopt;
    return Error(error_code::memory_full, "The bodies under way fill max-body-memory.");
}

Error interrupted(Connection::Got last) {
    if (last == Connection::Got::timeout)
        return {error_code::request_timeout, "The body arrived too slowly."};
    return {error_code::malformed_request, "The body is incomplete or its chunks are broken."};
}

[[noreturn]] void fail_to_listen(const std::string& host, int port, int error) {
    const std::string reason = error == EADDRINUSE
                                   ? "the address is in use; is another relitd running?"
                               : error == EACCES        ? "no permission to use this port"
                               : error == EADDRNOTAVAIL ? "this machine has no such address"
                                                        : "the address cannot be resolved or used";
    throw std::runtime_error("cannot listen on " + host + ":" + std::to_string(port) + ": " +
                             reason);
}

}  // namespace

struct Server::Impl {
    Impl(const Router& its_router, Services& its_services, const Limits& its_limits)
        : router(its_router), services(its_services), limits(its_limits) {
        if (give_way < 0 || stop_accepting < 0) throw std::runtime_error("out of file descriptors");
        library.set_payload_max_length(std::numeric_limits<std::size_t>::max());  // counted by us
        library.set_pre_routing_handler(
            [this](const httplib::Request&, httplib::Response& response) {
                return answer_without_body(response);
            });
        library.Post("/", [this](const httplib::Request&, httplib::Response& response,
                                 const httplib::ContentReader& reader) {
            answer_with_body(reader, response);
        });
        library.set_post_routing_handler(
            [this](const httplib::Request&, httplib::Response& response) { finish_head(response); });
        library.set_tcp_nodelay(true);
        library.set_socket_options([](socket_t socket) {
            // Not SO_REUSEPORT, the library's default: two servers would share a port without a
            // word.
            const int on = 1;
            ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
        });
    }

    ~Impl() {
        if (listener >= 0) ::close(listener);
        ::close(give_way);
        ::close(stop_accepting);
    }

    // --- callbacks of the library, in their order ---

    httplib::Server::HandlerResponse answer_without_body(httplib::Response& response) {
        Exchange& exchange = *current;
        if (!exchange.refusal && exchange.head.has_body())
            return httplib::Server::HandlerResponse::Unhandled;
        give_to_library(answer(exchange), response);
        return httplib::Server::HandlerResponse::Handled;
    }

    void answer_with_body(const httplib::ContentReader& reader, httplib::Response& response) {
        Exchange& exchange = *current;
        BodyMemory memory(body_bytes, limits.max_body_memory_bytes);
        try {
            read_body(reader, exchange, memory);
        } catch (const Error& error) {
            exchange.refusal = error;
        } catch (const std::bad_alloc&) {
            exchange.refusal.emplace(error_code::memory_full,
                                     "The server is out of memory for now.");
        }
        give_to_library(answer(exchange), response);
    }

    void read_body(const httplib::ContentReader& reader, Exchange& exchange, BodyMemory& memory) {
        std::string body;
        body.reserve(exchange.head.content_length.value_or(0));
        std::optional<Error> error;
        const bool whole = reader([&](const char* data, std::size_t size) {
            error = refusal_of_piece(body.size(), size, *exchange.route, memory);
            if (!error) body.append(data, size);
            return !error;
        });
        if (error) throw Error(*error);
        if (!whole) throw interrupted(exchange.stream->last());
        const auto type = exchange.request.header("Content-Type").value_or("");
        if (is_multipart(type)) {
            exchange.request.parts = parse_multipart(std::move(body), type, limits.max_parts);
        } else {
            exchange.request.body = std::move(body);
        }
    }

    Reply answer(Exchange& exchange) {
        if (exchange.refusal) {
            exchange.keep_open = false;
            return refuse(router, exchange.request, *exchange.refusal);
        }
        exchange.request.deadline = std::chrono::steady_clock::now() + limits.render_timeout;
        Reply reply = dispatch(router, std::move(exchange.request), services);
        exchange.keep_open = exchange.head.keep_alive && !stopping && !crowded;
        return reply;
    }

    // Corrects what the library adds to every head.
    void finish_head(httplib::Response& response) {
        current->stream->begin_reply();
        for (const char* name : {"Keep-Alive", "Connection", "Accept-Ranges"})
            response.headers.erase(name);
        if (response.status == 204 || response.status == 304)
            response.headers.erase("Content-Length");
        if (!current->keep_open) response.set_header("Connection", "close");
        else if (!current->head.is_1_1) response.set_header("Connection", "keep-alive");
        response.set_header("Date", http_date());
    }

    // --- connections ---

    void serve_connection(int socket) {
        Connection connection(socket, limits);
        const auto watched = hangups.watch(socket);
        try {
            while (connection.wait_for_request(give_way))
                if (!serve_request(connection, watched.token())) break;
        } catch (const std::exception& error) {
            spdlog::error("connection given up: {}", error.what());
        }
    }

    // @return whether the connection stays open
    bool serve_request(Connection& connection, std::stop_token client_gone) {
        Exchange exchange;
        if (!receive_head(connection, exchange)) return false;
        exchange.request.id = new_request_id();
        exchange.request.client_gone = std::move(client_gone);
        LibraryStream stream(connection, library_head(exchange), limits);
        exchange.stream = &stream;
        current = &exchange;
        bool closed = false;
        const bool sent =
            library.process_request(stream, {}, 0, {}, 0, false, closed, nullptr, nullptr);
        current = nullptr;
        if (sent && exchange.keep_open) return true;
        if (sent && (exchange.refusal || connection.has_more())) connection.close_lingering();
        return false;
    }

    // Receives and judges a head. @return false where there is nobody to answer
    bool receive_head(Connection& connection, Exchange& exchange) {
        const auto received = connection.receive_head();
        if (received.got == Connection::Got::end || received.got == Connection::Got::failure)
            return false;
        const auto text = connection.buffered();
        try {
            if (received.got == Connection::Got::timeout)
                throw Error(error_code::request_timeout, "The head arrived too slowly.");
            if (received.malformed)
                throw Error(error_code::malformed_request, "The request is not HTTP.");
            if (received.too_large) throw head_too_large(text, limits);
            exchange.head = parse_head(text.substr(0, received.size), limits);
        } catch (const Error& error) {
            describe_unparsed(text, exchange.request);
            exchange.refusal = error;
            return true;
        }
        connection.take(received.size);
        fill_request(exchange.head, exchange.request);
        if (exchange.head.may_have_body()) judge_body(exchange);
        return true;
    }

    // Refuses before the body is read what would be refused after.
    void judge_body(Exchange& exchange) {
        try {
            exchange.route = &router.match(exchange.request.method, exchange.request.path).route;
            if (!exchange.head.has_length())
                throw Error(error_code::length_required,
                            "The request needs a Content-Length, or a chunked body.");
            if (exchange.head.content_length.value_or(0) > exchange.route->max_body_bytes)
                throw too_large(*exchange.route);
        } catch (const Error& error) {
            exchange.refusal = error;
        }
    }

    // --- listening ---

    void accept_connections() {
        pollfd waiting[2] = {{.fd = listener, .events = POLLIN, .revents = 0},
                             {.fd = stop_accepting, .events = POLLIN, .revents = 0}};
        while (!stopping) {
            if (::poll(waiting, 2, -1) < 0 && errno != EINTR)
                throw std::runtime_error("poll failed");
            make_room();
            if (stopping) return;
            const int socket = ::accept4(listener, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
            if (socket >= 0) {
                const int on = 1;
                ::setsockopt(socket, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
                workers.hand_over(socket);
            } else if (errno == EMFILE || errno == ENFILE || errno == ENOBUFS || errno == ENOMEM) {
                spdlog::warn("no connection accepted: {}", std::strerror(errno));
                std::this_thread::sleep_for(std::chrono::milliseconds(100));
            }
        }
    }

    // A client wants in: with all threads at work, idle connections give way, and it waits in the
    // backlog.
    void make_room() {
        if (!workers.full()) return;
        crowded = true;
        ::eventfd_write(give_way, 1);
        workers.wait_for_room();
        crowded = false;
        eventfd_t value = 0;
        if (!stopping) ::eventfd_read(give_way, &value);
        if (stopping) ::eventfd_write(give_way, 1);  // stop() may have come between
    }

    const Router& router;
    Services& services;
    const Limits& limits;
    std::atomic<bool> stopping{false};
    std::atomic<bool> crowded{false};  // somebody waits for a connection to end
    std::atomic<std::size_t> body_bytes{0};
    int listener = -1;
    int give_way = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    int stop_accepting = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    Library library;
    HangupWatch hangups;
    Workers workers{limits.max_connections, [this](int socket) { serve_connection(socket); }};
};

Server::Server(const Router& router, Services& services, const Limits& limits)
    : impl_(std::make_unique<Impl>(router, services, limits)) {}

Server::~Server() {
    stop();
    cut();
}

int Server::bind(const std::string& host, int port) {
    errno = 0;
    int bound = port;
    if (port == 0) bound = impl_->library.bind_to_any_port(host);
    else if (!impl_->library.bind_to_port(host, port)) bound = -1;
    if (bound <= 0) fail_to_listen(host, port, errno);
    impl_->listener = impl_->library.svr_sock_;
    ::fcntl(impl_->listener, F_SETFL, ::fcntl(impl_->listener, F_GETFL) | O_NONBLOCK);
    return bound;
}

void Server::serve() {
    impl_->accept_connections();
    ::close(
        std::exchange(impl_->listener, -1));  // from here on clients are refused, not left waiting
    impl_->workers.finish();
}

void Server::stop() {
    impl_->stopping = true;
    ::eventfd_write(impl_->give_way, 1);
    ::eventfd_write(impl_->stop_accepting, 1);
    impl_->workers.release();
}

void Server::cancel() { impl_->hangups.stop_all(/*and_close=*/false); }
void Server::cut() { impl_->hangups.stop_all(/*and_close=*/true); }

}  // namespace relit::server
