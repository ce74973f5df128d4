// The server's own process as its operating system sees it, under the names that Prometheus's
// clients give these numbers. For GET /metrics.
#pragma once

#include <vector>

#include "server/metrics.h"

namespace relit::server {

/// process_cpu_seconds_total, process_resident_memory_bytes and the like, read from /proc; what
/// cannot be read is left out.
[[nodiscard]] std::vector<PlainMetric> process_metrics();

}  // namespace relit::server
