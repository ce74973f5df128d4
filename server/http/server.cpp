#include "server/http/server.h"

#include <fcntl.h>
#include <sys/socket.h>
#include <unistd.h>

// The library's own backlog is 5: a burst of connections would fail.
#define CPPHTTPLIB_LISTEN_BACKLOG 1024
#include <httplib.h>
#include <spdlog/spdlog.h>

#include <atomic>
#include <cerrno>
#include <ctime>
#include <limits>
#include <new>
#include <optional>
#include <stdexcept>

#include "server/error_codes.h"
#include "server/http/acceptor.h"
#include "server/http/chunk_framing.h"
#include "server/http/connection.h"
#include "server/http/exchange.h"
#include "server/http/hangup_watch.h"
#include "server/http/peer.h"
#include "server/services.h"

namespace relit::server {
namespace {

constexpr std::size_t copied_body_bytes = 64 << 10;  // up to here one send() for head and body

// What the library reads and writes instead of the socket: a head of our making with nothing in it
// but the method and the body's framing, so that no header of a client's reaches its parser; then
// the body.
class LibraryStream final : public httplib::Stream {
public:
    LibraryStream(Connection& connection, std::string head, bool chunked, const Limits& limits)
        : connection_(connection), head_(std::move(head)), chunked_(chunked), limits_(limits) {}

    ssize_t read(char* data, std::size_t size) override {
        if (head_read_ < head_.size()) {
            const auto count = head_.copy(data, size, head_read_);
            head_read_ += count;
            return ssize_t(count);
        }
        if (reply_begun_ || last_ != Connection::Got::data) return -1;
        const auto received = connection_.receive(data, size, pace_);
        last_ = received.got;
        if (last_ == Connection::Got::data && chunked_ && !chunks_.follow({data, received.size}))
            last_ = Connection::Got::failure;
        return last_ == Connection::Got::data ? ssize_t(received.size) : -1;
    }

    ssize_t write(const char* data, std::size_t size) override {
        const auto sent = connection_.send({data, size}, pace_);
        return sent > 0 || size == 0 ? ssize_t(sent) : -1;
    }

    /// From here on nothing is read: the library would look for the rest of a refused body.
    void begin_reply() {
        reply_begun_ = true;
        pace_ = Pace(limits_);
    }

    /// What has been sent says nothing of how fast the client is: the rest was not there yet.
    void begin_piece() { pace_ = Pace(limits_); }

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
    const bool chunked_;
    ChunkFraming chunks_;
    const Limits& limits_;
    Pace pace_{limits_};
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

// A request and its reply on their way through the library, which hands its callbacks nothing of
// ours; a connection is served by one thread from end to end.
struct Passage {
    Exchange& exchange;
    LibraryStream& stream;
};
thread_local Passage* current = nullptr;

// Adds one for as long as it lives.
class Counted {
public:
    explicit Counted(std::atomic<int>& count) : count_(count) { ++count_; }
    ~Counted() { --count_; }
    Counted(const Counted&) = delete;
    Counted& operator=(const Counted&) = delete;

private:
    std::atomic<int>& count_;
};

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

bool send_stream(const Reply& reply, const Passage& passage, httplib::DataSink& sink) {
    try {
        return reply.stream->send([&](std::string_view piece) {
            passage.stream.begin_piece();
            passage.exchange.outcome.body_bytes += piece.size();
            return piece.empty() || sink.write(piece.data(), piece.size());
        });
    } catch (const std::exception& error) {
        spdlog::error("a reply is broken off: {}", error.what());
        return false;
    }
}

// The library asks its providers for pieces; a stream writes all of them when it is first asked.
void give_stream_to_library(Reply reply, const Passage& passage, httplib::Response& response) {
    const Passage* const on_way = &passage;  // until the reply is sent
    const auto type = reply.content_type;
    const auto size = reply.stream->size_bytes;
    const auto held = std::make_shared<const Reply>(std::move(reply));
    const auto send_all = [held, on_way](std::size_t, httplib::DataSink& sink) {
        if (!send_stream(*held, *on_way, sink)) return false;
        sink.done();
        return true;
    };
    if (size) {
        response.set_content_provider(
            *size, type, [held, on_way](std::size_t, std::size_t, httplib::DataSink& sink) {
                return send_stream(*held, *on_way, sink);
            });
    } else if (passage.exchange.head.is_1_1) {
        response.set_chunked_content_provider(type, send_all);
    } else {  // HTTP/1.0 knows no chunks: the end of the connection is the end of the body
        passage.exchange.keep_open = false;
        response.set_content_provider(type, send_all);
    }
}

void give_to_library(Reply reply, const Passage& passage, httplib::Response& response) {
    response.status = reply.status;
    for (const auto& [name, value] : reply.headers) response.set_header(name, value);
    if (reply.stream) {
        give_stream_to_library(std::move(reply), passage, response);
        return;
    }
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
    }

    // --- callbacks of the library, in their order ---

    httplib::Server::HandlerResponse answer_without_body(httplib::Response& response) {
        Exchange& exchange = current->exchange;
        if (!exchange.refusal && exchange.head.has_body())
            return httplib::Server::HandlerResponse::Unhandled;
        give_to_library(answer(exchange), *current, response);
        return httplib::Server::HandlerResponse::Handled;
    }

    void answer_with_body(const httplib::ContentReader& reader, httplib::Response& response) {
        Exchange& exchange = current->exchange;
        std::optional<IncomingBody> body;  // counted until the reply is made
        try {
            body.emplace(exchange, body_bytes, limits);
            const bool whole = reader([&](const char* data, std::size_t size) {
                return body->add({data, size});
            });
            body->finish(whole, current->stream.last());
        } catch (const Error& error) {
            exchange.refusal = error;
        } catch (const std::bad_alloc&) {
            exchange.refusal.emplace(error_code::memory_full,
                                     "The server is out of memory for now.");
        }
        give_to_library(answer(exchange), *current, response);
    }

    Reply answer(Exchange& exchange) {
        Reply reply = exchange.refusal
                          ? refuse(router, exchange.request, *exchange.refusal, services)
                          : do_request(exchange);
        const bool may_stay = !exchange.refusal || (exchange.denied && !exchange.head.has_body());
        exchange.keep_open = may_stay && stays_open(exchange);
        exchange.note_made(reply);
        return reply;
    }

    Reply do_request(Exchange& exchange) {
        Request& request = exchange.request;
        const auto now = Exchange::Clock::now();
        if (exchange.head.has_body()) exchange.outcome.received = now - exchange.began;
        request.deadline = now + limits.render_timeout;
        Reply reply = dispatch(router, request, services);
        request.body = std::string();  // the reply may take long to send
        request.parts.clear();
        return reply;
    }

    [[nodiscard]] bool stays_open(const Exchange& exchange) const {
        return exchange.head.keep_alive && !services.draining && !acceptor.crowded() &&
               !exchange.is_probe;
    }

    // Corrects what the library adds to every head.
    void finish_head(httplib::Response& response) {
        const Exchange& exchange = current->exchange;
        current->stream.begin_reply();
        for (const char* name : {"Keep-Alive", "Connection", "Accept-Ranges"})
            response.headers.erase(name);
        if (response.status == 204 || response.status == 304)
            response.headers.erase("Content-Length");
        if (!exchange.keep_open) response.set_header("Connection", "close");
        else if (!exchange.head.is_1_1) response.set_header("Connection", "keep-alive");
        response.set_header("Date", http_date());
    }

    // Before the body is read: who may not ask costs nothing.
    void admit(Exchange& exchange) {
        Request& request = exchange.request;
        try {
            services.access.admit(router.scope_of(request.method, request.path), request);
        } catch (const Error& error) {
            exchange.refusal = error;
            exchange.denied = true;
        }
    }

    // --- connections ---

    void serve_connection(int socket) {
        Connection connection(socket, limits, services.metrics.traffic);
        const Counted open(services.metrics.connections);
        const auto watched = hangups.watch(socket);
        const std::string address = peer_address(socket);
        try {
            while (connection.wait_for_request(acceptor.give_way()))
                if (!serve_request(connection, address, watched.token())) break;
        } catch (const std::exception& error) {
            spdlog::error("connection given up: {}", error.what());
        }
    }

    // Health and readiness: they wait for nothing and are small, so that the thread that accepts
    // connections can answer them when no other is free.
    [[nodiscard]] bool is_probe(std::string_view sent) const {
        const HeadEnd end = find_head_end(sent);
        if (end.state != HeadEnd::complete || end.size != sent.size()) return false;
        try {
            const Head head = parse_head(sent, limits);
            return (head.method == "GET" || head.method == "HEAD") &&
                   router.answers_while_stopping(head.path) &&
                   router.scope_of("GET", head.path) == Scope::open;
        } catch (const Error&) {
            return false;
        }
    }

    void answer_probe(int socket) {
        Connection connection(socket, limits, services.metrics.traffic);
        try {
            (void)serve_request(connection, {}, {}, /*is_probe=*/true);
        } catch (const std::exception& error) {
            spdlog::error("connection given up: {}", error.what());
        }
    }

    // @return whether the connection stays open
    bool serve_request(Connection& connection, const std::string& address,
                       std::stop_token client_gone, bool is_probe = false) {
        const Counted busy(under_way);
        Exchange exchange;
        exchange.is_probe = is_probe;
        if (!receive_head(connection, router, limits, is_probe ? -1 : acceptor.give_way(), exchange))
            return false;
        if (!exchange.refusal && services.draining &&
            !router.answers_while_stopping(exchange.request.path))
            exchange.refusal.emplace(error_code::shutting_down,
                                     "The server is stopping and takes no more work.");
        exchange.request.id = request_id_of(exchange.request.headers);
        exchange.request.trace = trace_of_request(exchange.request.header("traceparent"));
        exchange.request.address = address;
        exchange.request.client_gone = std::move(client_gone);
        if (!exchange.refusal) admit(exchange);
        LibraryStream stream(connection, library_head(exchange), exchange.head.chunked, limits);
        Passage passage{exchange, stream};
        current = &passage;
        bool closed = false;
        const bool sent =
            library.process_request(stream, {}, 0, {}, 0, false, closed, nullptr, nullptr);
        current = nullptr;
        exchange.note_sent(sent, services.stopping);
        log_request(exchange.request, exchange.outcome, services.log_slow);
        if (sent && exchange.keep_open) return true;
        if (sent && !is_probe && (exchange.refusal || connection.has_more()))
            connection.close_lingering();
        return false;
    }

    const Router& router;
    Services& services;
    const Limits& limits;
    std::atomic<int> under_way{0};  // requests
    std::atomic<std::size_t> body_bytes{0};
    int listener = -1;
    Library library;
    HangupWatch hangups;
    Acceptor acceptor{limits,
                      services.metrics,
                      {.serve = [this](int socket) { serve_connection(socket); },
                       .is_probe = [this](std::string_view sent) { return is_probe(sent); },
                       .answer = [this](int socket) { answer_probe(socket); }}};
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
    impl_->acceptor.run(impl_->listener);
    ::close(
        std::exchange(impl_->listener, -1));  // from here on clients are refused, not left waiting
    impl_->acceptor.finish();
}

void Server::drain() { impl_->services.draining = true; }

int Server::requests_under_way() const { return impl_->under_way; }

void Server::stop() {
    drain();
    impl_->services.stopping = true;
    impl_->acceptor.stop();
}

void Server::cancel() { impl_->hangups.stop_all(/*and_close=*/false); }
void Server::cut() { impl_->hangups.stop_all(/*and_close=*/true); }

}  // namespace relit::server
