#include "server/scenes/scene_loading.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>

#include "core/image/channels.h"
#include "core/io/decode.h"
#include "core/render/sky_light.h"
#include "server/error_codes.h"
#include "server/scenes/scene_cost.h"
#include "server/schema/field_error.h"

namespace relit::server {
namespace {

bool is_unsigned_integer(SampleType type) {
    return type == SampleType::uint8 || type == SampleType::uint16 || type == SampleType::uint32;
}

// Runs `step`; an Error that names no field yet is about this image.
template <class Step>
auto blaming(const ImageSource& source, const Step& step) {
    try {
        return step();
    } catch (const Error& e) {
        throw Error(e.code, e.what(), e.pointer.empty() ? source.pointer : e.pointer, e.limit);
    }
}

// An image that a scene names, and its bytes.
struct FoundImage {
    ImageSource source;
    SharedBytes bytes;

    // Its part in the name of what is made of it.
    [[nodiscard]] std::string key() const {
        return fmt::format("{}:{}", int(source.kind), source.text);
    }
};

FoundImage found(const ImageSource& source, const FindImage& find) {
    return blaming(source, [&] { return FoundImage{source, find(source)}; });
}

std::optional<FoundImage> found(const std::optional<ImageSource>& source, const FindImage& find) {
    if (!source) return std::nullopt;
    return found(*source, find);
}

std::string key_of(const std::optional<FoundImage>& image) { return image ? image->key() : ""; }

DecodedImage decoded(const FoundImage& image, const DecodeImage& decode) {
    return blaming(image.source, [&] { return decode(image.bytes); });
}

// Integer colour images are sRGB-encoded, unless every number is to be used as it is.
bool is_encoded(const DecodedImage& image, Transfer transfer) {
    return is_unsigned_integer(image.info.type) && transfer == Transfer::srgb;
}

// A colour image with its colour by itself; finite, since light and albedo have to be.
DecodedImage decoded_colour(const FoundImage& found, const DecodeImage& decode) {
    DecodedImage image = decoded(found, decode);
    if (!std::all_of(image.image.values.begin(), image.image.values.end(),
                     [](float v) { return std::isfinite(v); }))
        refuse_value("has texels that are not finite numbers", found.source.pointer);
    if (image.info.associated) divide_by_alpha(image.image);
    return image;
}

// The images of a height field.
struct FieldImages {
    FoundImage height;
    std::optional<FoundImage> alpha;
    std::optional<FoundImage> albedo;
    std::optional<FoundImage> bump;
};

HeightField height_field(const FieldImages& images, Transfer transfer, const DecodeImage& decode,
                         const Executor& executor) {
    DecodedImage heights = decoded(images.height, decode);
    HeightField field = blaming(images.height.source, [&] {
        return height_field_from(std::move(heights.image), heights.info.has_alpha,
                                 is_unsigned_integer(heights.info.type));
    });
    if (images.alpha) {
        DecodedImage alpha = decoded(*images.alpha, decode);
        set_alpha(field, std::move(alpha.image), alpha.info.has_alpha, executor);
    }
    if (images.bump) {
        DecodedImage bump = decoded(*images.bump, decode);
        blaming(images.bump->source, [&] {
            set_bump(field, std::move(bump.image), bump.info.has_alpha,
                     is_unsigned_integer(bump.info.type), executor);
        });
    }
    if (images.albedo) {
        const DecodedImage albedo = decoded_colour(*images.albedo, decode);
        set_albedo(field, albedo.image, albedo.info.has_alpha, is_encoded(albedo, transfer),
                   executor);
    }
    return field;
}

std::uint64_t bytes_of(const Image& image) { return image.values.size() * sizeof(float); }

std::shared_ptr<const HeightField> shared_field(const SceneDescription& description,
                                                const FindImage& find, const DecodeImage& decode,
                                                const Executor& executor, SharedCache& cache) {
    const FieldImages images{found(description.height, find), found(description.alpha, find),
                             found(description.albedo, find), found(description.bump, find)};
    const Transfer transfer = description.output.picture.transfer;
    const std::string shape_key = fmt::format("shape {} {} {}", images.height.key(),
                                              key_of(images.alpha), key_of(images.bump));
    const std::string key = fmt::format("field {} {} {}", shape_key, key_of(images.albedo),
                                        images.albedo ? int(transfer) : 0);
    return cache.get<HeightField>(key, [&] {
        auto field =
            std::make_shared<HeightField>(height_field(images, transfer, decode, executor));
        field->key = key;
        field->shape_key = shape_key;
        const std::uint64_t bytes = bytes_of(field->heights) + bytes_of(field->alpha) +
                                    bytes_of(field->albedo) + bytes_of(field->bump);
        return SharedCache::Made<HeightField>{std::move(field), bytes};
    });
}

Image environment_map(const FoundImage& found, Transfer transfer, const DecodeImage& decode,
                      const Limits& limits) {
    const DecodedImage image = decoded_colour(found, decode);
    if (std::int64_t(image.info.width) * image.info.height > limits.max_environment_pixels)
        throw Error(error_code::image_too_large,
                    fmt::format("the environment is {} x {} pixels; the limit is {} pixels "
                                "(max-environment-pixels)",
                                image.info.width, image.info.height, limits.max_environment_pixels),
                    found.source.pointer, "max-environment-pixels");
    Image map = rgb_channels(image.image, image.info.has_alpha);
    if (is_encoded(image, transfer)) decode_srgb(map);
    // Filters leave small negative numbers at bright edges; there is no negative light.
    for (float& v : map.values) v = std::max(v, 0.0f);
    return map;
}

std::shared_ptr<const Image> shared_environment(const std::string& key, const FoundImage& image,
                                                Transfer transfer, const DecodeImage& decode,
                                                const Limits& limits, SharedCache& cache) {
    return cache.get<Image>(key, [&] {
        auto map = std::make_shared<const Image>(environment_map(image, transfer, decode, limits));
        const std::uint64_t bytes = bytes_of(*map);
        return SharedCache::Made<Image>{std::move(map), bytes};
    });
}

Light light_from(const LightDescription& description, Transfer transfer, const FindImage& find,
                 const DecodeImage& decode, const Limits& limits, SharedCache& cache) {
    if (const auto* point = std::get_if<PointLight>(&description)) return *point;
    if (const auto* sun = std::get_if<DirectionalLight>(&description)) return *sun;
    const auto& environment = std::get<EnvironmentDescription>(description);
    EnvironmentLight light = environment.light;
    const FoundImage image = found(environment.image, find);
    light.map_key = fmt::format("environment {} {}", image.key(), int(transfer));
    light.map = shared_environment(light.map_key, image, transfer, decode, limits, cache);
    return light;
}

void check_region(const Output& output, int map_width, int map_height) {
    if (!output.region) return;
    const Rect r = *output.region;
    if (r.x + r.width > map_width || r.y + r.height > map_height)
        refuse_value(fmt::format("reaches beyond the map of {} x {} texels", map_width, map_height),
                     "/output/region");
}

// Noise makes environments dearer. Looking at all of the map is for those scenes alone that would be too
// dear then.
void check_noise(const SceneDescription& description, const Scene& scene, const Limits& limits) {
    const int width = scene.field->width(), height = scene.field->height();
    const double worst = scene_cost(description, width, height, /*is_noise=*/true).texel_samples;
    if (worst > double(limits.max_scene_cost) && SkyLight::is_noise(scene))
        check_cost(description, width, height, limits, /*is_noise=*/true);
}

void check_size(const OutputDescription& output, int map_width, int map_height,
                const Limits& limits) {
    const PictureSize size = picture_size(output.picture, map_width, map_height);
    if (std::int64_t(size.width) * size.height > limits.max_output_pixels)
        throw Error(
            error_code::invalid_value,
            fmt::format(
                "the picture would be {} x {} pixels; the limit is {} pixels (max-output-pixels)",
                size.width, size.height, limits.max_output_pixels),
            output.picture.width ? "/output/width" : "/output/height", "max-output-pixels");
    const int longest = std::max(size.width, size.height);
    if (longest > max_side_of(output.format))
        throw Error(error_code::invalid_value,
                    fmt::format("the picture would be {} pixels long; this format holds {} at most",
                                longest, max_side_of(output.format)),
                    "/output/format");
}

}  // namespace

void check_output(const OutputDescription& output, int map_width, int map_height,
                  const Limits& limits) {
    check_region(output.picture, map_width, map_height);
    check_size(output, map_width, map_height, limits);
}

Scene load_scene(const SceneDescription& description, const FindImage& find,
                 const DecodeImage& decode, const Limits& limits, const Executor& executor,
                 SharedCache& cache) {
    Scene scene;
    scene.field = shared_field(description, find, decode, executor, cache);
    check_output(description.output, scene.field->width(), scene.field->height(), limits);
    check_cost(description, scene.field->width(), scene.field->height(), limits);
    scene.relief = description.relief;
    scene.bump_relief = description.bump_relief;
    scene.base = description.base;
    scene.normal_scale = description.normal_scale;
    scene.material = description.material;
    scene.lights.clear();
    for (const LightDescription& light : description.lights)
        scene.lights.push_back(
            light_from(light, description.output.picture.transfer, find, decode, limits, cache));
    check_noise(description, scene, limits);
    return scene;
}

Output picture_output(const OutputDescription& output) {
    Output picture = output.picture;
    picture.linear = output.format == PictureFormat::exr;
    // JPEG has no alpha: what shines through is black.
    if (output.format == PictureFormat::jpeg && !picture.background)
        picture.background = hex_colour(0, 0, 0);
    return picture;
}

EncodeOptions encode_options(const OutputDescription& output, std::string scene_text) {
    EncodeOptions options;
    options.format = output.format;
    options.bit_depth = bit_depth_of(output);
    options.quality = output.quality;
    options.effort = output.effort;
    options.srgb =
        output.picture.layer == Layer::beauty && output.picture.transfer == Transfer::srgb;
    options.text = {{"relit-scene", std::move(scene_text)}};
    return options;
}

}  // namespace relit::server
