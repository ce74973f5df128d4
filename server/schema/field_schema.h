// Structs -> JSON Schema (2020-12): the visitor of the field table that describes. For the OpenAPI
// document, and for everything that lists fields by their flat paths.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "server/schema/fields.h"
#include "server/schema/writer.h"

namespace relit::server {

// What a value may be, type by type, as a schema. Mirrors the read() functions of reader.h.
OrderedJson described(double value, Range range);
OrderedJson described(int value, Range range);
OrderedJson described(bool value, Any);
OrderedJson described(const std::optional<int>& value, Range range);
OrderedJson described(const std::optional<double>& value, RangeOrNull rule);
OrderedJson described(const std::optional<double>& value, RangeOrWord rule);
OrderedJson described(const Vec3& value, Range range);
OrderedJson described(const std::optional<Vec3>& value, Range range);
OrderedJson described(const Rotation& value, Range range);
OrderedJson described(const Falloff& value, Range range);
OrderedJson described(const Colour& value, Any);
OrderedJson described(const std::optional<Colour>& value, Any);
OrderedJson described(const Base& value, Range range);
OrderedJson described(const std::optional<Rect>& value, Any);
OrderedJson described(const std::array<double, 3>& value, Range range);
OrderedJson described(const std::array<double, 3>& value, RequiredIn rule);
OrderedJson described(const scatter::Medium& value, Any);
OrderedJson described(const std::optional<Film>& value, Any);
OrderedJson described(const ImageSource& value, Required);
OrderedJson described(const std::optional<ImageSource>& value, Any);

template <class T>
requires std::is_enum_v<T> OrderedJson described(T, Any) {
    OrderedJson words = OrderedJson::array();
    for (const auto& choice : choices_of<T>()) words.push_back(choice.name);
    return {{"type", "string"}, {"enum", std::move(words)}};
}

/// A struct with rows of its own.
template <class T>
concept HasRows = requires(Writer& writer, const T& value) {
    fields(writer, value);
};

/// Has a field that is not there one value that could be written instead? Not where it must be
/// there, nor a direction, which stands in place of angles.
template <class T, class Rule>
constexpr bool has_default = !is_required<Rule> && !Like<T, std::optional<Vec3>>;

/// Collects the fields of one object.
class FieldSchema {
public:
    explicit FieldSchema(int max_lights) : max_lights_(max_lights) {}

    template <class T, class Rule>
    void operator()(std::string_view name, const T& member, const Rule& rule,
                    std::string_view sentence) {
        const std::string key(name);
        if constexpr (is_required<Rule>) required.push_back(key);
        OrderedJson& schema = properties[key];
        if constexpr (HasRows<T>) {
            schema = of(member, max_lights_);
        } else {
            schema = described(member, rule);
            if constexpr (has_default<T, Rule>) schema["default"] = written(member, rule);
        }
        schema["description"] = sentence;
    }

    void lights(std::string_view one, std::string_view several,
                const std::vector<LightDescription>& lights, std::string_view sentence);

    /// The object: strict, as the reader is.
    [[nodiscard]] OrderedJson schema() const;

    /// The schema of a struct with rows.
    template <class T>
    static OrderedJson of(const T& value, int max_lights) {
        FieldSchema visitor(max_lights);
        fields(visitor, value);
        return visitor.schema();
    }

    OrderedJson properties = OrderedJson::object();
    OrderedJson required = OrderedJson::array();

private:
    int max_lights_;
};

/// The schemas that others refer to as "#/components/schemas/...": Scene, Light and its kinds,
/// Image, Color.
[[nodiscard]] OrderedJson scene_schemas(int max_lights);

/// A field by its flat path, "material.specular.k".
struct FlatField {
    std::string path;
    OrderedJson schema;  ///< of its value, with default and description
};

/// Every field of a scene that holds no other, in the table's order; those of all kinds of lights
/// below "light"; images by "image", the id of a stored one.
[[nodiscard]] std::vector<FlatField> flat_fields();

}  // namespace relit::server
