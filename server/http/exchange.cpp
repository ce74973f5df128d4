#include "server/http/exchange.h"

#include <algorithm>
#include <utility>

#include "server/error_codes.h"
#include "server/http/multipart.h"

namespace relit::server {
namespace {

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
    request.target = std::move(head.target);
    request.query = std::move(head.query);
    request.headers = std::move(head.headers);
}

Error too_large(const Route& route) {
    if (route.max_body_bytes == 0)
        return {error_code::body_too_large, "A request to this path has no body."};
    return {error_code::body_too_large,
            "The body is larger than " + std::string(route.limit_name) + ", " +
                std::to_string(route.max_body_bytes) + " bytes.",
            {},
            route.limit_name};
}

Error interrupted(Connection::Got last) {
    if (last == Connection::Got::timeout)
        return {error_code::request_timeout, "The body arrived too slowly."};
    return {error_code::malformed_request, "The body is incomplete or its chunks are broken."};
}

// Refuses before the body is read what would be refused after.
void judge_body(const Router& router, Exchange& exchange) {
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

}  // namespace

void Exchange::note_made(const Reply& reply) {
    outcome.status = reply.status;
    outcome.error_code = reply.error_code;
    outcome.streamed = reply.stream.has_value();
    if (!request.head && !reply.stream) outcome.body_bytes = reply.bytes().size();
    outcome.made = Clock::now() - began;
}

void Exchange::note_sent(bool whole, bool stopping) {
    const bool abandoned = outcome.error_code == error_code::cancelled && !stopping;
    outcome.disconnected = !whole || abandoned;
    outcome.total = Clock::now() - began;
}

bool receive_head(Connection& connection, const Router& router, const Limits& limits, int give_way,
                  Exchange& exchange) {
    const auto received = connection.receive_head(give_way);
    if (received.got == Connection::Got::end || received.got == Connection::Got::failure)
        return false;
    exchange.began = Exchange::Clock::now();
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
    if (exchange.head.may_have_body()) judge_body(router, exchange);
    return true;
}

IncomingBody::IncomingBody(Exchange& exchange, std::atomic<std::size_t>& under_way,
                           const Limits& limits)
    : exchange_(exchange), under_way_(under_way), limits_(limits) {
    body_.reserve(exchange.head.content_length.value_or(0));
}

bool IncomingBody::add(std::string_view piece) {
    if (body_.size() + piece.size() > exchange_.route->max_body_bytes) {
        error_ = too_large(*exchange_.route);
        return false;
    }
    counted_ += piece.size();
    if (under_way_.fetch_add(piece.size()) + piece.size() > limits_.max_body_memory_bytes) {
        error_.emplace(error_code::memory_full, "The bodies under way fill max-body-memory.", "",
                       "max-body-memory");
        return false;
    }
    body_.append(piece);
    return true;
}

void IncomingBody::finish(bool whole, Connection::Got last) {
    if (error_) throw Error(*error_);
    if (!whole) throw interrupted(last);
    const auto type = exchange_.request.header("Content-Type").value_or("");
    if (is_multipart(type)) {
        exchange_.request.parts = parse_multipart(std::move(body_), type, limits_);
    } else {
        exchange_.request.body = std::move(body_);
    }
}

}  // namespace relit::server
