#include "server/schema/presets.h"

#include "server/schema/reader.h"

namespace relit::server {
namespace {

struct Preset {
    std::string_view name;
    std::string_view scene;
};

constexpr Preset presets[] = {
    // The usual light would lie inside a solid of relief 1, and d <= 1/2 asks for intensity 2.
    {"thesis", R"({
        "relief": 1, "base": "none",
        "light": {"type": "point", "position": [0.3, 0.8, 1.4], "intensity": 2},
        "material": {"illumination": "count", "steps": 100, "offset": "view"},
        "output": {"transfer": "none"}
    })"},
};

const Preset& preset_of(const Json& name) {
    std::vector<std::string_view> names;
    for (const Preset& preset : presets) {
        if (name == preset.name) return preset;
        names.push_back(preset.name);
    }
    refuse_value("must be " + listed(names), "/preset");
}

// RFC 7396, but a null that removes nothing is kept: whether the field may be null is its own row's
// business.
void merge(Json& target, const Json& patch) {
    for (const auto& [key, value] : patch.items()) {
        const bool there = target.contains(key);
        if (value.is_null() && there) target.erase(key);
        else if (value.is_object() && there && target[key].is_object()) merge(target[key], value);
        else target[key] = value;
    }
}

bool replaces_light(const Json& light, const Json& preset_light) {
    return !light.is_object() || (light.contains("type") && light["type"] != preset_light["type"]);
}

}  // namespace

Json over_preset(Json scene) {
    if (!scene.is_object() || !scene.contains("preset")) return scene;
    const Json name = scene["preset"];
    scene.erase("preset");
    if (name.is_null()) return scene;
    Json result = Json::parse(preset_of(name).scene);
    const bool new_light = scene.contains("light") && result.contains("light") &&
                           replaces_light(scene["light"], result["light"]);
    if (new_light || scene.contains("lights")) result.erase("light");
    if (scene.contains("light")) result.erase("lights");
    merge(result, scene);
    return result;
}

}  // namespace relit::server
