#include "server/http/problem.h"

#include <algorithm>
#include <iterator>

#include "server/schema/problem_json.h"

namespace relit::server {
namespace {

// A full disk is 507 and not 503: trying again does not help until someone makes room, and a
// balancer that takes 503 for a sick server would stop sending renders, which need no room.
constexpr ProblemKind kinds[] = {
    {error_code::malformed_request, 400, "The request cannot be understood"},
    {error_code::malformed_json, 400, "The JSON cannot be read"},
    {error_code::unauthorized, 401, "An API key is needed"},
    {error_code::forbidden, 403, "The API key does not allow this"},
    {error_code::signature_refused, 403, "The signed URL is not good"},
    {error_code::not_found, 404, "There is no such thing"},
    {error_code::method_not_allowed, 405, "The method does not apply here"},
    {error_code::request_timeout, 408, "The request took too long to arrive"},
    {error_code::conflict, 409, "Not possible now"},
    {error_code::superseded, 409, "A newer request took its place"},
    {error_code::length_required, 411, "The length of the body is missing"},
    {error_code::body_too_large, 413, "The body is too large"},
    {error_code::image_too_large, 413, "The image is too large"},
    {error_code::uri_too_long, 414, "The address is too long"},
    {error_code::image_not_supported, 415, "The image's format is not supported"},
    {error_code::unsupported_media_type, 415, "The body's type is not supported"},
    {error_code::image_broken, 422, "The image is broken"},
    {error_code::unknown_field, 422, "There is no such field"},
    {error_code::invalid_value, 422, "A value is refused"},
    {error_code::missing_field, 422, "A field is missing"},
    {error_code::duplicate_field, 422, "A field is there twice"},
    {error_code::key_reused, 422, "The idempotency key is taken"},
    {error_code::too_costly, 422, "It would cost too much"},
    {error_code::rate_limited, 429, "Too many requests", 1},
    {error_code::headers_too_large, 431, "The headers are too large"},
    {error_code::internal, 500, "The server failed"},
    {error_code::storage_failed, 500, "The server could not reach its storage"},
    {error_code::worker_lost, 500, "Rendering it ended the program"},
    {error_code::batches_unavailable, 503, "Batches cannot be reached", 5},
    {error_code::queue_full, 503, "Too many requests are waiting", 1},
    {error_code::memory_full, 503, "Too many bodies are arriving", 2},
    {error_code::shutting_down, 503, "The server is stopping", 5},
    {error_code::not_ready, 503, "The server is not ready"},
    {error_code::cancelled, 503, "The request was abandoned"},
    {error_code::timed_out, 504, "The answer would come too late"},
    {error_code::version_not_supported, 505, "This version of HTTP is not supported"},
    {error_code::storage_full, 507, "The server's storage is full"},
};

}  // namespace

std::span<const ProblemKind> problem_kinds() { return kinds; }

const ProblemKind& problem_kind(std::string_view code) {
    const auto with = [](std::string_view wanted) {
        return std::find_if(std::begin(kinds), std::end(kinds),
                            [&](const ProblemKind& kind) { return kind.code == wanted; });
    };
    const auto found = with(code);
    return found == std::end(kinds) ? *with(error_code::internal) : *found;
}

namespace {

// Errors are worded as parts of a log line or a longer message; here they stand alone.
std::string as_sentence(std::string words) {
    if (words.empty()) return words;
    if (words.front() >= 'a' && words.front() <= 'z') words.front() = char(words.front() - 32);
    if (words.back() != '.') words += '.';
    return words;
}

}  // namespace

Reply problem_reply(const Error& error) {
    const ProblemKind& kind = problem_kind(error.code);
    Reply reply;
    reply.status = kind.status;
    reply.content_type = "application/problem+json";
    reply.error_code = kind.code;
    reply.limit = error.limit;
    reply.body = problem_json({.code = kind.code,
                               .title = kind.title,
                               .status = kind.status,
                               .detail = as_sentence(error.what()),
                               .pointer = error.pointer});
    reply.headers.emplace("Cache-Control", "no-store");
    if (kind.retry_after_s > 0)
        reply.headers.emplace("Retry-After", std::to_string(kind.retry_after_s));
    return reply;
}

}  // namespace relit::server
