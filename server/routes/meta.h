// What the server says of itself.
#pragma once

#include "server/http/message.h"
#include "server/services.h"

namespace relit::server {

/// GET /healthz: the process answers. Waits for nothing, so that it answers when every slot is
/// taken.
Reply get_health(const Request& request, Services& services);

/// GET /readyz: whether to send requests here. As get_health(), but a problem while the server stops
/// and when images cannot be stored for good (a full disk is no such reason: renders go on).
/// @throws Error shutting_down, not_ready
Reply get_readiness(const Request& request, Services& services);

/// GET /metrics: what was done and what goes on, for Prometheus.
Reply get_metrics(const Request& request, Services& services);

/// GET /v1/version
Reply get_version(const Request& request, Services& services);

/// As in CMakeLists.txt, "0.1.0".
[[nodiscard]] std::string_view version();

}  // namespace relit::server
