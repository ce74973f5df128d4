// Request and Reply as plain data: what handlers see of HTTP. The transport fills and sends them;
// tests build them by hand and call a handler without a socket.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/access/rate_limit.h"
#include "server/http/spans.h"
#include "server/http/trace_context.h"
#include "server/shared_bytes.h"

namespace relit::server {

/// Header names compare without regard to case (RFC 9110, 5.1).
struct HeaderLess {
    using is_transparent = void;
    bool operator()(std::string_view a, std::string_view b) const;
};
using Headers = std::map<std::string, std::string, HeaderLess>;

/// One part of a multipart/form-data body (RFC 7578).
struct Part {
    std::string name;
    std::string filename;      ///< empty: not a file
    std::string content_type;  ///< empty: not said
    std::string content;
};

/// What was found when the request was let in; see server/access/access.h.
struct Admission {
    std::string key;  ///< the name of the client's key; empty: none was asked for, or none was good
    std::optional<std::int64_t> signed_for_s;  ///< for how long its signed URL is still good
    std::optional<RateState> rate;             ///< of the client; nothing where it is not counted
};

struct Request {
    std::string method;        ///< upper case; HEAD arrives as GET with `head` set
    bool head = false;         ///< the reply's body will not be sent
    std::string path;          ///< percent-decoded UTF-8, without the query
    std::string target;        ///< path and query as they were sent
    std::string address = {};  ///< of the client; see peer.h
    Admission admission = {};
    std::multimap<std::string, std::string> query;   ///< decoded
    Headers headers;                                 ///< repeated ones joined by ", "
    std::string body;                                ///< empty where `parts` is filled
    std::vector<Part> parts;                         ///< of a multipart/form-data body, in order
    std::map<std::string, std::string> path_params;  ///< filled by the route that matched
    std::string id;                                  ///< names the request in log and reply
    TraceContext trace = {};                         ///< the same, over several programs
    mutable Spans spans = {};     ///< of what has been done for it; handlers add theirs
    std::stop_token client_gone;  ///< set when the client closes its connection or the server stops
    /// When the client is to have its answer at the latest.
    std::chrono::steady_clock::time_point deadline = std::chrono::steady_clock::time_point::max();

    [[nodiscard]] bool is_get() const { return method == "GET"; }
    [[nodiscard]] std::optional<std::string> header(std::string_view name) const;
    [[nodiscard]] std::optional<std::string> query_value(const std::string& name) const;
};

/// A body that is made while it is sent.
struct BodyStream {
    /// Sends a piece. @return false: nobody listens any more, or not fast enough
    using Write = std::function<bool(std::string_view)>;

    std::optional<std::uint64_t> size_bytes;  ///< sent as Content-Length; none: known at its end
    /// Writes all of it; called once, on the connection's thread, or not at all (HEAD). What it holds
    /// is let go of with the reply.
    /// @return false, or throws, where the body is not whole: the connection is broken off
    std::function<bool(const Write&)> send;
};

struct Reply {
    int status = 200;
    std::string content_type;
    std::string body;
    SharedBytes shared;                ///< sent instead of `body` where that is empty
    std::optional<BodyStream> stream;  ///< sent instead of both
    Headers headers;                   ///< besides Content-Type and Content-Length
    std::string_view error_code = {};  ///< of a problem document, for log and metrics
    std::string_view limit = {};       ///< the setting behind it, for metrics; empty: none

    [[nodiscard]] std::string_view bytes() const { return body.empty() ? shared.bytes : body; }
};

/// Does If-None-Match name `etag` (RFC 9110, 13.1.2; weak comparison, `*` names every one)?
[[nodiscard]] bool has_etag(const Request& request, std::string_view etag);

/// 304 with the headers that a cache wants to see again.
[[nodiscard]] Reply not_modified(std::string_view etag, std::string_view cache_control);

}  // namespace relit::server
