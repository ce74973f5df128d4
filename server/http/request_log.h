// The line of the log about a request, written when its reply is sent or has failed to be.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>

#include "server/http/message.h"

namespace relit::server {

/// How a request ended.
struct RequestOutcome {
    int status = 0;
    std::string_view error_code = {};
    std::uint64_t body_bytes = 0;  ///< of the reply
    bool streamed = false;         ///< made while it was sent
    bool disconnected = false;     ///< the client was gone before its end
    std::chrono::duration<double, std::milli>
        received{};  ///< from its head to its body; 0: it has none
    std::chrono::duration<double, std::milli> made{};   ///< from its head to its reply
    std::chrono::duration<double, std::milli> total{};  ///< to the reply's last byte
};

/// Logs it at the level info, or as slow at the level warning.
/// @param slow  from how long on it is slow (of a stream, until the stream began); 0: it never is
void log_request(const Request& request, const RequestOutcome& outcome,
                 std::chrono::milliseconds slow);

/// What clients call a request: `X-Request-Id` where that is 1 to 128 letters, digits and characters
/// of "-_.:+/=@~", or else a name that is different for each within and between runs of the server.
[[nodiscard]] std::string request_id_of(const Headers& headers);

}  // namespace relit::server
