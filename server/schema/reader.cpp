#include "server/schema/reader.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>

#include "server/error_codes.h"
#include "server/text.h"

namespace relit::server {
namespace {

std::string words(Range range) {
    return range.lo_excluded ? fmt::format("above {} and at most {}", range.lo, range.hi)
                             : fmt::format("from {} to {}", range.lo, range.hi);
}

bool is_number_in(const Json& json, Range range) {
    if (!json.is_number()) return false;
    const double number = json.get<double>();
    return (range.lo_excluded ? number > range.lo : number >= range.lo) && number <= range.hi;
}

// The numbers of an array of exactly `count`; -0 becomes 0, so that it is written as what it means.
std::vector<double> numbers(const Json& json, std::size_t count, Range range, std::string_view what,
                            const std::string& pointer) {
    if (!json.is_array() || json.size() != count)
        refuse_value(fmt::format("must be {}: {} numbers", what, count), pointer);
    std::vector<double> result;
    for (std::size_t i = 0; i < count; ++i) {
        double number = 0;
        read(json[i], number, range, fmt::format("{}/{}", pointer, i));
        result.push_back(number);
    }
    return result;
}

template <class T>
void read_or_null(const Json& json, std::optional<T>& value, const auto& rule,
                  const std::string& pointer) {
    value.reset();
    if (!json.is_null()) read(json, value.emplace(), rule, pointer);
}

std::optional<Colour> colour_from_hex(const std::string& text) {
    if (text.size() != 7 || text[0] != '#') return std::nullopt;
    int bytes[3];
    for (int c = 0; c < 3; ++c) {
        const int high = hex_digit(text[1 + 2 * c]);
        const int low = hex_digit(text[2 + 2 * c]);
        if (high < 0 || low < 0) return std::nullopt;
        bytes[c] = 16 * high + low;
    }
    return hex_colour(bytes[0], bytes[1], bytes[2]);
}

template <class Light>
Light light_from(const Json& json, const std::string& pointer) {
    Light light;
    Reader reader(json, pointer);
    reader.take("type");
    fields(reader, light);
    reader.finish();
    return light;
}

DirectionalLight directional_light_from(const Json& json, const std::string& pointer) {
    const auto light = light_from<DirectionalLight>(json, pointer);
    if (!light.direction) return light;
    const auto has = [&](const char* name) {
        return json.contains(name) && !json[name].is_discarded();
    };
    if (has("azimuth") || has("elevation"))
        refuse_value("stands in place of azimuth and elevation: give the one or the others",
                     pointer + "/direction");
    if (*light.direction == Vec3{}) refuse_value("must not be of length 0", pointer + "/direction");
    return light;
}

}  // namespace

std::string listed(const std::vector<std::string_view>& words, std::string_view last) {
    std::string list;
    for (std::size_t i = 0; i < words.size(); ++i) {
        if (i > 0) list += i + 1 == words.size() ? fmt::format(" {} ", last) : ", ";
        list += fmt::format("'{}'", words[i]);
    }
    return list;
}

Reader::Reader(const Json& json, std::string pointer) : json_(json), pointer_(std::move(pointer)) {
    if (!json.is_object()) refuse_value("must be an object", pointer_);
}

const Json* Reader::take(std::string_view name) {
    known_.push_back(name);
    const auto found = json_.find(name);
    return found == json_.end() || found->is_discarded() ? nullptr : &*found;
}

std::string Reader::pointer_to(std::string_view name) const {
    return pointer_ + "/" + pointer_token(name);
}

void Reader::finish() const {
    for (const auto& item : json_.items())
        if (std::find(known_.begin(), known_.end(), item.key()) == known_.end())
            throw Error(error_code::unknown_field,
                        field_name(pointer_to(item.key())) + " is no field; there are " +
                            listed(known_, "and"),
                        pointer_to(item.key()));
}

void Reader::lights(std::string_view one, std::string_view several,
                    std::vector<LightDescription>& lights, std::string_view) {
    const Json* single = take(one);
    const Json* list = take(several);
    if (single && list) refuse_value("and 'light' exclude each other", pointer_to(several));
    if (single) read(*single, lights.front(), pointer_to(one));
    if (!list) return;
    const std::string pointer = pointer_to(several);
    if (!list->is_array() || list->empty())
        refuse_value("must be a list of at least one light", pointer);
    if (list->size() > std::size_t(max_lights))
        refuse_value(
            fmt::format("has {} lights; the limit is {} (max-lights)", list->size(), max_lights),
            pointer, "max-lights");
    lights.assign(list->size(), {});
    for (std::size_t i = 0; i < list->size(); ++i)
        read((*list)[i], lights[i], fmt::format("{}/{}", pointer, i));
}

void read(const Json& json, double& value, Range range, const std::string& pointer) {
    if (!is_number_in(json, range)) refuse_value("must be a number " + words(range), pointer);
    value = json.get<double>() + 0.0;
}

void read(const Json& json, int& value, Range range, const std::string& pointer) {
    if (!is_number_in(json, range) || json.get<double>() != std::floor(json.get<double>()))
        refuse_value("must be a whole number " + words(range), pointer);
    value = int(json.get<double>());
}

void read(const Json& json, bool& value, Any, const std::string& pointer) {
    if (!json.is_boolean()) refuse_value("must be true or false", pointer);
    value = json.get<bool>();
}

void read(const Json& json, std::optional<int>& value, Range range, const std::string& pointer) {
    value.reset();
    if (json.is_null()) return;
    if (!json.is_number()) refuse_value("must be null or a whole number " + words(range), pointer);
    read(json, value.emplace(), range, pointer);
}

void read(const Json& json, std::optional<double>& value, RangeOrNull rule,
          const std::string& pointer) {
    value.reset();
    if (json.is_null()) return;
    if (!is_number_in(json, rule.range))
        refuse_value("must be null or a number " + words(rule.range), pointer);
    value = json.get<double>() + 0.0;
}

void read(const Json& json, std::optional<double>& value, RangeOrWord rule,
          const std::string& pointer) {
    value.reset();
    if (json.is_string() && json.get_ref<const std::string&>() == rule.word) return;
    if (!is_number_in(json, rule.range))
        refuse_value(fmt::format("must be '{}' or a number {}", rule.word, words(rule.range)),
                     pointer);
    value = json.get<double>() + 0.0;
}

void read(const Json& json, Vec3& value, Range range, const std::string& pointer) {
    const std::vector<double> n = numbers(json, 3, range, "[x, y, z]", pointer);
    value = {n[0], n[1], n[2]};
}

void read(const Json& json, std::optional<Vec3>& value, Range range, const std::string& pointer) {
    read(json, value.emplace(), range, pointer);
}

void read(const Json& json, Rotation& value, Range range, const std::string& pointer) {
    const std::vector<double> n = numbers(json, 2, range, "[yaw, pitch]", pointer);
    value = {n[0], n[1]};
}

void read(const Json& json, Falloff& value, Range range, const std::string& pointer) {
    const std::vector<double> n = numbers(json, 2, range, "[from, to]", pointer);
    if (!(n[0] < n[1])) refuse_value("must have its first number below its second", pointer);
    value = {n[0], n[1]};
}

void read(const Json& json, Colour& value, Any, const std::string& pointer) {
    if (json.is_string()) {
        const auto colour = colour_from_hex(json.get_ref<const std::string&>());
        if (!colour) refuse_value("must be a colour: \"#rrggbb\" or [r, g, b]", pointer);
        value = *colour;
        return;
    }
    if (!json.is_array()) refuse_value("must be a colour: \"#rrggbb\" or [r, g, b]", pointer);
    const std::vector<double> n = numbers(json, 3, from_to(0, 10000), "[r, g, b]", pointer);
    value = {{n[0], n[1], n[2]}, false};
}

void read(const Json& json, std::optional<Colour>& value, Any, const std::string& pointer) {
    read_or_null(json, value, Any{}, pointer);
}

void read(const Json& json, Base& value, Range range, const std::string& pointer) {
    const bool word = json.is_string();
    if (word && json == "none") value = {Base::Kind::none, 0};
    else if (word && json == "auto") value = {Base::Kind::automatic, 0};
    else if (is_number_in(json, range)) value = {Base::Kind::level, json.get<double>() + 0.0};
    else refuse_value("must be 'none', 'auto' or a number " + words(range), pointer);
}

void read(const Json& json, std::optional<Rect>& value, Any, const std::string& pointer) {
    value.reset();
    if (json.is_null()) return;
    if (!json.is_array() || json.size() != 4)
        refuse_value("must be null or [x, y, width, height]: 4 whole numbers", pointer);
    int n[4];
    for (std::size_t i = 0; i < 4; ++i)
        read(json[i], n[i], i < 2 ? from_to(0, sizes.hi) : sizes, fmt::format("{}/{}", pointer, i));
    value = {n[0], n[1], n[2], n[3]};
}

void read(const Json& json, std::array<double, 3>& value, Range range, const std::string& pointer) {
    const std::vector<double> n = numbers(json, 3, range, "[r, g, b]", pointer);
    value = {n[0], n[1], n[2]};
}

void read(const Json& json, std::array<double, 3>& value, RequiredIn rule,
          const std::string& pointer) {
    read(json, value, rule.range, pointer);
}

void read(const Json& json, scatter::Medium& value, Any, const std::string& pointer) {
    if (json.is_string()) {
        const auto* const found = scatter::find_medium(json.get_ref<const std::string&>());
        if (!found) refuse_value("must be a medium of GET /v1/media, or its numbers", pointer);
        value = found->medium;
        return;
    }
    if (!json.is_object())
        refuse_value("must be a medium of GET /v1/media, or its numbers", pointer);
    value = {.sigma_a = {}, .sigma_s = {}, .g = {}, .eta = 1.3};
    Reader reader(json, pointer);
    medium_fields(reader, value);
    reader.finish();
}

void read(const Json& json, std::optional<Film>& value, Any any, const std::string& pointer) {
    read_or_null(json, value, any, pointer);
}

void read(const Json& json, ImageSource& value, Required, const std::string& pointer) {
    Reader reader(json, pointer);
    constexpr std::array kinds{Choice{"image", ImageSource::Kind::image},
                               Choice{"data", ImageSource::Kind::data},
                               Choice{"part", ImageSource::Kind::part}};
    int found = 0;
    for (const auto& kind : kinds) {
        const Json* text = reader.take(kind.name);
        if (!text) continue;
        if (!text->is_string()) refuse_value("must be a string", reader.pointer_to(kind.name));
        value = {kind.value, text->get<std::string>(), reader.pointer_to(kind.name)};
        ++found;
    }
    reader.finish();
    if (found == 0)
        throw Error(error_code::missing_field,
                    "an image is given as {\"image\": id}, {\"data\": base64} or {\"part\": name}",
                    reader.pointer_to("image"));
    if (found > 1) refuse_value("has more than one of 'image', 'data' and 'part'", pointer);
}

void read(const Json& json, std::optional<ImageSource>& value, Any, const std::string& pointer) {
    value.reset();
    if (!json.is_null()) read(json, value.emplace(), Required{}, pointer);
}

void read(const Json& json, LightDescription& value, const std::string& pointer) {
    if (!json.is_object()) refuse_value("must be an object", pointer);
    const auto type = json.find("type");
    if (type == json.end() || type->is_discarded())
        throw Error(error_code::missing_field, field_name(pointer + "/type") + " is missing",
                    pointer + "/type");
    if (*type == "point") value = light_from<PointLight>(json, pointer);
    else if (*type == "directional") value = directional_light_from(json, pointer);
    else if (*type == "environment") value = light_from<EnvironmentDescription>(json, pointer);
    else
        refuse_value("must be " + listed({"point", "directional", "environment"}),
                     pointer + "/type");
}

}  // namespace relit::server
