#include "server/schema/field_schema.h"

#include "server/schema/presets.h"

namespace relit::server {
namespace {

OrderedJson reference(std::string_view name) {
    return {{"$ref", "#/components/schemas/" + std::string(name)}};
}

OrderedJson or_null(OrderedJson schema) {
    return {{"anyOf", OrderedJson::array({std::move(schema), {{"type", "null"}}})}};
}

OrderedJson number_in(const char* type, Range range) {
    return {{"type", type},
            {range.lo_excluded ? "exclusiveMinimum" : "minimum", written(range.lo, range)},
            {"maximum", written(range.hi, range)}};
}

OrderedJson list_of(OrderedJson item, int count) {
    return {
        {"type", "array"}, {"items", std::move(item)}, {"minItems", count}, {"maxItems", count}};
}

OrderedJson const_text(std::string_view text) { return {{"const", text}}; }

// A light of one kind: its rows behind `type`.
template <class L>
OrderedJson light_schema() {
    OrderedJson schema = FieldSchema::of(L{}, 1);
    OrderedJson properties = {{"type", const_text(light_type_name<L>())}};
    properties.update(schema["properties"]);
    schema["properties"] = std::move(properties);
    OrderedJson required = OrderedJson::array({"type"});
    if (schema.contains("required"))
        for (const auto& name : schema["required"]) required.push_back(name);
    schema["required"] = std::move(required);
    return schema;
}

OrderedJson directional_light_schema() {
    OrderedJson schema = light_schema<DirectionalLight>();
    const OrderedJson angles =
        OrderedJson::array({{{"required", {"azimuth"}}}, {{"required", {"elevation"}}}});
    schema["not"] = {{"required", {"direction"}}, {"anyOf", angles}};
    return schema;
}

OrderedJson image_schema() {
    const auto source = [](const char* name, const char* sentence) {
        return OrderedJson{
            {"type", "object"},
            {"properties", {{name, {{"type", "string"}, {"description", sentence}}}}},
            {"required", OrderedJson::array({name})},
            {"additionalProperties", false}};
    };
    return {{"oneOf", OrderedJson::array(
                          {source("image", "Id of a stored image or of a sample."),
                           source("data", "The file itself in base64 (RFC 4648, section 4)."),
                           source("part",
                                  "Name of the part of the same multipart/form-data request that "
                                  "holds the file.")})}};
}

OrderedJson colour_schema() {
    return {{"oneOf", OrderedJson::array({{{"type", "string"},
                                           {"pattern", "^#[0-9a-fA-F]{6}$"},
                                           {"description", "sRGB, as #rrggbb."}},
                                          [] {
                                              OrderedJson list = list_of(
                                                  number_in("number", from_to(0, 10000)), 3);
                                              list["description"] = "Linear red, green, blue.";
                                              return list;
                                          }()})}};
}

OrderedJson medium_schema() {
    OrderedJson names = OrderedJson::array();
    for (const scatter::NamedMedium& medium : scatter::measured_media())
        names.push_back(medium.name);
    FieldSchema numbers(1);
    const scatter::Medium medium{.sigma_a = {}, .sigma_s = {}, .g = {}, .eta = 1.3};
    medium_fields(numbers, medium);
    return {{"anyOf", OrderedJson::array(
                          {{{"type", "string"}, {"enum", std::move(names)}}, numbers.schema()})}};
}

OrderedJson preset_schema() {
    OrderedJson names = OrderedJson::array();
    for (const PresetInfo& preset : preset_list()) names.push_back(preset.name);
    names.push_back(nullptr);
    return {{"type", {"string", "null"}},
            {"enum", std::move(names)},
            {"description",
             "A scene to start from: this one is laid over it as a merge patch "
             "(RFC 7396); null takes a field that the preset sets back to its "
             "default."}};
}

OrderedJson scene_schema(int max_lights) {
    OrderedJson schema = FieldSchema::of(SceneDescription{}, max_lights);
    OrderedJson properties = {{"preset", preset_schema()}};
    properties.update(schema["properties"]);
    schema["properties"] = std::move(properties);
    schema["not"] = {{"required", {"light", "lights"}}};
    return schema;
}

// Flattens the rows instead of nesting them.
class FlatFields {
public:
    FlatFields(std::string prefix, std::vector<FlatField>& list)
        : prefix_(std::move(prefix)), list_(list) {}

    template <class T, class Rule>
    void operator()(std::string_view name, const T& member, const Rule& rule,
                    std::string_view sentence) {
        const std::string path = prefix_ + std::string(name);
        if constexpr (HasRows<T>) {
            FlatFields below(path + ".", list_);
            fields(below, member);
        } else if constexpr (Like<T, ImageSource> || Like<T, std::optional<ImageSource>>) {
            add(path + ".image", OrderedJson{{"type", "string"}}, sentence);
        } else if constexpr (Like<T, scatter::Medium>) {
            OrderedJson schema = medium_schema();
            schema["default"] = written(member, rule);
            add(path, std::move(schema), sentence);
        } else if constexpr (Like<T, std::optional<Film>>) {
            FlatFields below(path + ".", list_);
            const Film film;
            fields(below, film);
        } else {
            OrderedJson schema = described(member, rule);
            if constexpr (has_default<T, Rule>) schema["default"] = written(member, rule);
            add(path, std::move(schema), sentence);
        }
    }

    void lights(std::string_view one, std::string_view, const std::vector<LightDescription>&,
                std::string_view) {
        const std::string path(one);
        add(path + ".type", {{"type", "string"}, {"enum", {"point", "directional", "environment"}}},
            "What kind of light.");
        FlatFields below(path + ".", list_);
        const PointLight point;
        const DirectionalLight sun;
        const EnvironmentDescription environment;
        fields(below, point);
        fields(below, sun);
        fields(below, environment);
    }

private:
    // Kinds of lights share the names of fields, and what one takes another may not.
    void add(const std::string& path, OrderedJson schema, std::string_view sentence) {
        for (FlatField& field : list_) {
            if (field.path != path) continue;
            schema["description"] = field.schema["description"];
            if (field.schema != schema) join(field.schema, schema);
            return;
        }
        schema["description"] = sentence;
        list_.push_back({path, std::move(schema)});
    }

    // Either of them, with no default that would be the other's.
    static void join(OrderedJson& schema, OrderedJson& other) {
        OrderedJson joined = {{"description", schema["description"]}};
        for (OrderedJson* one : {&schema, &other})
            for (const char* key : {"description", "default"}) one->erase(key);
        joined["anyOf"] = OrderedJson::array({schema, other});
        schema = std::move(joined);
    }

    std::string prefix_;
    std::vector<FlatField>& list_;
};

}  // namespace

OrderedJson described(double, Range range) { return number_in("number", range); }
OrderedJson described(int, Range range) { return number_in("integer", range); }
OrderedJson described(bool, Any) { return {{"type", "boolean"}}; }
OrderedJson described(const std::optional<int>&, Range range) {
    return or_null(number_in("integer", range));
}
OrderedJson described(const std::optional<double>&, RangeOrNull rule) {
    return or_null(number_in("number", rule.range));
}
OrderedJson described(const std::optional<double>&, RangeOrWord rule) {
    return {{"anyOf", OrderedJson::array({number_in("number", rule.range), const_text(rule.word)})}};
}
OrderedJson described(const Vec3&, Range range) { return list_of(number_in("number", range), 3); }
OrderedJson described(const std::optional<Vec3>&, Range range) {
    return list_of(number_in("number", range), 3);
}
OrderedJson described(const Rotation&, Range range) {
    return list_of(number_in("number", range), 2);
}
OrderedJson described(const Falloff&, Range range) {
    return list_of(number_in("number", range), 2);
}
OrderedJson described(const Colour&, Any) { return reference("Color"); }
OrderedJson described(const std::optional<Colour>&, Any) { return or_null(reference("Color")); }
OrderedJson described(const Base&, Range range) {
    return {{"anyOf", OrderedJson::array(
                          {number_in("number", range), const_text("none"), const_text("auto")})}};
}
OrderedJson described(const std::optional<Rect>&, Any) {
    const OrderedJson corner = number_in("integer", from_to(0, sizes.hi));
    const OrderedJson extent = number_in("integer", sizes);
    return or_null({{"type", "array"},
                    {"prefixItems", OrderedJson::array({corner, corner, extent, extent})},
                    {"minItems", 4},
                    {"maxItems", 4}});
}
OrderedJson described(const std::array<double, 3>&, Range range) {
    return list_of(number_in("number", range), 3);
}
OrderedJson described(const std::array<double, 3>& value, RequiredIn rule) {
    return described(value, rule.range);
}
OrderedJson described(const scatter::Medium&, Any) { return reference("Medium"); }
OrderedJson described(const std::optional<Film>&, Any) {
    return or_null(FieldSchema::of(Film{}, 1));
}
OrderedJson described(const ImageSource&, Required) { return reference("Image"); }
OrderedJson described(const std::optional<ImageSource>&, Any) {
    return or_null(reference("Image"));
}

void FieldSchema::lights(std::string_view one, std::string_view several,
                         const std::vector<LightDescription>& lights, std::string_view sentence) {
    OrderedJson& light = properties[std::string(one)] = reference("Light");
    light["default"] = written(lights.front());
    light["description"] = sentence;
    properties[std::string(several)] = {{"type", "array"},
                                        {"items", reference("Light")},
                                        {"minItems", 1},
                                        {"maxItems", max_lights_},
                                        {"description", "In place of light: several."}};
}

OrderedJson FieldSchema::schema() const {
    OrderedJson schema = {{"type", "object"}, {"properties", properties}};
    if (!required.empty()) schema["required"] = required;
    schema["additionalProperties"] = false;
    return schema;
}

OrderedJson scene_schemas(int max_lights) {
    return {{"Scene", scene_schema(max_lights)},
            {"Light",
             {{"oneOf", OrderedJson::array({reference("PointLight"), reference("DirectionalLight"),
                                            reference("EnvironmentLight")})}}},
            {"PointLight", light_schema<PointLight>()},
            {"DirectionalLight", directional_light_schema()},
            {"EnvironmentLight", light_schema<EnvironmentDescription>()},
            {"Image", image_schema()},
            {"Color", colour_schema()},
            {"Medium", medium_schema()}};
}

std::vector<FlatField> flat_fields() {
    std::vector<FlatField> list{{"preset", preset_schema()}};
    FlatFields visitor("", list);
    const SceneDescription scene;
    fields(visitor, scene);
    return list;
}

}  // namespace relit::server
