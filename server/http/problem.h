// Errors as replies: the table from error code to HTTP status, and the problem document (RFC 9457)
// that names the code. For dispatch(), which answers every exception here, for frames of batches, whose
// failure is told later, and for the OpenAPI document.
#pragma once

#include <span>
#include <string_view>

#include "server/error_codes.h"
#include "server/http/message.h"

namespace relit::server {

/// One kind of error. A client may rely on `code` and `status`.
struct ProblemKind {
    std::string_view code;
    int status;
    std::string_view title;
    int retry_after_s = 0;  ///< > 0: sent as Retry-After
};

/// All kinds, in the order of their status.
[[nodiscard]] std::span<const ProblemKind> problem_kinds();

/// The kind of a code; that of `internal` for a code that is not in the table.
[[nodiscard]] const ProblemKind& problem_kind(std::string_view code);

/// The reply that tells a client of an error: `application/problem+json`, never cached.
[[nodiscard]] Reply problem_reply(const Error& error);

}  // namespace relit::server
