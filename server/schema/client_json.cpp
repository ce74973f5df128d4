#include "server/schema/client_json.h"

#include <nlohmann/json.hpp>

namespace relit::server {
namespace {

using OrderedJson = nlohmann::ordered_json;

std::string text_of(const OrderedJson& object, const char* name) {
    const auto found = object.find(name);
    return found != object.end() && found->is_string() ? found->get<std::string>() : "";
}

std::string lines(const OrderedJson& json) {
    return json.dump(2, ' ', false, OrderedJson::error_handler_t::replace);
}

}  // namespace

std::optional<ReceivedProblem> read_problem(std::string_view text) {
    const auto json = OrderedJson::parse(text, nullptr, /*allow_exceptions=*/false);
    if (!json.is_object()) return std::nullopt;
    const std::string type = text_of(json, "type");
    ReceivedProblem problem{type.substr(type.rfind('/') + 1), text_of(json, "detail"),
                            text_of(json, "pointer")};
    if (problem.detail.empty()) return std::nullopt;
    return problem;
}

std::string indented(std::string_view json) { return lines(OrderedJson::parse(json)); }

std::string file_info_json(std::span<const FileInfo> files) {
    auto list = OrderedJson::array();
    for (const FileInfo& file : files)
        list.push_back({{"file", file.file},
                        {"id", file.id},
                        {"width", file.image.width},
                        {"height", file.image.height},
                        {"channels", file.image.channels},
                        {"type", name_of(file.image.type)},
                        {"format", name_of(file.image.format)},
                        {"bytes", file.size_bytes},
                        {"heightRange", {file.heights.min, file.heights.max}},
                        {"notFinite", file.not_finite},
                        {"masked", file.masked}});
    return lines(list);
}

}  // namespace relit::server
