// Failure as a value that reaches the client: a stable code, a sentence for people, the field to
// blame. For everything that reads data from outside (decode, parse, store, queue); kernels do not
// fail. The server turns codes into HTTP status and problem documents (RFC 9457); a command line
// prints the sentence.
#pragma once

#include <stdexcept>
#include <string>
#include <string_view>

namespace relit {

/// What went wrong with data from outside, in words meant for whoever sent it.
///
/// `code` is a stable slug in kebab-case (constants below and in server/http/problem.h).
/// `what()` is the sentence: it names the field or the limit, never a path or an internal.
/// `pointer` is an RFC 6901 pointer into the JSON that was sent, or empty.
/// `limit` is the setting behind a refusal, as "max-image-pixels", or empty: it is counted by it.
class Error : public std::runtime_error {
public:
    Error(std::string_view error_code, const std::string& detail, std::string json_pointer = {},
          std::string_view limit_name = {})
        : std::runtime_error(detail),
          code(error_code),
          pointer(std::move(json_pointer)),
          limit(limit_name) {}

    std::string_view code;  ///< refers to a constant, never to a temporary
    std::string pointer;
    std::string_view limit;  ///< refers to a constant too
};

namespace error_code {
inline constexpr std::string_view image_not_supported = "image-not-supported";  ///< format unknown
inline constexpr std::string_view image_broken = "image-broken";  ///< truncated, corrupt, lying
inline constexpr std::string_view image_too_large = "image-too-large";  ///< over a stated limit
inline constexpr std::string_view invalid_value = "invalid-value";  ///< a field's value is refused
inline constexpr std::string_view cancelled = "cancelled";          ///< the stop token was set
}  // namespace error_code

}  // namespace relit
