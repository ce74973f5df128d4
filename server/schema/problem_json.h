// Problem documents (RFC 9457) as JSON.
#pragma once

#include <string>
#include <string_view>

namespace relit::server {

/// What a problem document says. `type` is made of the code: `/problems/<code>`.
struct Problem {
    std::string_view code;
    std::string_view title;
    int status = 500;
    std::string detail;
    std::string pointer;  ///< RFC 6901; left out where empty
};

/// The document. Bytes that are not UTF-8 become U+FFFD, so a problem can always be written.
[[nodiscard]] std::string problem_json(const Problem& problem);

/// The status of a document of our own. @pre problem_json() wrote it
[[nodiscard]] int problem_status(std::string_view document);

}  // namespace relit::server
