#include "core/render/render.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>

#include "core/image/resample.h"
#include "core/render/finish.h"
#include "core/render/prepared.h"
#include "core/render/shader.h"

namespace relit {
namespace {

// Counts finished tiles and tells the caller, one call at a time and never backwards.
class Progress {
public:
    Progress(const std::function<void(double)>& told, int tiles) : told_(told), tiles_(tiles) {}

    void tile_done() {
        if (!told_) return;
        const std::lock_guard lock(mutex_);
        told_(double(++done_) / tiles_);
    }

private:
    const std::function<void(double)>& told_;
    const int tiles_;
    int done_ = 0;
    std::mutex mutex_;
};

int channels_of(Layer layer, const HeightField& field) {
    if (is_scalar(layer)) return 1;
    return field.alpha.empty() ? 3 : 4;
}

void store(float* out, Rgb colour) {
    out[0] = stored_number(colour.r);
    out[1] = stored_number(colour.g);
    out[2] = stored_number(colour.b);
}

// A pixel of a tile and the texel that its numbers come from.
struct TilePixels {
    std::vector<TexelIndex> sources;
    std::vector<float*> out;

    template <class Value>
    void store_all(const std::vector<Value>& values) const {
        for (std::size_t k = 0; k < out.size(); ++k) {
            if constexpr (std::is_same_v<Value, Rgb>) store(out[k], values[k]);
            else *out[k] = float(values[k]);
        }
    }
    template <class Value>
    void store_each(const Value& value) const {
        for (std::size_t k = 0; k < out.size(); ++k) *out[k] = float(value(sources[k]));
    }
};

// The numbers of `layer`, without alpha.
void shade_tile(const Shader& shader, const HeightField& field, Layer layer,
                const TilePixels& pixels, const std::stop_token& stop) {
    switch (layer) {
        case Layer::beauty:
            pixels.store_all(shader.beauty(pixels.sources, stop));
            break;
        case Layer::illumination:
            pixels.store_all(shader.illumination(pixels.sources, stop));
            break;
        case Layer::thickness:
            pixels.store_all(shader.thickness(pixels.sources));
            break;
        case Layer::specular:
            pixels.store_each([&](TexelIndex at) { return shader.specular(at); });
            break;
        case Layer::scatter:
            pixels.store_each([&](TexelIndex at) { return shader.scatter(at); });
            break;
        case Layer::height:
            pixels.store_each([&](TexelIndex at) { return field.heights.at(at.i, at.j); });
            break;
        case Layer::alpha:
            pixels.store_each([&](TexelIndex at) {
                return field.alpha.empty() ? 1 : field.alpha.at(at.i, at.j);
            });
            break;
        case Layer::normal:
            for (std::size_t k = 0; k < pixels.out.size(); ++k) {
                const Vec3 n = shader.normal(pixels.sources[k]);
                store(pixels.out[k], {0.5 * n.x + 0.5, 0.5 * n.y + 0.5, 0.5 * n.z + 0.5});
            }
            break;
    }
}

// Layers that are stored, not shaded: every texel has its own number.
bool is_stored(Layer layer) { return layer == Layer::height || layer == Layer::alpha; }

EnvironmentSampling environment_sampling(const Output& output) {
    return output.accuracy == Accuracy::preview ? preview_environment : final_environment;
}

// The lights of the scene that need not be summed sample by sample.
SkyLights sky_lights(const Scene& scene, const Output& output, Rect part,
                     const RenderControl& control) {
    const Layer layer = output.layer;
    const bool beauty = layer == Layer::beauty;
    const bool data =
        layer == Layer::illumination || layer == Layer::specular || layer == Layer::scatter;
    if (!beauty && !data) return {};
    // Texels of an alpha below one half have the colour of a texel that may lie anywhere.
    if (!scene.field->alpha.empty()) part = {0, 0, scene.field->width(), scene.field->height()};
    const bool has_diffuse = beauty ? scene.material.specular.k < 1 : layer == Layer::illumination;
    const auto prepared = prepared_solid(scene, control);
    SkyLights skies;
    for (const Light& light : scene.lights) {
        skies.emplace_back();
        if ((beauty || &light == &scene.lights.front()) && SkyLight::covers(scene, light, *prepared))
            skies.back() = std::make_unique<const SkyLight>(
                scene, std::get<EnvironmentLight>(light),
                beauty ? SkyLight::Sum::colours : SkyLight::Sum::weights, has_diffuse, part,
                output.accuracy == Accuracy::preview, control);
    }
    return skies;
}

// Directions of the environment that has the fewest of them for a preview's sake, 0 if none has.
int coarse_environment(const Scene& scene, const Output& output, const SkyLights& skies) {
    if (output.accuracy != Accuracy::preview) return 0;
    int fewest = 0;
    for (std::size_t n = 0; n < scene.lights.size(); ++n) {
        const auto* environment = std::get_if<EnvironmentLight>(&scene.lights[n]);
        if (!environment) continue;
        const bool gathered =
            environment->map->texels() > std::size_t(preview_environment.max_texels);
        const int directions = !skies.empty() && skies[n] ? skies[n]->coarse_directions()
                               : gathered                 ? preview_environment.regions
                                                          : 0;
        if (directions > 0) fewest = fewest == 0 ? directions : std::min(fewest, directions);
    }
    return fewest;
}

// What is shaded at a time: squares are what packets of rays like, rows lie one after the other in
// memory.
PictureSize tile_size(const Shader& shader) {
    return shader.sends_rays() ? PictureSize{16, 16} : PictureSize{512, 1};
}

// `part` of the map shaded at its texels: colour in linear light with unassociated alpha, or data.
Image shade(const Scene& scene, const Output& output, Rect part, SkyLights skies,
            const RenderControl& control) {
    const HeightField& field = *scene.field;
    const Layer layer = output.layer;
    const Shader shader(scene, output.transfer, environment_sampling(output), control,
                        std::move(skies));
    std::shared_ptr<const NearestSolid> nearest;
    if (!field.alpha.empty() && !is_stored(layer)) nearest = nearest_solid(field, control.cache);

    Image image(part.width, part.height, channels_of(layer, field));
    const auto pixels_of = [&](Rect tile) {
        TilePixels pixels;
        for (int y = tile.y; y < tile.y + tile.height; ++y)
            for (int x = tile.x; x < tile.x + tile.width; ++x) {
                const int i = part.x + x, j = part.y + y;
                const float alpha = field.alpha.empty() ? 1 : field.alpha.at(i, j);
                if (alpha == 0) continue;  // colour and data are 0
                float* out = &image.row(y)[std::size_t(x) * image.channels];
                if (image.channels == 4) out[3] = alpha;
                std::optional<TexelIndex> source = TexelIndex{i, j};
                if (nearest && !field.is_solid(i, j)) source = nearest->find(i, j);
                if (!source) continue;
                pixels.sources.push_back(*source);
                pixels.out.push_back(out);
            }
        return pixels;
    };
    const PictureSize size = tile_size(shader);
    const bool by_rows = layer == Layer::beauty && field.alpha.empty() && !shader.sends_rays();
    const int across = (part.width + size.width - 1) / size.width;
    const int down = (part.height + size.height - 1) / size.height;
    Progress progress(control.progress, across * down);
    parallel_rows(control.executor, across * down, control.stop, [&](RowRange tiles) {
        for (int n = tiles.begin; n < tiles.end; ++n) {
            const int x = n % across * size.width, y = n / across * size.height;
            const Rect tile{x, y, std::min(size.width, part.width - x),
                            std::min(size.height, part.height - y)};
            if (by_rows)
                shader.beauty_row(part.x + x, part.y + y, tile.width,
                                  &image.row(y)[std::size_t(x) * 3]);
            else shade_tile(shader, field, layer, pixels_of(tile), control.stop);
            progress.tile_done();
        }
    });
    return image;
}

// Thickness has no upper end: integer files hold it cut at 1.
void cut_thickness(Image& image) {
    for (float& r : image.values) r = std::min(r, 1.0f);
}

Image resized(Image image, Rect window, PictureSize size, const RenderControl& control) {
    if (window == Rect{0, 0, size.width, size.height} && image.width == size.width &&
        image.height == size.height)
        return image;
    associate_alpha(image);
    image = resample(image, window, size.width, size.height, control.executor, control.stop);
    if (image.channels == 4)
        for (std::size_t n = 3; n < image.values.size(); n += 4)
            image.values[n] = std::clamp(image.values[n], 0.0f, 1.0f);  // bicubic overshoot
    unassociate_alpha(image);
    for (float& v : image.values) v = std::max(v, 0.0f);
    return image;
}

// A preview may shade fewer texels where the whole map is asked for at a smaller size of its own
// shape.
bool may_shade_smaller_map(const Scene& scene, const Output& output, PictureSize size) {
    const HeightField& field = *scene.field;
    const bool same_shape =
        size.height == picture_size({.width = size.width}, field.width(), field.height()).height;
    return output.accuracy == Accuracy::preview && !output.region && same_shape &&
           size.width < field.width() && size.height < field.height();
}

Image render_part(const Scene& scene, const Output& output, PictureSize size,
                  const RenderControl& control, int& coarse_directions) {
    const HeightField& field = *scene.field;
    const Rect window = output.region.value_or(Rect{0, 0, field.width(), field.height()});
    assert(window.x >= 0 && window.y >= 0 && window.x + window.width <= field.width() &&
           window.y + window.height <= field.height());
    const Rect part =
        resample_support(window, size.width, size.height, field.width(), field.height());
    SkyLights skies = sky_lights(scene, output, part, control);
    coarse_directions = coarse_environment(scene, output, skies);
    Image image = shade(scene, output, part, std::move(skies), control);
    if (output.layer == Layer::thickness && !output.linear) cut_thickness(image);
    const Rect window_in_part{window.x - part.x, window.y - part.y, window.width, window.height};
    return resized(std::move(image), window_in_part, size, control);
}

}  // namespace

Picture render(const Scene& scene, const Output& output, const RenderControl& control) {
    const PictureSize size = picture_size(output, scene.field->width(), scene.field->height());
    Picture picture;
    picture.coarse_map = may_shade_smaller_map(scene, output, size);
    if (picture.coarse_map) {
        const Scene small{
            .field = smaller_shared_field(*scene.field, size.width, size.height, control),
            .relief = scene.relief,
            .base = scene.base,
            .normal_scale = scene.normal_scale,
            .lights = scene.lights,
            .material = scene.material};
        picture.pixels = render_part(small, output, size, control, picture.coarse_environment);
    } else {
        picture.pixels = render_part(scene, output, size, control, picture.coarse_environment);
    }
    if (output.layer == Layer::beauty)
        finish_beauty(picture.pixels, output, control.executor, control.stop);
    else finish_data(picture.pixels, output);
    return picture;
}

}  // namespace relit
