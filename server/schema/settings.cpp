#include "server/schema/settings.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <optional>
#include <set>

#include "server/error_codes.h"
#include "server/schema/field_error.h"
#include "server/schema/strict_json.h"
#include "server/text.h"

namespace relit::server {
namespace {

constexpr std::size_t max_segments = 16;

std::vector<std::string> split(std::string_view text, char separator) {
    std::vector<std::string> pieces;
    for (;;) {
        const auto end = text.find(separator);
        pieces.emplace_back(text.substr(0, end));
        if (end == std::string_view::npos) return pieces;
        text.remove_prefix(end + 1);
    }
}

std::string pointer_of(const std::vector<std::string>& segments) {
    std::string pointer;
    for (const std::string& segment : segments) pointer += '/' + pointer_token(segment);
    return pointer;
}

// ".5" and "5." are numbers to people, if not to JSON; "inf" and "nan" are to neither.
std::optional<double> number_from(std::string_view text) {
    if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
    if (text.empty() || text.find_first_not_of("0123456789.eE+-") != std::string_view::npos)
        return std::nullopt;
    return parse_number<double>(text);
}

// Ids of 64 digits look like numbers, and files may be called null.
bool holds_text(const std::string& field) {
    constexpr std::string_view fields[] = {"image", "data", "part", "type"};
    return std::find(std::begin(fields), std::end(fields), field) != std::end(fields);
}

Json json_from(const std::string& text, const std::string& pointer) {
    try {
        return parse_json(text);
    } catch (const Error& e) {
        throw Error(e.code, field_name(pointer) + ": " + e.what(), pointer, e.limit);
    }
}

Json list_from(const std::string& text, const std::string& pointer) {
    Json list = Json::array();
    for (const std::string& piece : split(text, ',')) {
        const auto number = number_from(piece);
        if (!number) refuse_value("must be numbers with commas between", pointer);
        list.push_back(*number);
    }
    return list;
}

Json value_from(const std::string& text, const std::vector<std::string>& path) {
    if (holds_text(path.back())) return text;
    if (const auto number = number_from(text)) return *number;
    if (text == "true") return true;
    if (text == "false") return false;
    if (text == "null") return nullptr;
    if (text.starts_with('[') || text.starts_with('{') || text.starts_with('"'))
        return json_from(text, pointer_of(path));
    if (text.find(',') != std::string::npos) return list_from(text, pointer_of(path));
    return text;
}

bool is_index(const std::string& segment) {
    return !segment.empty() && segment.size() < 6 && (segment == "0" || segment[0] != '0') &&
           segment.find_first_not_of("0123456789") == std::string::npos;
}

// The place below `parent`, made where it is not there yet.
Json& child_of(Json& parent, const std::string& segment, const std::string& pointer) {
    if (parent.is_null()) parent = is_index(segment) ? Json::array() : Json::object();
    if (parent.is_object()) return parent[segment];
    if (!parent.is_array() || !is_index(segment))
        refuse_value("is below a field that is no object", pointer);
    const auto index = std::size_t(std::stoi(segment));
    if (index > parent.size())
        refuse_value(fmt::format("skips entries of a list of {}", parent.size()), pointer);
    if (index == parent.size()) parent.push_back(nullptr);
    return parent[index];
}

// Entries of lists after each other, "2" before "10".
bool segment_before(const std::string& a, const std::string& b) {
    if (is_index(a) && is_index(b)) return std::stoi(a) < std::stoi(b);
    return a < b;
}

bool path_before(const Setting& a, const Setting& b) {
    const auto left = split(a.path, '.');
    const auto right = split(b.path, '.');
    return std::lexicographical_compare(left.begin(), left.end(), right.begin(), right.end(),
                                        segment_before);
}

void lay_over(Json& scene, const Setting& setting) {
    const std::vector<std::string> path = split(setting.path, '.');
    if (path.size() > max_segments)
        throw Error(error_code::unknown_field, "a path of so many segments names no field");
    Json* place = &scene;
    std::vector<std::string> so_far;
    for (const std::string& segment : path) {
        so_far.push_back(segment);
        place = &child_of(*place, segment, pointer_of(so_far));
    }
    *place = value_from(setting.value, path);
}

// Short forms of a light.

Json point_light(const std::string& value) {
    return {{"type", "point"}, {"position", list_from(value, "/light")}};
}

Json directional_light(const std::string& value) {
    const Json angles = list_from(value, "/sun");
    if (angles.size() != 2) refuse_value("must be azimuth,elevation: 2 numbers", "/sun");
    return {{"type", "directional"}, {"azimuth", angles[0]}, {"elevation", angles[1]}};
}

Json environment_light(const std::string& value) {
    const auto comma = value.find(',');
    Json light = {{"type", "environment"}, {"image", {{"image", value.substr(0, comma)}}}};
    if (comma == std::string::npos) return light;
    Json turn = list_from(value.substr(comma + 1), "/env");
    if (turn.size() > 2) refuse_value("must be id,yaw,pitch: an image's id and 2 numbers", "/env");
    if (turn.size() == 1) turn.push_back(0);
    light["rotation"] = std::move(turn);
    return light;
}

std::optional<Json> short_light(const Setting& setting) {
    if (setting.path == "light" && !setting.value.starts_with('{'))
        return point_light(setting.value);
    if (setting.path == "sun") return directional_light(setting.value);
    if (setting.path == "env") return environment_light(setting.value);
    return std::nullopt;
}

// What else the scene says of a light of the same type stays: its colour, its intensity.
void lay_light_over(Json& scene, const Json& light) {
    scene.erase("lights");
    Json& old = scene["light"];
    if (!old.is_object() || !old.contains("type") || old["type"] != light["type"]) old = light;
    else old.update(light);
    if (light.contains("azimuth")) old.erase("direction");
}

// A field that is there twice: by itself, or as a part of one that is given whole.
void check_paths(const std::vector<Setting>& settings) {
    std::set<std::string> paths;
    for (const Setting& setting : settings) {
        const std::string pointer = pointer_of(split(setting.path, '.'));
        if (!paths.insert(pointer).second)
            throw Error(error_code::duplicate_field, field_name(pointer) + " is there twice",
                        pointer);
    }
    for (const Setting& setting : settings) {
        if (short_light(setting)) continue;  // a light may have further fields
        const std::string pointer = pointer_of(split(setting.path, '.'));
        const auto below = paths.upper_bound(pointer + '/');
        if (below != paths.end() && below->starts_with(pointer + '/'))
            throw Error(error_code::duplicate_field,
                        field_name(*below) + " is there twice: '" + setting.path + "' has it too",
                        *below);
    }
}

}  // namespace

std::string with_settings(std::string_view scene_json, const std::vector<Setting>& settings) {
    Json scene = parse_json(scene_json);
    if (!scene.is_object()) refuse_value("must be an object", "");
    check_paths(settings);
    std::vector<Setting> rest;
    std::string light_path;
    for (const Setting& setting : settings) {
        const auto light = short_light(setting);
        if (!light) {
            rest.push_back(setting);
            continue;
        }
        if (!light_path.empty())
            refuse_value(fmt::format("and '{}' exclude each other", light_path),
                         "/" + setting.path);
        light_path = setting.path;
        lay_light_over(scene, *light);
    }
    std::sort(rest.begin(), rest.end(), path_before);
    for (const Setting& setting : rest) lay_over(scene, setting);
    return scene.dump(-1, ' ', /*ensure_ascii=*/true, Json::error_handler_t::replace);
}

}  // namespace relit::server
