#include "core/render/shade.h"

#include <algorithm>
#include <array>
#include <map>

#include "core/render/finish.h"

namespace relit {
namespace {

// The pixels of a tile and the texels that their numbers come from.
class TilePixels {
public:
    void add(TexelIndex source, float* pixel) {
        sources_[size_] = source;
        out_[size_++] = pixel;
        is_rows_ = false;
    }
    /// `count` texels side by side from `source` on, and their pixels of so many channels.
    void add_row(TexelIndex source, float* pixels, int count, int channels) {
        for (int k = 0; k < count; ++k) {
            sources_[size_ + k] = {source.i + k, source.j};
            out_[size_ + k] = pixels + std::size_t(k) * channels;
        }
        size_ += count;
        is_rows_ = is_rows_ && count == RayTile::side;
    }
    [[nodiscard]] int size() const { return size_; }
    /// Rows as long as a square's, their pixels side by side.
    [[nodiscard]] bool is_rows() const { return is_rows_; }
    [[nodiscard]] std::span<const TexelIndex> sources() const {
        return {sources_.data(), std::size_t(size_)};
    }
    /// Null: a texel that only fills up the square.
    [[nodiscard]] float*& out(int k) { return out_[k]; }
    [[nodiscard]] float* out(int k) const { return out_[k]; }

private:
    int size_ = 0;
    bool is_rows_ = true;
    std::array<TexelIndex, RayTile::max_rays> sources_;
    std::array<float*, RayTile::max_rays> out_;
};

template <int channels>
void store_rows(const TilePixels& pixels, const float* values) {
    constexpr int side = RayTile::side;
    const int size = pixels.size();
    for (int k = 0; k < size; k += side) {
        float* out = pixels.out(k);
        for (int n = 0; n < side; ++n)
            for (int c = 0; c < channels; ++c)
                out[n * channels + c] = stored(values[c * size + k + n]);
    }
}

// One channel after the other.
void store(const TilePixels& pixels, std::span<const float> values) {
    const std::size_t size = pixels.size(), channels = values.size() / size;
    if (pixels.is_rows() && channels == 1) return store_rows<1>(pixels, values.data());
    if (pixels.is_rows() && channels == 3) return store_rows<3>(pixels, values.data());
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
    unsigned coloured = 0;  // looked at to the end: that takes a register of them at a time
    for (std::size_t k = 0; k < size; ++k)
        coloured |= unsigned(red[k] != green[k]) | unsigned(red[k] != blue[k]);
    if (coloured != 0) return finish_colours(triples, output);
    finish_colours(red, output);
    std::copy(red.begin(), red.end(), green.begin());
    std::copy(red.begin(), red.end(), blue.begin());
}

// The numbers of the output's layer, without alpha.
void shade_tile(const PartShading& how, const TilePixels& pixels, const std::stop_token& stop) {
    const Shader& shader = how.shader;
    const Output& output = how.output;
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
            if (how.finish) finish_triples(triples, output);
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
            fill(how.field.heights);
            break;
        case Layer::alpha:
            fill(how.field.alpha);
            break;
    }
    store(pixels, numbers);
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
class Squares {
public:
    // @param nearest  null: no texel takes its colour from another
    Squares(const HeightField& field, const NearestSolid* nearest, Rect part, Image& image)
        : field_(field), nearest_(nearest), part_(part), image_(image) {}

    // Calls `shade` with the pixels of one square and the texels that they take their numbers from,
    // and with those that take them from other squares.
    template <class Shade>
    void shade_square(Rect square, const Shade& shade) const {
        const Rect wanted = intersection(square, part_);
        TilePixels own;
        std::map<int, TilePixels> fringe;
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
        for (const auto& [square_number, pixels] : fringe) shade(pixels);
    }

private:
    // @param fringe  by the square that the colour comes from
    void add_pixel(TexelIndex at, float* out, TilePixels& own,
                   std::map<int, TilePixels>& fringe) const {
        const float alpha = field_.alpha.at(at.i, at.j);
        if (alpha == 0) return;  // colour and data are 0
        if (image_.channels == 4) out[3] = alpha;
        if (!nearest_ || field_.is_solid(at.i, at.j)) own.add(at, out);
        else if (const auto source = nearest_->find(at.i, at.j))
            fringe[square_of(*source, field_)].add(*source, out);
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

    static constexpr int line = 16;  // floats of a line of the cache
    const HeightField& field_;
    const NearestSolid* nearest_;
    const Rect part_;
    Image& image_;
};

// Without rays squares are good for nothing: whole rows lie one after the other in memory.
void shade_rows(const PartShading& how, Rect part, const RenderControl& control, Progress& progress,
                Image& image) {
    parallel_rows(control.executor, part.height, control.stop, [&](RowRange rows) {
        for (int y = rows.begin; y < rows.end; ++y) {
            how.shader.beauty_row(part.x, part.y + y, part.width, image.row(y));
            if (how.finish) finish_colours(image.row(y), how.output);
            progress.done();
        }
    });
}

}  // namespace

void Progress::expect(int pieces, double until) {
    begin_ = end_;
    end_ = until;
    pieces_ = pieces;
    done_ = 0;
}

void Progress::done() {
    if (!told_) return;
    const std::lock_guard lock(mutex_);
    told_(begin_ + (end_ - begin_) * (double(++done_) / pieces_));
}

int shaded_channels(Layer layer, const HeightField& field) {
    if (is_scalar(layer)) return 1;
    return field.alpha.empty() ? 3 : 4;
}

Image shade(const PartShading& how, Rect part, double progress_until, const RenderControl& control,
            Progress& progress) {
    const Layer layer = how.output.layer;
    Image image(part.width, part.height, shaded_channels(layer, how.field));
    if (layer == Layer::beauty && how.field.alpha.empty() && how.shader.shades_rows()) {
        progress.expect(part.height, progress_until);
        shade_rows(how, part, control, progress, image);
        return image;
    }
    const Squares shading(how.field, how.nearest, part, image);
    const SquareOrder squares(part);
    progress.expect(squares.count(), progress_until);
    parallel_rows(control.executor, squares.count(), control.stop, [&](RowRange range) {
        for (int n = range.begin; n < range.end; ++n) {
            shading.shade_square(squares.at(n), [&](const TilePixels& pixels) {
                shade_tile(how, pixels, control.stop);
            });
            progress.done();
        }
    });
    return image;
}

}  // namespace relit
