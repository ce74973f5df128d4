// The transport: TCP connections, HTTP/1.1, threads. Built on cpp-httplib, which server.cpp alone
// includes; between it and the network stands our own strict reading of heads (head.h). Handlers
// see none of this.
#pragma once

#include <memory>
#include <string>

#include "server/http/router.h"
#include "server/limits.h"

namespace relit::server {

class Server {
public:
    /// All three must outlive the server.
    Server(const Router& router, Services& services, const Limits& limits);
    ~Server();
    Server(const Server&) = delete;
    Server& operator=(const Server&) = delete;

    /// Takes the address; clients may connect from here on, and are served by serve().
    ///
    /// @param port  0: any free one
    /// @return      the port taken
    /// @throws std::runtime_error with a sentence for the operator: in use, no permission, no such
    ///         address
    int bind(const std::string& host, int port);

    /// Serves until stop(), then finishes the requests under way. Call it once, after bind().
    void serve();

    /// Takes no more work: what begins from here on is answered 503, but for the paths that are
    /// answered while stopping; what has begun is finished. From any thread, at any time.
    void drain();

    /// Requests between the first byte of their head and the last of their reply.
    [[nodiscard]] int requests_under_way() const;

    /// Takes no more connections; idle ones are closed, the others after their reply. From any
    /// thread, at any time.
    void stop();

    /// Sets `client_gone` of every request under way, so that handlers give up and answer 503.
    void cancel();

    /// Closes every connection, whatever it does.
    void cut();

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace relit::server
