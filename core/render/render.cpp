#include "core/render/render.h"

#include <algorithm>
#include <optional>

#include "core/image/resample.h"
#include "core/render/finish.h"
#include "core/render/prepared.h"
#include "core/render/shade.h"

namespace relit {
namespace {

// Layers that are stored, not shaded: every texel has its own number.
bool is_stored(Layer layer) { return layer == Layer::height || layer == Layer::alpha; }

// The lights of the scene that need not be summed sample by sample.
SkyLights sky_lights(const Scene& scene, const Output& output, Rect part,
                     const PreparedSolid& prepared, const RenderControl& control) {
    const Layer layer = output.layer;
    const bool beauty = layer == Layer::beauty;
    const bool data =
        layer == Layer::illumination || layer == Layer::specular || layer == Layer::scatter;
    if (!beauty && !data) return {};
    // Texels of an alpha below one half have the colour of a texel that may lie anywhere.
    if (!scene.field->alpha.empty()) part = {0, 0, scene.field->width(), scene.field->height()};
    const bool has_diffuse = beauty
                                 ? scene.material.specular.k < 1 && !scene.material.is_translucent()
                                 : layer == Layer::illumination;
    SkyLights skies;
    for (const Light& light : scene.lights) {
        skies.emplace_back();
        if ((beauty || &light == &scene.lights.front()) && SkyLight::covers(scene, light, prepared))
            skies.back() = std::make_unique<const SkyLight>(
                scene, std::get<EnvironmentLight>(light), prepared,
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

// Thickness has no upper end: integer files hold it cut at 1.
void cut_thickness(Image& image) {
    for (float& r : image.values) r = std::min(r, 1.0f);
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

Scene smaller(const Scene& scene, PictureSize size, const RenderControl& control) {
    return {.field = smaller_shared_field(*scene.field, size.width, size.height, control),
            .relief = scene.relief,
            .bump_relief = scene.bump_relief,
            .base = scene.base,
            .normal_scale = scene.normal_scale,
            .lights = scene.lights,
            .material = scene.material};
}

}  // namespace

// Everything that all rows have in common.
struct Rendering::Prepared {
    const Scene scene;  // of the map that is shaded
    const Output output;
    const RenderControl control;
    const PictureSize size;
    const Rect window, part;  // of the map: what is asked for, and what that is made of
    const bool is_own_size, finish;
    PictureFacts facts;
    std::shared_ptr<const PreparedSolid> solid = prepared_solid(scene, control);
    std::shared_ptr<const NearestSolid> nearest;
    TranslucentLight translucent;
    std::optional<Shader> shader;
    mutable Progress progress{control.progress};

    Prepared(Scene shaded, const Output& wanted, PictureSize picture, const RenderControl& how)
        : scene(std::move(shaded)),
          output(wanted),
          control(how),
          size(picture),
          window(output.region.value_or(Rect{0, 0, scene.field->width(), scene.field->height()})),
          part(resample_support(window, size.width, size.height, scene.field->width(),
                                scene.field->height())),
          is_own_size(part == window && size.width == window.width && size.height == window.height),
          finish(output.layer == Layer::beauty && is_own_size &&
                 is_finished_by_colours(output, !scene.field->alpha.empty())) {
        const HeightField& field = *scene.field;
        assert(window.x >= 0 && window.y >= 0 && window.x + window.width <= field.width() &&
               window.y + window.height <= field.height());
        if (!field.alpha.empty() && !is_stored(output.layer))
            nearest = nearest_solid(field, control.cache);
        SkyLights skies = sky_lights(scene, output, part, *solid, control);
        facts.coarse_environment = coarse_environment(scene, output, skies);
        translucent = translucent_light(scene, output, *solid, control);
        if (translucent.coarse_directions > 0)
            facts.coarse_environment = translucent.coarse_directions;
        facts.coarse_transport = translucent.is_coarse;
        shader.emplace(scene, output.transfer, environment_sampling(output), control,
                       std::move(skies), solid, &translucent);
        const int shaded_as = shaded_channels(output.layer, field);
        facts.width = size.width;
        facts.height = size.height;
        facts.channels = shaded_as == 4 && output.background ? 3 : shaded_as;
    }

    [[nodiscard]] Image resized(Image image, const ResampledRows& rows) const {
        associate_alpha(image);
        const Rect in_part{window.x - part.x, window.y - part.y, window.width, window.height};
        image =
            resample(image, rows, in_part, size.width, size.height, control.executor, control.stop);
        if (image.channels == 4)
            for (std::size_t n = 3; n < image.values.size(); n += 4)
                image.values[n] = std::clamp(image.values[n], 0.0f, 1.0f);  // bicubic overshoot
        unassociate_alpha(image);
        for (float& v : image.values) v = std::max(v, 0.0f);
        return image;
    }

    // Of a picture that is smaller than its map: so that its texels are not all there as floats.
    [[nodiscard]] int rows_at_once() const {
        if (is_own_size) return size.height;
        constexpr double most_bytes = 24 << 20;
        const double map_rows = std::max(1.0, double(window.height) / size.height);
        const double row_bytes =
            map_rows * part.width * sizeof(float) * shaded_channels(output.layer, *scene.field);
        return std::max(1, int(std::min<double>(most_bytes / row_bytes, size.height)));
    }

    [[nodiscard]] Image finished_rows(RowRange rows) const {
        const RowRange read = reads(rows);
        Image image = shade({*scene.field, *shader, output, nearest.get(), finish},
                            {part.x, part.y + read.begin, part.width, read.end - read.begin},
                            double(rows.end) / size.height, control, progress);
        const bool is_beauty = output.layer == Layer::beauty;
        if (output.layer == Layer::thickness && !output.linear) cut_thickness(image);
        if (!is_own_size) image = resized(std::move(image), {rows, read.begin, part.height});
        if (is_beauty && !finish) finish_beauty(image, output, control.executor, control.stop);
        if (!is_beauty) finish_data(image, output);
        return image;
    }

    // Rows of `part` that those of the picture are made of.
    [[nodiscard]] RowRange reads(RowRange rows) const {
        if (is_own_size) return rows;
        const Rect in_part{0, window.y - part.y, 1, window.height};
        return resample_reads(rows, in_part, size.height, part.height);
    }
};

Rendering::Rendering(const Scene& scene, const Output& output, const RenderControl& control) {
    const PictureSize size = picture_size(output, scene.field->width(), scene.field->height());
    const bool coarse_map = may_shade_smaller_map(scene, output, size);
    auto prepared = std::make_unique<Prepared>(coarse_map ? smaller(scene, size, control) : scene,
                                               output, size, control);
    prepared->facts.coarse_map = coarse_map;
    prepared_ = std::move(prepared);
}

Rendering::~Rendering() = default;

const PictureFacts& Rendering::facts() const { return prepared_->facts; }

Image Rendering::rows(RowRange rows) const {
    const Prepared& p = *prepared_;
    assert(0 <= rows.begin && rows.begin < rows.end && rows.end <= p.size.height);
    const int step = p.rows_at_once();
    if (rows.end - rows.begin <= step) return p.finished_rows(rows);
    Image all(p.facts.width, rows.end - rows.begin, p.facts.channels);
    for (int y = rows.begin; y < rows.end; y += step) {
        const Image some = p.finished_rows({y, std::min(y + step, rows.end)});
        std::copy(some.values.begin(), some.values.end(), all.row(y - rows.begin).begin());
    }
    return all;
}

Picture render(const Scene& scene, const Output& output, const RenderControl& control) {
    const Rendering rendering(scene, output, control);
    return {rendering.facts(), rendering.rows({0, rendering.facts().height})};
}

}  // namespace relit
