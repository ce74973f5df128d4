#include "server/schema/field_paths.h"

#include "server/schema/field_schema.h"

namespace relit::server {
namespace {

void add_words(const OrderedJson& schema, std::vector<std::string>& words) {
    if (schema.contains("enum"))
        for (const OrderedJson& word : schema["enum"])
            words.push_back(word.is_null() ? "null" : word.get<std::string>());
    if (schema.contains("const")) words.push_back(schema["const"].get<std::string>());
    if (schema.contains("anyOf"))
        for (const OrderedJson& choice : schema["anyOf"]) add_words(choice, words);
    if (schema.contains("type") && schema["type"] == "null") words.emplace_back("null");
    if (schema.contains("type") && schema["type"] == "boolean")
        words.insert(words.end(), {"true", "false"});
}

}  // namespace

std::vector<FieldPath> field_paths() {
    std::vector<FieldPath> paths;
    for (const FlatField& field : flat_fields()) {
        FieldPath path{field.path, {}, field.schema["description"].get<std::string>()};
        add_words(field.schema, path.words);
        paths.push_back(std::move(path));
    }
    return paths;
}

bool has_field(std::string_view scene_json, std::string_view path) {
    const Json scene = parse_json(scene_json);
    const Json* place = &scene;
    while (place->is_object()) {
        const auto dot = path.find('.');
        const auto found = place->find(path.substr(0, dot));
        if (found == place->end()) return false;
        if (dot == std::string_view::npos) return true;
        place = &*found;
        path.remove_prefix(dot + 1);
    }
    return false;
}

}  // namespace relit::server
