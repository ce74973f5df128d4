// The codes of the server's own errors, beside those of core/base/error.h. Each is the last part of
// a problem type, `/problems/<code>`, and never changes its meaning; server/http/problem.cpp gives
// it status and title.
#pragma once

#include "core/base/error.h"

namespace relit::error_code {

// The request as HTTP.
inline constexpr std::string_view malformed_request = "malformed-request";
inline constexpr std::string_view not_found = "not-found";
inline constexpr std::string_view method_not_allowed = "method-not-allowed";
inline constexpr std::string_view request_timeout = "request-timeout";  ///< it arrived too slowly
inline constexpr std::string_view length_required = "length-required";
inline constexpr std::string_view body_too_large = "body-too-large";
inline constexpr std::string_view uri_too_long = "uri-too-long";
inline constexpr std::string_view unsupported_media_type = "unsupported-media-type";
inline constexpr std::string_view headers_too_large = "headers-too-large";
inline constexpr std::string_view version_not_supported = "http-version-not-supported";

// The client.
inline constexpr std::string_view unauthorized = "unauthorized";  ///< no key, or none we know
inline constexpr std::string_view forbidden = "forbidden";        ///< the key's scope is too small
inline constexpr std::string_view signature_refused = "signature-refused";
inline constexpr std::string_view rate_limited = "rate-limited";

// The request as JSON.
inline constexpr std::string_view malformed_json = "malformed-json";
inline constexpr std::string_view unknown_field = "unknown-field";
inline constexpr std::string_view missing_field = "missing-field";
inline constexpr std::string_view duplicate_field = "duplicate-field";

// The server at this moment.
inline constexpr std::string_view conflict = "conflict";      ///< not with what is there now
inline constexpr std::string_view superseded = "superseded";  ///< a newer request of the session
inline constexpr std::string_view key_reused = "idempotency-key-reused";
inline constexpr std::string_view queue_full = "queue-full";
inline constexpr std::string_view memory_full = "memory-full";
inline constexpr std::string_view timed_out = "timed-out";
inline constexpr std::string_view shutting_down = "shutting-down";
inline constexpr std::string_view not_ready = "not-ready";  ///< /readyz: somebody has to look
inline constexpr std::string_view storage_full = "storage-full";
inline constexpr std::string_view storage_failed = "storage-failed";
inline constexpr std::string_view batches_unavailable = "batches-unavailable";
inline constexpr std::string_view worker_lost = "worker-lost";  ///< a frame took its worker along
inline constexpr std::string_view too_costly = "too-costly";    ///< legal, but beyond a stated cost
inline constexpr std::string_view internal = "internal";

}  // namespace relit::error_code
