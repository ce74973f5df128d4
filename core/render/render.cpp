#include "core/render/render.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
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

// The pixels of a tile and the texels that their numbers come from.
class TilePixels {
public:
    void add(TexelIndex source, float* pixel) {
        sources_[size_] = source;
        out_[size_++] = pixel;
    }
    /// `count` texels side by side from `source` on, and their pixels of so many channels.
    void add_row(TexelIndex source, float* pixels, int count, int channels) {
        for (int k = 0; k < count; ++k) {
            sources_[size_ + k] = {source.i + k, source.j};
            out_[size_ + k] = pixels + std::size_t(k) * channels;
        }
        size_ += count;
    }
    [[nodiscard]] int size() const { return size_; }
    [[nodiscard]] std::span<const TexelIndex> sources() const {
        return {sources_.data(), std::size_t(size_)};
    }
    /// Null: a texel that only fills up the square.
    [[nodiscard]] float*& out(int k) { return out_[k]; }
    [[nodiscard]] float* out(int k) const { return out_[k]; }

private:
    int size_ = 0;
    std::array<TexelIndex, RayTile::max_rays> sources_;
    std::array<float*, RayTile::max_rays> out_;
};

// One channel after the other. What is beyond all floats is the largest.
void store(const TilePixels& pixels, std::span<const float> values) {
    const auto stored = [](float value) {
        return std::min(value, std::numeric_limits<float>::max());
    };
    const std::size_t size = pixels.size(), channels = values.size() / size;
    for (std::size_t k = 0; k < size; ++k) {
        float* out = pixels.out(int(k));
        if (!out) continue;
        for (std::size_t c = 0; c < channels; ++c) out[c] = stored(values[c * size + k]);
    }
}

// A grey picture is finished once for all three channels.
void finish_triples(std::span<float> triples, const Output& output) {
    const std::size_t size = triples.size() / 3;
    const std::span<float> red = triples.first(size), green = triples.subspan(size, size),
                           blue = triples.last(size);
    if (!std::equal(red.begin(), red.end(), green.begin()) ||
        !std::equal(red.begin(), red.end(), blue.begin()))
        return finish_colours(triples, output);
    finish_colours(red, output);
    std::copy(red.begin(), red.end(), green.begin());
    std::copy(red.begin(), red.end(), blue.begin());
}

// The numbers of the output's layer, without alpha.
// @param finish  beauty is finished at once
void shade_tile(const Shader& shader, const HeightField& field, const Output& output, bool finish,
                const TilePixels& pixels, const std::stop_token& stop) {
    alignas(64) std::array<float, 3 * std::size_t(RayTile::max_rays)> values;
    const std::span<const TexelIndex> texels = pixels.sources();
    const std::span<float> numbers(values.data(), texels.size());
    const std::span<float> triples(values.data(), 3 * texels.size());
    const auto fill = [&](const Image& image) {
        for (std::size_t k = 0; k < texels.size(); ++k)
            numbers[k] = image.empty() ? 1 : image.at(texels[k].i, texels[k].j);
    };
    switch (output.layer) {
        case Layer::beauty:
            shader.beauty(texels, stop, triples);
            if (finish) finish_triples(triples, output);
            return store(pixels, triples);
        case Layer::normal:
            shader.normal(texels, triples);
            for (float& v : triples) v = 0.5f * v + 0.5f;
            return store(pixels, triples);
        case Layer::illumination:
            shader.illumination(texels, stop, numbers);
            break;
        case Layer::thickness:
            shader.thickness(texels, numbers);
            for (int k = 0; k < pixels.size(); ++k)
                if (pixels.out(k)) *pixels.out(k) = numbers[k];
            return;  // endless stays endless
        case Layer::specular:
            shader.specular(texels, numbers);
            break;
        case Layer::scatter:
            shader.scatter(texels, numbers);
            break;
        case Layer::irradiance:
        case Layer::subsurface:
        case Layer::highlight:
            shader.surface_layer(texels, triples);
            return store(pixels, triples);
        case Layer::height:
            fill(field.heights);
            break;
        case Layer::alpha:
            fill(field.alpha);
            break;
    }
    store(pixels, numbers);
}

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

constexpr int tile_size = RayTile::side;

Rect intersection(Rect a, Rect b) {
    const int x = std::max(a.x, b.x), y = std::max(a.y, b.y);
    return {x, y, std::min(a.x + a.width, b.x + b.width) - x,
            std::min(a.y + a.height, b.y + b.height) - y};
}

// The square of the map that a texel lies in, in the order of rows.
int square_of(TexelIndex at, const HeightField& field) {
    return at.j / tile_size * (field.width() / tile_size + 1) + at.i / tile_size;
}

// The squares of a picture in the order they are shaded in: neighbours look at the same part of the
// map, so squares come in blocks of `side` x `side` whose part of it stays in a core's cache.
class SquareOrder {
public:
    explicit SquareOrder(Rect part)
        : first_x_(part.x / tile_size),
          first_y_(part.y / tile_size),
          across_((part.x + part.width - 1) / tile_size - first_x_ + 1),
          down_((part.y + part.height - 1) / tile_size - first_y_ + 1) {}

    [[nodiscard]] int count() const { return across_ * down_; }

    // Texels of the n-th square.
    [[nodiscard]] Rect at(int n) const {
        const int top = n / (across_ * side) * side;  // of the row of blocks
        const int height = std::min(side, down_ - top);
        const int in_row = n - top * across_;
        const int left = in_row / (side * height) * side;
        const int width = std::min(side, across_ - left);
        const int in_block = in_row - left * height;
        return {(first_x_ + left + in_block % width) * tile_size,
                (first_y_ + top + in_block / width) * tile_size, tile_size, tile_size};
    }

private:
    static constexpr int side = 8;
    int first_x_, first_y_, across_, down_;
};

// A picture of a part of the map, shaded square by square.
class PartShading {
public:
    // @param nearest  null: no texel takes its colour from another
    PartShading(const HeightField& field, const NearestSolid* nearest, Rect part, Image& image)
        : field_(field), nearest_(nearest), part_(part), image_(image) {}

    // Calls `shade` with the pixels of one square and the texels that they take their numbers from,
    // and with those that take them from other squares.
    template <class Shade>
    void shade_square(Rect square, const Shade& shade) const {
        const Rect wanted = intersection(square, part_);
        TilePixels own, fringe;
        for (int j = wanted.y; j < wanted.y + wanted.height; ++j) {
            float* pixels =
                &image_.row(j - part_.y)[std::size_t(wanted.x - part_.x) * image_.channels];
            for (int n = 0; n < wanted.width * image_.channels; n += line)
                __builtin_prefetch(pixels + n, 1);  // written when all is shaded
            if (field_.alpha.empty())
                own.add_row({wanted.x, j}, pixels, wanted.width, image_.channels);
            else
                for (int n = 0; n < wanted.width; ++n)
                    add_pixel({wanted.x + n, j}, pixels + n * image_.channels, own, fringe);
        }
        // Packets like whole squares.
        if (own.size() * 4 >= RayTile::max_rays && own.size() < RayTile::max_rays)
            shade(filled_up(own, square));
        else if (own.size() > 0) shade(own);
        for (const auto& [square_number, pixels] : by_square(fringe)) shade(pixels);
    }

private:
    void add_pixel(TexelIndex at, float* out, TilePixels& own, TilePixels& fringe) const {
        const float alpha = field_.alpha.at(at.i, at.j);
        if (alpha == 0) return;  // colour and data are 0
        if (image_.channels == 4) out[3] = alpha;
        if (!nearest_ || field_.is_solid(at.i, at.j)) own.add(at, out);
        else if (const auto source = nearest_->find(at.i, at.j)) fringe.add(*source, out);
    }

    // Texels of the part alone: what is prepared of a map may end with it.
    [[nodiscard]] TilePixels filled_up(const TilePixels& some, Rect square) const {
        TilePixels all;
        for (int j = square.y; j < square.y + square.height; ++j)
            for (int i = square.x; i < square.x + square.width; ++i)
                all.add({std::clamp(i, part_.x, part_.x + part_.width - 1),
                         std::clamp(j, part_.y, part_.y + part_.height - 1)},
                        nullptr);
        for (int k = 0; k < some.size(); ++k) {
            const TexelIndex at = some.sources()[k];
            all.out((at.j - square.y) * tile_size + (at.i - square.x)) = some.out(k);
        }
        return all;
    }

    [[nodiscard]] std::map<int, TilePixels> by_square(const TilePixels& fringe) const {
        std::map<int, TilePixels> squares;
        for (int k = 0; k < fringe.size(); ++k) {
            const TexelIndex source = fringe.sources()[k];
            squares[square_of(source, field_)].add(source, fringe.out(k));
        }
        return squares;
    }

    static constexpr int line = 16;  // floats of a line of the cache
    const HeightField& field_;
    const NearestSolid* nearest_;
    const Rect part_;
    Image& image_;
};

// Without rays squares are good for nothing: whole rows lie one after the other in memory.
void shade_rows(const Shader& shader, const Output& output, Rect part, bool finish,
                const RenderControl& control, Image& image) {
    Progress progress(control.progress, part.height);
    parallel_rows(control.executor, part.height, control.stop, [&](RowRange rows) {
        for (int y = rows.begin; y < rows.end; ++y) {
            shader.beauty_row(part.x, part.y + y, part.width, image.row(y));
            if (finish) finish_colours(image.row(y), output);
            progress.tile_done();
        }
    });
}

// `part` of the map shaded at its texels: colour in linear light with unassociated alpha, or data.
// @param finish  colour as it is after finish_beauty()
Image shade(const Scene& scene, const Output& output, Rect part, bool finish, const Shader& shader,
            const RenderControl& control) {
    const HeightField& field = *scene.field;
    const Layer layer = output.layer;
    std::shared_ptr<const NearestSolid> nearest;
    if (!field.alpha.empty() && !is_stored(layer)) nearest = nearest_solid(field, control.cache);

    Image image(part.width, part.height, channels_of(layer, field));
    if (layer == Layer::beauty && field.alpha.empty() && shader.shades_rows()) {
        shade_rows(shader, output, part, finish, control, image);
        return image;
    }
    const PartShading shading(field, nearest.get(), part, image);
    const SquareOrder squares(part);
    Progress progress(control.progress, squares.count());
    parallel_rows(control.executor, squares.count(), control.stop, [&](RowRange range) {
        for (int n = range.begin; n < range.end; ++n) {
            shading.shade_square(squares.at(n), [&](const TilePixels& pixels) {
                shade_tile(shader, field, output, finish, pixels, control.stop);
            });
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
                  const RenderControl& control, Picture& picture) {
    const HeightField& field = *scene.field;
    const Rect window = output.region.value_or(Rect{0, 0, field.width(), field.height()});
    assert(window.x >= 0 && window.y >= 0 && window.x + window.width <= field.width() &&
           window.y + window.height <= field.height());
    const Rect part =
        resample_support(window, size.width, size.height, field.width(), field.height());
    const bool is_own_size =
        part == window && size.width == window.width && size.height == window.height;
    const bool is_beauty = output.layer == Layer::beauty;
    const bool finish =
        is_beauty && is_own_size && is_finished_by_colours(output, !field.alpha.empty());
    auto prepared = prepared_solid(scene, control);
    SkyLights skies = sky_lights(scene, output, part, *prepared, control);
    picture.coarse_environment = coarse_environment(scene, output, skies);
    const TranslucentLight translucent = translucent_light(scene, output, *prepared, control);
    if (translucent.coarse_directions > 0)
        picture.coarse_environment = translucent.coarse_directions;
    picture.coarse_transport = translucent.is_coarse;
    Image image = shade(scene, output, part, finish,
                        {scene, output.transfer, environment_sampling(output), control,
                         std::move(skies), std::move(prepared), &translucent},
                        control);
    if (output.layer == Layer::thickness && !output.linear) cut_thickness(image);
    const Rect window_in_part{window.x - part.x, window.y - part.y, window.width, window.height};
    if (!is_own_size) image = resized(std::move(image), window_in_part, size, control);
    if (is_beauty && !finish) finish_beauty(image, output, control.executor, control.stop);
    if (!is_beauty) finish_data(image, output);
    return image;
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
            .bump_relief = scene.bump_relief,
            .base = scene.base,
            .normal_scale = scene.normal_scale,
            .lights = scene.lights,
            .material = scene.material};
        picture.pixels = render_part(small, output, size, control, picture);
    } else {
        picture.pixels = render_part(scene, output, size, control, picture);
    }
    return picture;
}

}  // namespace relit
