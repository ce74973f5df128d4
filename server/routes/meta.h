// What the server says of itself.
#pragma once

#include "server/http/message.h"
#include "server/services.h"

namespace relit::server {

/// GET /healthz: the process answers. Waits for nothing, so that it answers when every slot is
/// taken.
Reply get_health(const Request& request, Services& services);

/// GET /v1/version
Reply get_version(const Request& request, Services& services);

/// As in CMakeLists.txt, "0.1.0".
[[nodiscard]] std::string_view version();

}  // namespace relit::server
