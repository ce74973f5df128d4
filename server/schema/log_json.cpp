#include "server/schema/log_json.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "server/schema/time_text.h"

namespace relit::server {
namespace {

using OrderedJson = nlohmann::ordered_json;

// Escaped beyond ASCII: a terminal takes some of those characters for orders.
std::string dumped(const OrderedJson& json) {
    return json.dump(-1, ' ', /*ensure_ascii=*/true, OrderedJson::error_handler_t::replace);
}

OrderedJson json_of(const LogValue& value) {
    if (const auto* number = std::get_if<double>(&value)) return std::round(*number * 100) / 100;
    return std::visit([](const auto& it) { return OrderedJson(it); }, value);
}

bool is_plain(std::string_view text) {
    return !text.empty() && std::all_of(text.begin(), text.end(), [](char c) {
        return c > ' ' && c < 0x7f && c != '"' && c != '\\';
    });
}

}  // namespace

std::string log_line_json(std::chrono::system_clock::time_point time, std::string_view level,
                          std::string_view message, std::span<const LogField> fields) {
    OrderedJson line = {{"time", time_text(time)}, {"level", level}, {"message", message}};
    for (const LogField& field : fields) {
        OrderedJson& place = field.group.empty() ? line : line[std::string(field.group)];
        place[std::string(field.name)] = json_of(field.value);
    }
    return dumped(line);
}

std::string log_value_text(const LogValue& value) {
    if (const auto* text = std::get_if<std::string_view>(&value))
        return is_plain(*text) ? std::string(*text) : dumped(OrderedJson(*text));
    if (const auto* number = std::get_if<double>(&value)) return fmt::format("{:.2f}", *number);
    return dumped(json_of(value));
}

}  // namespace relit::server
