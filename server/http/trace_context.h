// W3C Trace Context, level 1 (https://www.w3.org/TR/trace-context-1/): which trace a request belongs to,
// so that the lines of the log can be found from those of the programs that called.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace relit::server {

struct TraceContext {
    std::string trace_id;   ///< 32 lower-case hex digits, not all 0
    std::string parent_id;  ///< of the caller's span, 16 such digits; empty: the trace begins here
    std::string span_id;    ///< of the request in this server, 16 such digits
    bool sampled = false;   ///< by the caller
};

/// What a header `traceparent` says. Of a version that is not known yet, what level 1 knows of it.
/// @return nothing where the header is not as the recommendation wants it
[[nodiscard]] std::optional<TraceContext> parse_traceparent(std::string_view header);

/// The trace of a request, a new one where `traceparent` is missing or not valid, with a new span.
[[nodiscard]] TraceContext trace_of_request(std::optional<std::string_view> traceparent);

/// The context as a header: version 00, with our span.
[[nodiscard]] std::string traceparent_text(const TraceContext& trace);

}  // namespace relit::server
