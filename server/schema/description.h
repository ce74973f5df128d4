// A scene as a client describes it: plain data with the interface's defaults, images named but not
// loaded. Between JSON (scene_json.h) and the renderer's Scene (scene_loading.h). Source: api.md,
// "A scene".
#pragma once

#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/field/solid.h"
#include "core/io/encode.h"
#include "core/light/light.h"
#include "core/render/output.h"
#include "core/shade/material.h"

namespace relit::server {

/// Where the bytes of an image are.
struct ImageSource {
    enum class Kind {
        image,  ///< stored: `text` is its id
        data,   ///< in the scene: `text` is base64
        part,   ///< in the same multipart request: `text` is the part's name
    };
    Kind kind = Kind::image;
    std::string text;
    std::string pointer{};  ///< where it stood in the scene, for errors about what is in it (RFC 6901)
};

struct EnvironmentDescription {
    ImageSource image;
    EnvironmentLight light;  ///< its map is loaded later
};

using LightDescription = std::variant<PointLight, DirectionalLight, EnvironmentDescription>;

struct OutputDescription {
    Output picture;
    PictureFormat format = PictureFormat::png;
    std::optional<int> bit_depth;  ///< none: 8, exr 32
    int quality = 85;
    Effort effort = Effort::fast;
};

struct SceneDescription {
    ImageSource height;
    std::optional<ImageSource> alpha;
    std::optional<ImageSource> albedo;
    std::optional<ImageSource> bump;
    double bump_relief = 0.01;
    double relief = 0.15;
    Base base;
    double normal_scale = 1;
    std::vector<LightDescription> lights{PointLight{}};  ///< at least one
    Material material;
    OutputDescription output;
};

/// Calls `visit(ImageSource&)` for every image that the scene names, in the order of its fields.
template <class Scene, class Visit>
void for_each_image(Scene& scene, const Visit& visit) {
    visit(scene.height);
    if (scene.alpha) visit(*scene.alpha);
    if (scene.albedo) visit(*scene.albedo);
    if (scene.bump) visit(*scene.bump);
    for (auto& light : scene.lights)
        if (auto* environment = std::get_if<EnvironmentDescription>(&light))
            visit(environment->image);
}

/// Bits per number of the picture's file.
[[nodiscard]] inline int bit_depth_of(const OutputDescription& output) {
    return output.bit_depth.value_or(output.format == PictureFormat::exr ? 32 : 8);
}

}  // namespace relit::server
