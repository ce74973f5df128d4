#include "server/schema/client_json.h"

#include "server/schema/field_error.h"
#include "server/schema/strict_json.h"

namespace relit::server {
namespace {

using OrderedJson = nlohmann::ordered_json;

std::string text_of(const OrderedJson& object, const char* name) {
    const auto found = object.find(name);
    return found != object.end() && found->is_string() ? found->get<std::string>() : "";
}

OrderedJson parsed(std::string_view text) {
    return OrderedJson::parse(text, nullptr, /*allow_exceptions=*/false);
}

ReceivedProblem problem_of(const OrderedJson& json) {
    const std::string type = json.is_object() ? text_of(json, "type") : "";
    return {type.substr(type.rfind('/') + 1), json.is_object() ? text_of(json, "detail") : "",
            json.is_object() ? text_of(json, "pointer") : ""};
}

std::string lines(const OrderedJson& json) {
    return json.dump(2, ' ', false, OrderedJson::error_handler_t::replace);
}

}  // namespace

std::optional<ReceivedProblem> read_problem(std::string_view text) {
    const auto json = parsed(text);
    if (!json.is_object()) return std::nullopt;
    ReceivedProblem problem = problem_of(json);
    if (problem.detail.empty()) return std::nullopt;
    return problem;
}

BatchFrame read_manifest_line(std::string_view line) {
    Json json = parse_json(line);
    if (!json.is_object()) refuse_value("must be an object", "");
    BatchFrame frame;
    if (const auto name = json.find("name"); name != json.end()) {
        if (!name->is_string() || name->get_ref<const std::string&>().empty())
            refuse_value("must be a file's name", "/name");
        frame.name = name->get<std::string>();
        json.erase(name);
    }
    if (const auto scene = json.find("scene"); scene != json.end()) {
        if (json.size() > 1)
            refuse_value("must be alone or with 'name': it is a whole scene", "/scene");
        json = Json(*scene);
        if (!json.is_object()) refuse_value("must be an object", "/scene");
    }
    frame.scene = json.dump();
    return frame;
}

std::string scenes_request(std::span<const BatchFrame> frames) {
    auto scenes = Json::array();
    for (const BatchFrame& frame : frames) {
        Json scene = Json::parse(frame.scene);
        if (!frame.name.empty()) scene["name"] = frame.name;
        scenes.push_back(std::move(scene));
    }
    return Json{{"scenes", std::move(scenes)}}.dump();
}

std::optional<std::string> read_batch_id(std::string_view text) {
    const auto json = parsed(text);
    if (!json.is_object() || text_of(json, "id").empty()) return std::nullopt;
    return text_of(json, "id");
}

std::optional<int> read_max_batch_frames(std::string_view text) {
    const auto json = parsed(text);
    const OrderedJson::json_pointer field("/limits/maxBatchFrames");
    if (!json.is_object() || !json.contains(field)) return std::nullopt;
    const OrderedJson& limit = json[field];
    const bool fits = limit.is_number_integer() && limit >= 1 && limit <= 1'000'000;
    return fits ? std::optional(limit.get<int>()) : std::nullopt;
}

std::optional<std::vector<FailedFrame>> read_failed_frames(std::string_view text) {
    const auto json = parsed(text);
    const auto problems = json.is_object() ? json.find("problems") : json.end();
    if (!json.is_object() || problems == json.end() || !problems->is_array()) return std::nullopt;
    std::vector<FailedFrame> frames;
    for (const OrderedJson& one : *problems)
        if (one.is_object() && one.contains("problem") &&
            one.value("frame", OrderedJson()).is_number_integer())
            frames.push_back({one["frame"].get<int>(), problem_of(one["problem"])});
    return frames;
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
