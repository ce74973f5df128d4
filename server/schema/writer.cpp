#include "server/schema/writer.h"

#include <spdlog/fmt/fmt.h>

#include <cmath>

namespace relit::server {
namespace {

// Whole numbers without ".0": 1 and 1.0 are one number.
OrderedJson number(double value) {
    if (value == std::floor(value) && std::abs(value) < 1e15) return std::int64_t(value);
    return value;
}

}  // namespace

OrderedJson written(double value, Range) { return number(value); }
OrderedJson written(int value, Range) { return value; }
OrderedJson written(bool value, Any) { return value; }
OrderedJson written(const std::optional<int>& value, Range) {
    return value ? OrderedJson(*value) : OrderedJson(nullptr);
}
OrderedJson written(const std::optional<double>& value, RangeOrNull) {
    return value ? number(*value) : OrderedJson(nullptr);
}
OrderedJson written(const std::optional<double>& value, RangeOrWord rule) {
    return value ? number(*value) : OrderedJson(rule.word);
}
OrderedJson written(const Vec3& value, Range) {
    return OrderedJson::array({number(value.x), number(value.y), number(value.z)});
}
OrderedJson written(const std::optional<Vec3>& value, Range range) {
    return value ? written(*value, range) : OrderedJson(nullptr);
}
OrderedJson written(const Rotation& value, Range) {
    return OrderedJson::array({number(value.yaw_deg), number(value.pitch_deg)});
}
OrderedJson written(const Falloff& value, Range) {
    return OrderedJson::array({number(value.lo), number(value.hi)});
}

OrderedJson written(const Colour& value, Any) {
    const auto& v = value.values;
    if (!value.hex) return OrderedJson::array({number(v[0]), number(v[1]), number(v[2])});
    const auto byte = [](double fraction) { return int(std::lround(fraction * 255)); };
    return fmt::format("#{:02x}{:02x}{:02x}", byte(v[0]), byte(v[1]), byte(v[2]));
}

OrderedJson written(const std::optional<Colour>& value, Any any) {
    return value ? written(*value, any) : OrderedJson(nullptr);
}

OrderedJson written(const Base& value, Range) {
    switch (value.kind) {
        case Base::Kind::none:
            return "none";
        case Base::Kind::automatic:
            return "auto";
        case Base::Kind::level:
            break;
    }
    return number(value.level);
}

OrderedJson written(const std::optional<Rect>& value, Any) {
    if (!value) return nullptr;
    return OrderedJson::array({value->x, value->y, value->width, value->height});
}

OrderedJson written(const std::array<double, 3>& value, Range) {
    return OrderedJson::array({number(value[0]), number(value[1]), number(value[2])});
}
OrderedJson written(const std::array<double, 3>& value, RequiredIn rule) {
    return written(value, rule.range);
}

OrderedJson written(const scatter::Medium& value, Any) {
    for (const scatter::NamedMedium& named : scatter::measured_media())
        if (named.medium == value) return named.name;
    Writer writer;
    medium_fields(writer, value);
    return std::move(writer.json);
}

OrderedJson written(const std::optional<Film>& value, Any any) {
    return value ? written(*value, any) : OrderedJson(nullptr);
}

OrderedJson written(const ImageSource& value, Required) {
    switch (value.kind) {
        case ImageSource::Kind::image:
            return {{"image", value.text}};
        case ImageSource::Kind::data:
            return {{"data", value.text}};
        case ImageSource::Kind::part:
            break;
    }
    return {{"part", value.text}};
}

OrderedJson written(const std::optional<ImageSource>& value, Any) {
    return value ? written(*value, Required{}) : OrderedJson(nullptr);
}

OrderedJson written(const LightDescription& value) {
    Writer writer;
    std::visit(
        [&](const auto& light) {
            writer.json["type"] = light_type_name<std::remove_cvref_t<decltype(light)>>();
            fields(writer, light);
        },
        value);
    // A direction or angles, never both.
    if (const auto* sun = std::get_if<DirectionalLight>(&value)) {
        if (!sun->direction) writer.json.erase("direction");
        else
            for (const char* angle : {"azimuth", "elevation"}) writer.json.erase(angle);
    }
    return std::move(writer.json);
}

void Writer::lights(std::string_view one, std::string_view several,
                    const std::vector<LightDescription>& lights, std::string_view) {
    if (lights.size() == 1) {
        json[std::string(one)] = written(lights.front());
        return;
    }
    OrderedJson& list = json[std::string(several)] = OrderedJson::array();
    for (const LightDescription& light : lights) list.push_back(written(light));
}

}  // namespace relit::server
