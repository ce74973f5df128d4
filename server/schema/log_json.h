// Lines of the log as JSON, and values as text can show them. Whatever bytes are in them, a line is
// one line of ASCII.
#pragma once

#include <chrono>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <variant>

namespace relit::server {

using LogValue = std::variant<std::string_view, std::int64_t, double, bool>;

/// One thing that a line says besides its message. What it refers to must outlive the line's writing.
struct LogField {
    std::string_view name;
    LogValue value;
    std::string_view group =
        {};  ///< in JSON it is in the object of this name; empty: in the line's own
};

/// {"time": RFC 3339 in UTC, "level", "message", fields in their order}, without a line's end. Times
/// have two decimals; bytes that are not UTF-8 become U+FFFD.
[[nodiscard]] std::string log_line_json(std::chrono::system_clock::time_point time,
                                        std::string_view level, std::string_view message,
                                        std::span<const LogField> fields);

/// As it stands in a line of text: as it is where that is a word of visible ASCII without quotes and
/// backslashes, or else as a JSON string.
[[nodiscard]] std::string log_value_text(const LogValue& value);

}  // namespace relit::server
