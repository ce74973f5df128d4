// What handlers answer that may change: JSON that is asked for again each time.
#pragma once

#include <string>
#include <utility>

#include "server/http/message.h"

namespace relit::server {

[[nodiscard]] inline Reply json_reply(std::string json, int status = 200) {
    Reply reply{.status = status, .content_type = "application/json", .body = std::move(json)};
    reply.headers.emplace("Cache-Control", "no-cache");
    return reply;
}

}  // namespace relit::server
