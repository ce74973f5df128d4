#include "server/schema/scene_json.h"

#include "server/schema/presets.h"
#include "server/schema/reader.h"
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

void check_bit_depth(const OutputDescription& output) {
    const int bits = bit_depth_of(output);
    const auto check = [&](std::initializer_list<int> allowed, const char* words) {
        if (std::find(allowed.begin(), allowed.end(), bits) == allowed.end())
            refuse_value(words, "/output/bitDepth");
    };
    switch (output.format) {
        case PictureFormat::png:
            return check({8, 16}, "must be 8 or 16 with png");
        case PictureFormat::jpeg:
            return check({8}, "must be 8 with jpeg");
        case PictureFormat::webp:
            return check({8}, "must be 8 with webp");
        case PictureFormat::exr:
            return check({16, 32}, "must be 16 or 32 with exr");
    }
}

}  // namespace

SceneDescription parse_scene(std::string_view json, int max_lights) {
    const Json tree = over_preset(parse_json(json));
    SceneDescription scene;
    Reader reader(tree, "");
    reader.max_lights = max_lights;
    fields(reader, scene);
    reader.take("preset");  // taken off by over_preset; named among the known fields
    reader.finish();
    check_count(scene);
    check_thickness(scene);
    check_bit_depth(scene.output);
    return scene;
}

std::string scene_json(const SceneDescription& scene) {
    return written(scene, Any{}).dump(-1, ' ', /*ensure_ascii=*/true);
}

}  // namespace relit::server
