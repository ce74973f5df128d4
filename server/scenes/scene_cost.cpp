#include "server/scenes/scene_cost.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "core/render/render.h"
#include "server/error_codes.h"

namespace relit::server {
namespace {

// Measured against a ray: a step of the thesis's count is half of one, the transfer of an environment
// at infinity takes as long as 12 samples of it.
constexpr double rays_per_step = 0.5;
constexpr double transfer_samples = 12;
// Carrying light below a surface, all colours together.
constexpr double final_transport = 150, preview_transport = 10;
constexpr double final_directional_transport = 500;
constexpr double usual_texels = 1 << 20;

// Bytes a texel of the map. The heights as they are decoded; as rows and as columns that rays cross,
// and bounds of them; a mask, what it adds to these, and where its nearest texels are.
constexpr double bytes_of_heights = 4, bytes_of_solid = 9, bytes_of_mask = 4, bytes_of_albedo = 12;
constexpr double bytes_of_masked_solid = 10;
// For an environment, of each half of it, and while that is made.
constexpr double bytes_of_transfer = 112, bytes_of_sky_levels = 22;
// Light on the surface and what carries it.
constexpr double bytes_of_transport = 180, bytes_of_directional = 400;
// Bytes a pixel: of files that are written band by band, and of those that are not.
constexpr double bytes_of_written_pixel = 4, bytes_of_whole_pixel = 28;

// A factor of the cost and the field it comes from.
struct Factor {
    double times = 1;
    std::string field;
};

struct Light {
    double samples = 1;
    std::string field;  // empty: of no weight of its own
};

// As SkyLight::covers() decides, as far as the description tells.
bool has_transfer(const SceneDescription& scene, const EnvironmentLight& light) {
    const Material& material = scene.material;
    const double floor = scene.base.kind == Base::Kind::level ? scene.base.level : -material.depth;
    return !light.radius && material.illumination != Illumination::count &&
           !(material.specular.k > 0 && material.specular.occlude) && floor <= -material.depth &&
           scene.relief - floor <= 600 * material.depth;
}

Light light_of(const SceneDescription& scene, const LightDescription& description, bool is_noise) {
    const auto* const environment = std::get_if<EnvironmentDescription>(&description);
    if (!environment) return {};
    // Of "/lights/3/image/data" the light.
    const std::string& image = environment->image.pointer;
    const std::string field = image.substr(0, image.find("/image"));
    if (!is_noise && has_transfer(scene, environment->light)) return {transfer_samples, field};
    const bool preview = scene.output.picture.accuracy == Accuracy::preview;
    return {double((preview ? preview_environment : final_environment).regions), field};
}

// Whether all lights are looked at from all of the map, for what is carried below its surface.
bool shows_light_below(const SceneDescription& scene) {
    const Layer layer = scene.output.picture.layer;
    if (layer == Layer::irradiance || layer == Layer::subsurface || layer == Layer::highlight)
        return true;
    return layer == Layer::beauty && scene.material.is_translucent();
}

// What all lights of the layer take together.
Factor lights_of(const SceneDescription& scene, bool is_noise) {
    const Layer layer = scene.output.picture.layer;
    if (layer == Layer::normal || layer == Layer::height || layer == Layer::alpha)
        return {.times = 0, .field = "/output/layer"};
    const bool of_all = layer == Layer::beauty || shows_light_below(scene);  // else of the first
    const std::size_t count = of_all ? scene.lights.size() : 1;
    Factor all{.times = 0, .field = "/lights"};
    Light heaviest;
    for (std::size_t i = 0; i < count; ++i) {
        const Light light = light_of(scene, scene.lights[i], is_noise);
        all.times += light.samples;
        if (light.samples > heaviest.samples) heaviest = light;
    }
    if (heaviest.samples > all.times / 2 && !heaviest.field.empty()) all.field = heaviest.field;
    return all;
}

// Which sums below the surface the layer shows.
struct Carried {
    bool scattering = false, highlights = false;
};

Carried carried_by(const SceneDescription& scene) {
    const Material& m = scene.material;
    const Layer layer = scene.output.picture.layer;
    if (!shows_light_below(scene) || !m.is_translucent()) return {};
    const bool is_beauty = layer == Layer::beauty;
    const bool are_carried =
        m.highlight.k > 0 && m.highlight.transport == HighlightTransport::subsurface;
    return {.scattering = layer == Layer::subsurface || (is_beauty && m.bssrdf_weight > 0),
            .highlights = are_carried && (is_beauty || layer == Layer::highlight)};
}

// What carries light below the surface takes.
Factor transport_of(const SceneDescription& scene) {
    const bool is_preview = scene.output.picture.accuracy == Accuracy::preview;
    const bool is_directional = scene.material.model == Model::directional_dipole;
    const double highlights = is_preview ? preview_transport : final_transport;
    const double scattering =
        is_directional && !is_preview ? final_directional_transport : highlights;
    const Carried carried = carried_by(scene);
    return {.times = int(carried.scattering) * scattering + int(carried.highlights) * highlights,
            .field = "/material/model"};
}

// A count is as dear as its steps are many; a march that solves for its crossings knows none.
Factor steps_of(const Material& material) {
    if (material.illumination != Illumination::count) return {.times = 1, .field = {}};
    return {.times = std::max(1.0, rays_per_step * material.steps), .field = "/material/steps"};
}

Factor texels_of(const SceneDescription& scene, int map_width, int map_height) {
    const Output& output = scene.output.picture;
    const PictureSize size = picture_size(output, map_width, map_height);
    const Rect part = output.region.value_or(Rect{0, 0, map_width, map_height});
    const bool of_all = shows_light_below(scene);
    const double texels =
        of_all ? double(map_width) * map_height : double(part.width) * part.height;
    const double pixels = double(size.width) * size.height;
    const bool is_smaller = output.accuracy == Accuracy::preview && !(of_all && output.region);
    return {.times = is_smaller ? std::min(texels, pixels) : texels,
            .field = output.region && !of_all ? "/output/region" : "/height"};
}

// Resampling and writing, where a picture is larger than what it is made of.
Factor pixels_of(const SceneDescription& scene, int map_width, int map_height) {
    const Output& output = scene.output.picture;
    const PictureSize size = picture_size(output, map_width, map_height);
    return {.times = double(size.width) * size.height,
            .field = output.width ? "/output/width" : "/output/height"};
}

}  // namespace

SceneCost scene_cost(const SceneDescription& scene, int map_width, int map_height, bool is_noise) {
    const Factor texels = texels_of(scene, map_width, map_height);
    Factor lights = lights_of(scene, is_noise);
    const Factor transport = transport_of(scene), steps = steps_of(scene.material);
    if (transport.times > lights.times) lights.field = transport.field;
    lights.times += transport.times;
    const Factor pixels = pixels_of(scene, map_width, map_height);
    const double marched = texels.times * lights.times * steps.times;
    const double added = pixels.times > texels.times ? pixels.times : 0;
    if (added > marched) return {marched + added, pixels.field};
    const Factor unusual[] = {{texels.times / usual_texels, texels.field}, lights, steps};
    const auto heaviest =
        std::max_element(std::begin(unusual), std::end(unusual),
                         [](const Factor& a, const Factor& b) { return a.times < b.times; });
    return {marched + added, heaviest->field};
}

SceneMemory scene_memory(const SceneDescription& scene, int map_width, int map_height) {
    const Output& output = scene.output.picture;
    const double texels = double(map_width) * map_height;
    const Rect part = output.region.value_or(Rect{0, 0, map_width, map_height});
    const PictureSize size = picture_size(output, map_width, map_height);
    const double pixels = double(size.width) * size.height;
    const bool is_smaller = output.accuracy == Accuracy::preview && !output.region;
    const double shaded = is_smaller ? std::min(texels, pixels) : texels;

    double of_map = bytes_of_heights * texels;
    if (scene.alpha) of_map += bytes_of_mask * texels;
    if (scene.albedo) of_map += bytes_of_albedo * texels;
    if (scene.bump) of_map += bytes_of_heights * texels;
    of_map += bytes_of_solid * shaded;
    if (scene.alpha) of_map += bytes_of_masked_solid * shaded;

    double of_light = 0;
    std::string light_field;
    const double lit = std::min(shaded, double(part.width) * part.height);
    for (const LightDescription& description : scene.lights) {
        const auto* const environment = std::get_if<EnvironmentDescription>(&description);
        if (!environment || !has_transfer(scene, environment->light)) continue;
        const int halves = scene.base.kind == Base::Kind::none ? 1 : 2;
        of_light = bytes_of_sky_levels * shaded +
                   halves * bytes_of_transfer * (scene.alpha ? shaded : lit);
        light_field = light_of(scene, description, /*is_noise=*/false).field;
    }
    const double of_transport =
        shows_light_below(scene)
            ? shaded * (scene.material.model == Model::directional_dipole ? bytes_of_directional
                                                                          : bytes_of_transport)
            : 0;
    const bool is_whole =
        scene.output.format == PictureFormat::exr || scene.output.format == PictureFormat::webp;
    const double of_picture = pixels * (is_whole ? bytes_of_whole_pixel : bytes_of_written_pixel);

    const std::pair<double, std::string> parts[] = {
        {of_map, "/height"},
        {of_light, light_field},
        {of_transport, "/material/model"},
        {of_picture, output.width || !output.height ? "/output/width" : "/output/height"}};
    const auto& largest = *std::max_element(std::begin(parts), std::end(parts));
    return {of_map + of_light + of_transport + of_picture, largest.second};
}

void check_cost(const SceneDescription& scene, int map_width, int map_height, const Limits& limits,
                bool is_noise) {
    const SceneCost cost = scene_cost(scene, map_width, map_height, is_noise);
    if (cost.texel_samples > double(limits.max_scene_cost))
        throw Error(
            error_code::too_costly,
            fmt::format("the picture would take about {:.0f} texel-samples; the limit is {} "
                        "(max-scene-cost)",
                        cost.texel_samples, limits.max_scene_cost),
            cost.heaviest, "max-scene-cost");
    const SceneMemory memory = scene_memory(scene, map_width, map_height);
    if (memory.bytes > double(limits.max_render_memory_bytes))
        throw Error(error_code::too_costly,
                    fmt::format("the picture would take about {:.0f} bytes of memory; the limit is "
                                "{} (max-render-memory)",
                                memory.bytes, limits.max_render_memory_bytes),
                    memory.largest, "max-render-memory");
}

}  // namespace relit::server
