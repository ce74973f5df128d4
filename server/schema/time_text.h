// Times as the interface writes them.
#pragma once

#include <chrono>
#include <string>

namespace relit::server {

/// RFC 3339 in UTC, always with three digits of the second.
[[nodiscard]] std::string time_text(std::chrono::sys_time<std::chrono::nanoseconds> time);

}  // namespace relit::server
