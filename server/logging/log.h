// The log: a line for whoever runs the server, as text or as JSON, on stderr. What has nothing but a
// message goes through spdlog's own functions; what has fields, through log_event().
#pragma once

#include <spdlog/common.h>

#include <span>
#include <string_view>

#include "server/schema/log_json.h"

namespace relit::server {

enum class LogFormat { text, json };

/// Makes spdlog's default logger one that writes to a descriptor, in the background (line_writer.h).
/// @param level  the least that is logged
void start_log(LogFormat format, spdlog::level::level_enum level, int descriptor = 2);

/// A line with more than its message: "message name=value name=value", or JSON's members.
void log_event(spdlog::level::level_enum level, std::string_view message,
               std::span<const LogField> fields);

}  // namespace relit::server
