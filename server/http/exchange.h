// One request on its way from a connection to a handler: its head received and judged, its body
// counted. What can be refused is refused here, before memory is given to it. For the transport.
#pragma once

#include <atomic>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "core/base/error.h"
#include "server/http/connection.h"
#include "server/http/head.h"
#include "server/http/request_log.h"
#include "server/http/router.h"
#include "server/limits.h"

namespace relit::server {

struct Exchange {
    using Clock = std::chrono::steady_clock;

    Head head;
    Request request;
    Clock::time_point began = Clock::now();  ///< its head was there
    RequestOutcome outcome;
    const Route* route = nullptr;  ///< of a request with a body
    std::optional<Error> refusal;  ///< answered without reading further, then the connection is closed
    bool is_probe = false;   ///< answered by the thread that accepts: no second request follows
    bool denied = false;     ///< the refusal is about who asks: nothing is wrong with the request
    bool keep_open = false;  ///< the connection, after the reply

    /// What the log says of a reply that is about to be sent.
    void note_made(const Reply& reply);
    /// And when it is, or never will be.
    /// @param whole  whether it went to its end
    void note_sent(bool whole, bool stopping);
};

/// Receives a head into `exchange` and judges by it what the body may be; what is wrong with it is
/// left in `refusal`.
/// @param give_way  see Connection::receive_head()
/// @return false where there is nobody to answer
[[nodiscard]] bool receive_head(Connection& connection, const Router& router, const Limits& limits,
                                int give_way, Exchange& exchange);

/// The body of a request as it arrives; it becomes the request's when it is whole. Its bytes are
/// counted together with those of all bodies under way until it is destroyed.
class IncomingBody {
public:
    /// @param under_way  the bytes of all bodies
    IncomingBody(Exchange& exchange, std::atomic<std::size_t>& under_way, const Limits& limits);
    ~IncomingBody() { under_way_ -= counted_; }
    IncomingBody(const IncomingBody&) = delete;
    IncomingBody& operator=(const IncomingBody&) = delete;

    /// @return false when it is too much: the rest is not to be read
    [[nodiscard]] bool add(std::string_view piece);

    /// Gives the body, or its parts where it is a form, to the request.
    /// @param whole  whether it came to its end
    /// @param last   how reading ended where it did not
    /// @throws Error body_too_large, memory_full, request_timeout, malformed_request
    void finish(bool whole, Connection::Got last);

private:
    Exchange& exchange_;
    std::atomic<std::size_t>& under_way_;
    const Limits& limits_;
    std::size_t counted_ = 0;
    std::string body_;
    std::optional<Error> error_;
};

}  // namespace relit::server
