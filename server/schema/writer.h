// Structs -> JSON: the visitor of the field table that writes, every field, in the table's order.
#pragma once

#include "server/schema/fields.h"
#include "server/schema/strict_json.h"

namespace relit::server {

using OrderedJson = nlohmann::ordered_json;

/// Collects the fields of one object.
class Writer {
public:
    template <class T, class Rule>
    void operator()(std::string_view name, const T& member, const Rule& rule,
                    std::string_view /*sentence*/);

    void lights(std::string_view one, std::string_view several,
                const std::vector<LightDescription>& lights, std::string_view sentence);

    OrderedJson json = OrderedJson::object();
};

OrderedJson written(double value, Range);
OrderedJson written(int value, Range);
OrderedJson written(bool value, Any);
OrderedJson written(const std::optional<int>& value, Range);
OrderedJson written(const std::optional<double>& value, RangeOrNull);
OrderedJson written(const std::optional<double>& value, RangeOrWord rule);
OrderedJson written(const Vec3& value, Range);
OrderedJson written(const std::optional<Vec3>& value, Range);
OrderedJson written(const Rotation& value, Range);
OrderedJson written(const Falloff& value, Range);
OrderedJson written(const Colour& value, Any);
OrderedJson written(const std::optional<Colour>& value, Any);
OrderedJson written(const Base& value, Range);
OrderedJson written(const std::optional<Rect>& value, Any);
OrderedJson written(const std::array<double, 3>& value, Range);
OrderedJson written(const std::array<double, 3>& value, RequiredIn rule);
OrderedJson written(const scatter::Medium& value, Any);
OrderedJson written(const std::optional<Film>& value, Any);
OrderedJson written(const ImageSource& value, Required);
OrderedJson written(const std::optional<ImageSource>& value, Any);
OrderedJson written(const LightDescription& value);

template <class T>
requires std::is_enum_v<T> OrderedJson written(T value, Any) {
    for (const auto& choice : choices_of<T>())
        if (choice.value == value) return choice.name;
    return nullptr;
}

template <class T>
requires requires(Writer& writer, const T& value) { fields(writer, value); }
OrderedJson written(const T& value, Any) {
    Writer writer;
    fields(writer, value);
    return std::move(writer.json);
}

template <class T, class Rule>
void Writer::operator()(std::string_view name, const T& member, const Rule& rule,
                        std::string_view) {
    json[std::string(name)] = written(member, rule);
}

}  // namespace relit::server
