#include "server/schema/scene_json.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "server/schema/preset_merge.h"
#include "server/schema/reader.h"
#include "server/schema/scene_tree.h"
#include "server/schema/writer.h"

namespace relit::server {
namespace {

bool is_at_finite_distance(const LightDescription& light) {
    if (const auto* environment = std::get_if<EnvironmentDescription>(&light))
        return environment->light.radius.has_value();
    return std::holds_alternative<PointLight>(light);
}

void check_count(const SceneDescription& scene) {
    if (scene.material.illumination != Illumination::count) return;
    for (const LightDescription& light : scene.lights)
        if (!is_at_finite_distance(light))
            refuse_value(
                "must not be 'count' without lights at a finite distance: point lights, or "
                "environments with a "
                "radius",
                "/material/illumination");
}

void check_thickness(const SceneDescription& scene) {
    if (scene.output.picture.layer != Layer::thickness) return;
    if (scene.material.illumination == Illumination::count)
        refuse_value("must not be 'thickness' with illumination 'count', which knows no length",
                     "/output/layer");
    if (std::holds_alternative<EnvironmentDescription>(scene.lights.front()))
        refuse_value("must not be 'thickness' where the first light is an environment",
                     "/output/layer");
}

// The layers of light on the surface and below it, and the models that carry it there.
void check_translucent(const SceneDescription& scene) {
    const Material& m = scene.material;
    const Layer layer = scene.output.picture.layer;
    const bool is_below = layer == Layer::subsurface || layer == Layer::highlight;
    if (is_below && !m.is_translucent())
        refuse_value("needs a model of subsurface scattering: material.model is 'integrated'",
                     "/output/layer");
    const bool meets_surface = m.is_translucent() || layer == Layer::irradiance;
    if (meets_surface && m.illumination == Illumination::count)
        refuse_value(m.is_translucent()
                         ? "must not be 'count' with a model of subsurface scattering"
                         : "must not be 'count' with the layer 'irradiance'",
                     "/material/illumination");
}

void check_lobe(const Highlight& highlight) {
    using enum scatter::LobeKind;
    if (highlight.lobe != ward && highlight.lobe != ashikhmin) return;
    const auto check = [](double sharpness, const char* pointer) {
        if (sharpness <= 0) refuse_value("must be above 0 with this lobe", pointer);
    };
    check(highlight.n_t, "/material/highlight/nt");
    check(highlight.n_b, "/material/highlight/nb");
}

void check_bit_depth(const OutputDescription& output) {
    const std::vector<int> allowed = bit_depths_of(output.format);
    if (std::find(allowed.begin(), allowed.end(), bit_depth_of(output)) != allowed.end()) return;
    refuse_value(fmt::format("must be {} with {}", fmt::join(allowed, " or "),
                             written(output.format, Any{}).get<std::string>()),
                 "/output/bitDepth");
}

}  // namespace

SceneDescription scene_from(const Json& tree, int max_lights) {
    const Json whole = over_preset(tree);
    SceneDescription scene;
    Reader reader(whole, "");
    reader.max_lights = max_lights;
    fields(reader, scene);
    reader.take("preset");  // taken off by over_preset; named among the known fields
    reader.finish();
    check_count(scene);
    check_thickness(scene);
    check_translucent(scene);
    check_lobe(scene.material.highlight);
    check_bit_depth(scene.output);
    return scene;
}

SceneDescription parse_scene(std::string_view json, int max_lights, const JsonLimits& limits) {
    return scene_from(parse_json(json, limits), max_lights);
}

std::string scene_json(const SceneDescription& scene) {
    return written(scene, Any{}).dump(-1, ' ', /*ensure_ascii=*/true);
}

}  // namespace relit::server
