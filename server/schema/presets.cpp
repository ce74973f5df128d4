#include "server/schema/presets.h"

#include "server/schema/preset_merge.h"
#include "server/schema/reader.h"
#include "server/schema/writer.h"

namespace relit::server {
namespace {

struct Preset {
    PresetInfo info;
    std::string_view scene;
};

constexpr Preset presets[] = {
    {{"bas-relief", "Unpainted plaster, crisp and matt, under a light from the upper left."}, R"({
        "base": "none",
        "light": {"type": "point", "position": [0.15, 0.95, 0.6], "intensity": 1.1},
        "material": {"depth": 0.006, "diffuseColor": "#ece6da", "baseColor": "#0c0d10"}
    })"},
    {{"marble", "Polished white marble: light goes a little way in, edges are soft."}, R"({
        "base": "none",
        "light": {"type": "point", "position": [0.15, 0.95, 0.6], "intensity": 1.1},
        "material": {"illumination": "exponential", "attenuation": 70, "depth": 0.006,
                     "diffuseColor": "#f4efe8", "baseColor": "#14161a",
                     "specular": {"k": 0.08, "falloff": [0.85, 1]}}
    })"},
    {{"bronze", "A bronze coin or plaque: low relief, warm highlights that shadows cut."}, R"({
        "base": "none", "relief": 0.12,
        "light": {"type": "point", "position": [0.15, 0.95, 0.5], "intensity": 1.7},
        "material": {"depth": 0.005, "diffuseColor": "#8a5a2b", "specularColor": "#ffc98a",
                     "baseColor": "#120a05",
                     "specular": {"k": 0.45, "falloff": [0.35, 1], "occlude": true}}
    })"},
    {{"gold", "Gold: as bronze, brighter and yellower."}, R"({
        "base": "none", "relief": 0.12,
        "light": {"type": "point", "position": [0.15, 0.95, 0.5], "intensity": 2},
        "material": {"depth": 0.005, "diffuseColor": "#b8862b", "specularColor": "#ffe08a",
                     "baseColor": "#1c1004",
                     "specular": {"k": 0.5, "falloff": [0.3, 1], "occlude": true}}
    })"},
    {{"wax", "Candle wax: a warm light behind it, another before it, and edges that glow."}, R"({
        "base": -0.01, "relief": 0.2,
        "lights": [{"type": "point", "position": [0.5, 0.5, -0.35], "intensity": 1.8,
                    "color": [1, 0.72, 0.42]},
                   {"type": "point", "position": [0.15, 0.95, 0.45], "intensity": 0.8,
                    "color": [1, 0.9, 0.75]}],
        "material": {"illumination": "exponential", "attenuation": 18, "depth": 0.008,
                     "diffuseColor": "#ffdda6", "baseColor": "#140a04", "scatter": {"k": 0.45}}
    })"},
    {{"skin", "Faces: soft shadows that end in red, a faint sheen."}, R"({
        "base": "none", "relief": 0.25,
        "light": {"type": "point", "position": [0.15, 0.95, 0.6], "color": [1, 0.93, 0.86]},
        "material": {"illumination": "exponential", "attenuation": 25, "depth": 0.01,
                     "diffuseColor": "#d9a184", "baseColor": "#1c0906",
                     "specular": {"k": 0.12, "falloff": [0.6, 1]}}
    })"},
    {{"jade", "A carved slab of jade that glows from behind and shines in front."}, R"({
        "base": -0.01, "relief": 0.2,
        "lights": [{"type": "point", "position": [0.45, 0.55, -0.5], "intensity": 1.8,
                    "color": [1, 1, 0.9]},
                   {"type": "point", "position": [0.15, 0.95, 0.6], "intensity": 1.2}],
        "material": {"illumination": "exponential", "attenuation": 20, "depth": 0.01,
                     "diffuseColor": "#5fb37c", "specularColor": "#e8fff0", "baseColor": "#04140a",
                     "specular": {"k": 0.2, "falloff": [0.7, 1]}, "scatter": {"k": 0.5}}
    })"},
    {{"sunset", "Terrain in the evening: a low warm sun, long shadows, a blue sky opposite."}, R"({
        "base": "none", "relief": 0.13,
        "lights": [{"type": "directional", "azimuth": 300, "elevation": 18, "intensity": 2,
                    "color": [1, 0.68, 0.4]},
                   {"type": "directional", "azimuth": 120, "elevation": 55, "intensity": 0.3,
                    "color": [0.45, 0.6, 1]}],
        "material": {"depth": 0.003, "diffuseColor": "#b9a98a"}
    })"},
    // Subsurface scattering, from measured media where there is one. Sizes: a thing to hold in a hand.
    {{"translucent-marble", "Marble as measured: light enters it, spreads and comes out around."},
     R"({
        "base": "none",
        "light": {"type": "directional", "azimuth": 315, "elevation": 22, "intensity": 2},
        "material": {"model": "dipole", "medium": "marble", "mmPerWidth": 60, "depth": 0.004,
                     "highlight": {"lobe": "ward", "k": 0.12, "nt": 12, "nb": 12}}
    })"},
    {{"translucent-skin", "Skin as measured: red edges where shadow begins, a soft sheen."}, R"({
        "base": "none", "relief": 0.25,
        "light": {"type": "directional", "azimuth": 315, "elevation": 35, "intensity": 1.7},
        "material": {"model": "better-dipole", "medium": "skin2", "mmPerWidth": 160, "depth": 0.004,
                     "highlight": {"lobe": "ashikhmin", "k": 0.6, "nt": 8, "nb": 8,
                                   "transport": "local"}}
    })"},
    {{"whole-milk", "Whole milk, set like cream: white and soft, hardly a shadow."}, R"({
        "base": "none",
        "light": {"type": "directional", "azimuth": 315, "elevation": 30, "intensity": 1.5},
        "material": {"model": "dipole", "medium": "whole-milk", "mmPerWidth": 40, "depth": 0.004}
    })"},
    {{"skim-milk", "Skim milk: thinner, bluish in the light and warm in the shade."}, R"({
        "base": "none",
        "light": {"type": "directional", "azimuth": 315, "elevation": 30, "intensity": 1.6},
        "material": {"model": "dipole", "medium": "skim-milk", "mmPerWidth": 40, "depth": 0.004}
    })"},
    {{"translucent-jade",
      "Jade-like stone: green light deep inside, a highlight carried below it."},
     R"({
        "base": "none", "relief": 0.2,
        "light": {"type": "directional", "azimuth": 300, "elevation": 25, "intensity": 2.4},
        "material": {"model": "dipole", "mmPerWidth": 30, "depth": 0.004,
                     "medium": {"sigmaA": [0.06, 0.004, 0.03], "sigmaS": [1.1, 1.3, 1.2],
                                "eta": 1.6},
                     "highlight": {"lobe": "ward", "k": 0.3, "nt": 20, "nb": 20,
                                   "transport": "local"}}
    })"},
    {{"translucent-wax", "Candle wax-like: yellow to red with depth, no hard edge anywhere."}, R"({
        "base": "none", "relief": 0.2,
        "light": {"type": "directional", "azimuth": 315, "elevation": 25, "intensity": 2},
        "material": {"model": "dipole", "mmPerWidth": 40, "depth": 0.004,
                     "medium": {"sigmaA": [0.002, 0.02, 0.14], "sigmaS": [1.3, 1.4, 1.5],
                                "eta": 1.45}}
    })"},
    {{"chocolate-milk", "Chocolate milk as measured, set like a pudding."}, R"({
        "base": "none",
        "light": {"type": "directional", "azimuth": 315, "elevation": 30, "intensity": 1.1},
        "material": {"model": "dipole", "medium": "chocolate-milk-regular", "mmPerWidth": 60,
                     "depth": 0.004,
                     "highlight": {"lobe": "ward", "k": 0.15, "nt": 20, "nb": 20,
                                   "transport": "local"}}
    })"},
    {{"ketchup", "Ketchup as measured: deep red, glossy."}, R"({
        "base": "none",
        "light": {"type": "directional", "azimuth": 315, "elevation": 35, "intensity": 4},
        "material": {"model": "better-dipole", "medium": "ketchup", "mmPerWidth": 80,
                     "depth": 0.004,
                     "highlight": {"lobe": "ward", "k": 0.25, "nt": 40, "nb": 40,
                                   "transport": "local"}}
    })"},
    {{"clownfish", "A fish: a thin film of scales over orange flesh. Made for the fish sample."},
     R"({
        "base": "none", "relief": 0.2,
        "light": {"type": "directional", "azimuth": 330, "elevation": 40, "intensity": 1.6},
        "material": {"model": "dipole", "mmPerWidth": 110, "depth": 0.004,
                     "medium": {"sigmaA": [0.01, 0.35, 4], "sigmaS": [1.2, 1.1, 1.0],
                                "eta": 1.37},
                     "film": {"medium": "epidermis", "thickness": 0.006},
                     "bssrdfWeight": 1.4, "diffuseWeight": 0.05,
                     "highlight": {"lobe": "ashikhmin", "k": 1, "nt": 10, "nb": 40,
                                   "transport": "local"}}
    })"},
    {{"anemone", "An anemone under water: rose flesh that light goes right through."}, R"({
        "base": "none", "relief": 0.25,
        "light": {"type": "directional", "azimuth": 300, "elevation": 12, "intensity": 6,
                  "color": [0.75, 0.9, 1]},
        "material": {"model": "dipole", "mmPerWidth": 12, "depth": 0.006,
                     "medium": {"sigmaA": [0.006, 0.14, 0.05], "sigmaS": [1.4, 1.2, 1.3],
                                "g": [0.3, 0.3, 0.3], "eta": 1.35},
                     "highlight": {"lobe": "ward", "k": 0.4, "nt": 6, "nb": 6}}
    })"},
    // Each direction of the sample "rainbow" (by its id) has a hue of its own, and highlights alone
    // keep them apart; cut by shadows they leave dark outlines.
    {{"ink", "A drawing in coloured inks on paper: slopes tell hues, steps are black outlines."},
     R"({
        "base": "none", "relief": 0.15,
        "light": {"type": "environment", "rotation": [180, 0], "intensity": 6, "image": {
            "image": "a799e1a04494e45c93a3ce7322052e20db31d4d953bbbdbb42d1af76d34c1165"}},
        "material": {"depth": 0.004,
                     "specular": {"k": 1, "falloff": [0.6, 1], "occlude": true}},
        "output": {"background": "#f6f1e4"}
    })"},
    // The usual light would lie inside a solid of relief 1, and d <= 1/2 asks for intensity 2.
    {{"thesis", "The settings of the thesis's own program: samples counted, no colour management."},
     R"({
        "relief": 1, "base": "none",
        "light": {"type": "point", "position": [0.3, 0.8, 1.4], "intensity": 2},
        "material": {"illumination": "count", "steps": 100, "offset": "view"},
        "output": {"transfer": "none"}
    })"},
};

const Preset& preset_of(const Json& name) {
    std::vector<std::string_view> names;
    for (const Preset& preset : presets) {
        if (name == preset.info.name) return preset;
        names.push_back(preset.info.name);
    }
    refuse_value("must be " + listed(names), "/preset");
}

// A field whose value the reader is to take as not there. Its name stays: an unknown field is refused
// whatever it holds.
const Json absent(Json::value_t::discarded);

// {"image": id} and its kin are one value: a source of another kind does not join the preset's.
bool is_image_source(const Json& value) {
    return value.contains("data") || value.contains("part") ||
           (value.contains("image") && value["image"].is_string());
}

// RFC 7396: what of a patch is new to the target, its nulls taken for nothing.
Json without_nulls(const Json& patch) {
    if (patch.is_null()) return absent;
    if (!patch.is_object()) return patch;
    Json value = Json::object();
    for (const auto& [key, member] : patch.items()) value[key] = without_nulls(member);
    return value;
}

void merge(Json& target, const Json& patch) {
    for (const auto& [key, value] : patch.items()) {
        const bool joins = value.is_object() && !is_image_source(value) && target.contains(key) &&
                           target[key].is_object();
        if (joins) merge(target[key], value);
        else target[key] = without_nulls(value);
    }
}

bool is_given(const Json& scene, const char* field) {
    return scene.contains(field) && !scene[field].is_null() && !scene[field].is_discarded();
}

bool replaces_light(const Json& light, const Json& old) {
    if (!light.is_object() || !old.is_object()) return true;
    return light.contains("type") && (!old.contains("type") || light["type"] != old["type"]);
}

}  // namespace

Json laid_over(Json scene, const Json& patch) {
    const bool new_light = is_given(patch, "light") && is_given(scene, "light") &&
                           replaces_light(patch["light"], scene["light"]);
    if (new_light || is_given(patch, "lights")) scene.erase("light");
    if (is_given(patch, "light") || is_given(patch, "lights")) scene.erase("lights");
    merge(scene, patch);
    return scene;
}

Json over_preset(Json scene) {
    if (!scene.is_object() || !scene.contains("preset")) return scene;
    const Json name = scene["preset"];
    scene.erase("preset");
    if (name.is_null() || name.is_discarded()) return scene;
    return laid_over(Json::parse(preset_of(name).scene), scene);
}

std::vector<PresetInfo> preset_list() {
    std::vector<PresetInfo> list;
    for (const Preset& preset : presets) list.push_back(preset.info);
    return list;
}

std::string presets_json() {
    OrderedJson list = OrderedJson::array();
    for (const Preset& preset : presets)
        list.push_back({{"name", preset.info.name},
                        {"description", preset.info.sentence},
                        {"scene", OrderedJson::parse(preset.scene)}});
    return OrderedJson{{"presets", std::move(list)}}.dump();
}

}  // namespace relit::server
