#include "core/render/shader.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "core/field/normals.h"
#include "core/shade/factors.h"
#include "core/visibility/sample_count.h"

namespace relit {
namespace {

RayTarget target_of(const LightSample& sample) { return {sample.at, sample.at_infinity}; }

// The nearest float; what is beyond them all is the largest.
float stored_number(double value) {
    return float(std::min<double>(value, std::numeric_limits<float>::max()));
}

// A number per texel of a tile.
struct alignas(64) Numbers : std::array<float, RayTile::max_rays> {};

// ramp() of factors.h in float, for whole tiles.
class TileRamp {
public:
    explicit TileRamp(Falloff falloff)
        : lo_(float(falloff.lo)), inverse_(float(1 / (falloff.hi - falloff.lo))) {}
    float operator()(float c) const { return std::min(std::max((c - lo_) * inverse_, 0.0f), 1.0f); }

private:
    float lo_, inverse_;
};

// Calls `visit` with each run of texels side by side: the place of its first one in the list, its
// size, and the first one.
template <class Visit>
void for_each_run(std::span<const TexelIndex> texels, const Visit& visit) {
    for (std::size_t begin = 0; begin < texels.size();) {
        const TexelIndex first = texels[begin];
        // Whole rows of a square are told by their ends.
        const std::size_t whole = begin + RayTile::side - 1;
        std::size_t end = begin + 1;
        if (whole < texels.size() && texels[whole].j == first.j &&
            texels[whole].i == first.i + RayTile::side - 1)
            end = whole + 1;
        else
            while (end < texels.size() && texels[end].j == first.j &&
                   texels[end].i == first.i + int(end - begin))
                ++end;
        visit(begin, end - begin, first);
        begin = end;
    }
}

}  // namespace

Shader::Shader(const Scene& scene, Transfer transfer, EnvironmentSampling sampling,
               const RenderControl& control, SkyLights skies,
               std::shared_ptr<const PreparedSolid> prepared)
    : scene_(scene),
      field_(*scene.field),
      prepared_(prepared ? std::move(prepared) : prepared_solid(scene, control)),
      solid_(prepared_->solid),
      packets_(prepared_->packets),
      first_light_samples_(0),
      skies_(std::move(skies)),
      base_(shading_colour(scene.material.base_colour, transfer)),
      diffuse_(shading_colour(scene.material.diffuse_colour, transfer)),
      specular_(shading_colour(scene.material.specular_colour, transfer)) {
    assert(!scene.lights.empty());
    assert(skies_.empty() || skies_.size() == scene.lights.size());
    for (std::size_t n = 0; n < scene.lights.size(); ++n) {
        if (!skies_.empty() && skies_[n]) {
            const std::vector<LightSample>& suns = skies_[n]->suns();
            suns_.insert(suns_.end(), suns.begin(), suns.end());
            continue;
        }
        const auto* environment = std::get_if<EnvironmentLight>(&scene.lights[n]);
        const std::vector<LightSample> of_light =
            environment
                ? samples_of(*environment, {solid_.y_size()},
                             *shared_environment_lights(*environment, sampling, control.cache))
                : samples_of(scene.lights[n], {solid_.y_size()}, transfer, sampling);
        samples_.insert(samples_.end(), of_light.begin(), of_light.end());
        if (n == 0) first_light_samples_ = of_light.size();
    }
    if (!skies_.empty()) first_sky_ = skies_.front().get();
}

RayTile Shader::starts(std::span<const TexelIndex> texels) const {
    assert(!texels.empty() && texels.size() <= RayTile::max_rays);
    constexpr int side = RayTile::side;
    RayTile tile;
    tile.column = texels[0].i / side * side;
    tile.row = texels[0].j / side * side;
    tile.count = int(texels.size());
    prefetch_next(tile);
    for_each_run(texels, [&](std::size_t k, std::size_t size, TexelIndex at) {
        assert(at.i / side * side == tile.column && at.j / side * side == tile.row);
        std::copy_n(&solid_.z.row(at.j + 1)[at.i + 1], size, &tile.z[k]);
        for (std::size_t n = 0; n < size; ++n)
            tile.right[k + n] = float(at.i - tile.column + int(n));
        for (std::size_t n = 0; n < size; ++n) tile.down[k + n] = float(at.j - tile.row);
    });
    sink(texels, tile);
    return tile;
}

// Rows of a square lie far apart in memory: asks for those of the one on the right, which is likely
// to be the next, while this one is shaded.
void Shader::prefetch_next(const RayTile& tile) const {
    constexpr int side = RayTile::side;
    const int i = tile.column + side;
    if (i >= solid_.width) return;
    const bool sinks_along_normals = scene_.material.offset == Offset::normal;
    for (int j = tile.row; j < std::min(tile.row + side, solid_.height); ++j) {
        __builtin_prefetch(&solid_.z.row(j + 1)[i + 1]);
        if (!sinks_along_normals) continue;
        const float* slopes = &prepared_->slopes.row(j)[2 * std::size_t(i)];
        __builtin_prefetch(slopes);
        __builtin_prefetch(slopes + side);
    }
}

void Shader::load_slopes(std::span<const TexelIndex> texels, float scale, float* x,
                         float* y) const {
    for_each_run(texels, [&](std::size_t k, std::size_t size, TexelIndex at) {
        const float* slopes = &prepared_->slopes.row(at.j)[2 * std::size_t(at.i)];
        for (std::size_t n = 0; n < size; ++n) {
            x[k + n] = scale * slopes[2 * n];
            y[k + n] = scale * slopes[2 * n + 1];
        }
    });
}

// Moves starts from the surface to p', t below it.
void Shader::sink(std::span<const TexelIndex> texels, RayTile& tile) const {
    const float depth = float(scene_.material.depth);
    const float texels_deep = float(scene_.material.depth * solid_.width);
    if (scene_.material.offset == Offset::view) {
        for (int k = 0; k < tile.count; ++k) tile.z[k] -= depth;
        return;
    }
    Numbers x, y;
    load_slopes(texels, 1, x.data(), y.data());
    for (int k = 0; k < tile.count; ++k) {
        const float normal_z = 1 / std::sqrt(1 + x[k] * x[k] + y[k] * y[k]);
        tile.right[k] += texels_deep * normal_z * x[k];
        tile.down[k] -= texels_deep * normal_z * y[k];
        tile.z[k] -= depth * normal_z;
    }
}

Vec3 Shader::start(TexelIndex at) const {
    const Vec3 inward = scene_.material.offset == Offset::normal
                            ? normal_from(slopes_at(field_, scene_.relief, at.i, at.j))
                            : Vec3{0, 0, 1};
    return surface_point(solid_, at.i, at.j) - scene_.material.depth * inward;
}

void Shader::normal(std::span<const TexelIndex> texels, std::span<float> xyz) const {
    for (std::size_t k = 0; k < texels.size(); ++k) {
        const Vec3 n = normal(texels[k]);
        xyz[k] = float(n.x);
        xyz[k + texels.size()] = float(n.y);
        xyz[k + 2 * texels.size()] = float(n.z);
    }
}

void Shader::illuminate(const LightSample& sample, std::span<const TexelIndex> texels,
                        const RayTile& tile, std::span<float> d) const {
    const Material& m = scene_.material;
    if (m.illumination == Illumination::count) {
        assert(!sample.at_infinity);
        for (std::size_t k = 0; k < texels.size(); ++k)
            d[k] = 1.0f / float(sample_count(solid_, start(texels[k]), sample.at, m.steps));
        return;
    }
    packets_.inside_lengths(target_of(sample), tile, d);
    const float depth = float(m.depth);
    if (m.illumination == Illumination::length)
        for (float& r : d) r = r > depth ? depth / r : 1;
    else
        for (float& r : d) r = float(exponential_illumination(m.depth, r, m.attenuation));
}

// Unit vectors from the starts to a light.
struct Shader::Directions {
    Numbers x, y, z;

    Directions(const Solid& solid, Vec3 at, bool at_infinity, const RayTile& tile) {
        if (at_infinity) {
            x.fill(float(at.x));
            y.fill(float(at.y));
            z.fill(float(at.z));
            return;
        }
        const float texel = 1 / float(solid.width);
        const float right = float(at.x * solid.width - 0.5 - tile.column);
        const float down = float(solid.height - 0.5 - at.y * solid.width - tile.row);
        for (int k = 0; k < tile.count; ++k) {
            const float to_x = texel * (right - tile.right[k]);
            const float to_y = -texel * (down - tile.down[k]);
            const float to_z = float(at.z) - tile.z[k];
            const float square = to_x * to_x + to_y * to_y + to_z * to_z;
            const float inverse = square > 0 ? 1 / std::sqrt(square) : 0;
            x[k] = inverse * to_x;
            y[k] = inverse * to_y;
            z[k] = square > 0 ? inverse * to_z : 1;
        }
    }
};

// Sums per texel of a tile.
struct Shader::Sums {
    Numbers r{}, g{}, b{};

    void add(int count, const float* share, Rgb colour) {
        const float cr = float(colour.r), cg = float(colour.g), cb = float(colour.b);
        for (int k = 0; k < count; ++k) r[k] += share[k] * cr;
        for (int k = 0; k < count; ++k) g[k] += share[k] * cg;
        for (int k = 0; k < count; ++k) b[k] += share[k] * cb;
    }
    [[nodiscard]] Rgb at(std::size_t k) const { return {r[k], g[k], b[k]}; }
};

// View vectors mirrored at the normals.
struct Shader::Mirrored {
    Numbers x, y, z;

    Mirrored(const Shader& shader, std::span<const TexelIndex> texels) {
        shader.load_slopes(texels, float(shader.scene_.normal_scale), x.data(), y.data());
        for (std::size_t k = 0; k < texels.size(); ++k) {
            // 2 (n . v) n - v with n = (-x, -y, 1) / length
            const float twice = 2 / (1 + x[k] * x[k] + y[k] * y[k]);
            x[k] *= -twice;
            y[k] *= -twice;
            z[k] = twice - 1;
        }
    }
};

template <class Add>
void Shader::for_each_highlight(const LightSample& sample, const RayTile& tile,
                                const Mirrored& mirrored, const Add& add) const {
    const TileRamp ramp(scene_.material.specular.falloff);
    Numbers s;
    const auto add_part = [&](Vec3 at, Rgb radiance, double weight) {
        const Directions light(solid_, at, sample.at_infinity, tile);
        for (int k = 0; k < tile.count; ++k) {
            const float cosine = mirrored.x[k] * light.x[k] + mirrored.y[k] * light.y[k] +
                                 mirrored.z[k] * light.z[k];
            s[k] = ramp(cosine);
        }
        add(s.data(), radiance, weight);
    };
    if (sample.parts.empty()) add_part(sample.at, sample.radiance, sample.weight);
    for (const SamplePart& part : sample.parts) add_part(part.at, part.radiance, part.weight);
}

// Share of the light that reaches the matt colour, d left out: (1 - k_s) ((1 - k_f) + k_f f).
void Shader::fill_matt_share(const LightSample& sample, const RayTile& tile,
                             std::span<float> share) const {
    const Scatter& scatter = scene_.material.scatter;
    const float matt = float(1 - scene_.material.specular.k);
    std::fill(share.begin(), share.end(), matt);
    if (scatter.k == 0) return;
    const Directions light(solid_, sample.at, sample.at_infinity, tile);
    const float k_f = float(scatter.k);
    const TileRamp ramp(scatter.falloff);
    for (int k = 0; k < tile.count; ++k) share[k] = matt * ((1 - k_f) + k_f * ramp(-light.z[k]));
}

// What skies light: all of it but their suns' share of the matt colour.
void Shader::add_skies(std::span<const TexelIndex> texels, bool is_glossy, Sums& diffuse,
                       Sums& glossy) const {
    const double matt = 1 - scene_.material.specular.k;
    const auto add = [](Sums& sums, std::size_t k, Rgb c) {
        sums.r[k] += float(c.r);
        sums.g[k] += float(c.g);
        sums.b[k] += float(c.b);
    };
    for (const auto& sky : skies_) {
        if (!sky) continue;
        if (matt > 0) {
            const std::vector<Rgb> lit = sky->diffuse(texels);
            for (std::size_t k = 0; k < texels.size(); ++k) add(diffuse, k, matt * lit[k]);
        }
        for (std::size_t k = 0; k < texels.size() && is_glossy; ++k)
            add(glossy, k, sky->highlight(normal(texels[k])));
    }
}

Vec3 Shader::normal(TexelIndex at) const {
    const float* slopes = &prepared_->slopes.row(at.j)[2 * std::size_t(at.i)];
    return normal_from({slopes[0], slopes[1]}, scene_.normal_scale);
}

void Shader::beauty_row(int i, int j, int count, std::span<float> rgb) const {
    assert(!sends_rays());
    const Material& m = scene_.material;
    const double matt = 1 - m.specular.k;
    const Rgb base = matt * base_, diffuse = matt * diffuse_, glossy = m.specular.k * specular_;
    std::vector<Rgb> sums(count);
    for (const auto& sky : skies_)
        if (matt > 0) sky->add_diffuse(i, j, sums);
    const float* albedo =
        field_.albedo.empty() ? nullptr : &field_.albedo.row(j)[3 * std::size_t(i)];
    float* out = rgb.data();
    for (int k = 0; k < count; ++k, out += 3) {
        Rgb colour = diffuse * sums[k];
        if (albedo) colour = Rgb{albedo[3 * k], albedo[3 * k + 1], albedo[3 * k + 2]} * colour;
        colour = base + colour;
        if (m.specular.k > 0) {
            const Vec3 n = normal(TexelIndex{i + k, j});
            for (const auto& sky : skies_) colour = colour + glossy * sky->highlight(n);
        }
        out[0] = stored_number(colour.r);
        out[1] = stored_number(colour.g);
        out[2] = stored_number(colour.b);
    }
}

void Shader::beauty(std::span<const TexelIndex> texels, const std::stop_token& stop,
                    std::span<float> rgb) const {
    const Material& m = scene_.material;
    const RayTile tile = starts(texels);
    std::optional<Mirrored> mirrored;
    if (m.specular.k > 0) mirrored.emplace(*this, texels);

    Numbers share, d;
    Sums diffuse, glossy;
    add_skies(texels, mirrored.has_value(), diffuse, glossy);
    const std::span<float> shares(share.data(), texels.size());
    const auto add_matt = [&](const LightSample& light) {
        for (int k = 0; k < tile.count; ++k) share[k] *= d[k];
        diffuse.add(tile.count, share.data(), light.radiance);
    };
    for (const LightSample& sun : suns_) {
        if (stop.stop_requested()) break;
        fill_matt_share(sun, tile, shares);
        illuminate(sun, texels, tile, {d.data(), texels.size()});
        add_matt(sun);
    }
    for (const LightSample& sample : samples_) {
        if (sample.radiance == Rgb{}) continue;
        if (stop.stop_requested()) break;
        fill_matt_share(sample, tile, shares);
        Sums gloss;
        if (mirrored)
            for_each_highlight(sample, tile, *mirrored, [&](const float* s, Rgb radiance, double) {
                gloss.add(tile.count, s, radiance);
            });
        // Light that d cannot change needs no march.
        const auto is_lit = [&](std::size_t k) { return !(gloss.at(k) == Rgb{}); };
        bool needs_d = std::any_of(shares.begin(), shares.end(), [](float v) { return v > 0; });
        for (std::size_t k = 0; k < texels.size() && m.specular.occlude && !needs_d; ++k)
            needs_d = mirrored && is_lit(k);
        if (needs_d) illuminate(sample, texels, tile, {d.data(), texels.size()});
        else d.fill(0);
        add_matt(sample);
        if (!mirrored) continue;
        for (int k = 0; k < tile.count; ++k) {
            const float lit = m.specular.occlude ? d[k] : 1;
            glossy.r[k] += lit * gloss.r[k];
            glossy.g[k] += lit * gloss.g[k];
            glossy.b[k] += lit * gloss.b[k];
        }
    }
    const double matt = 1 - m.specular.k;
    const float base[] = {float(matt * base_.r), float(matt * base_.g), float(matt * base_.b)};
    const float colour[] = {float(diffuse_.r), float(diffuse_.g), float(diffuse_.b)};
    const float shine[] = {float(m.specular.k * specular_.r), float(m.specular.k * specular_.g),
                           float(m.specular.k * specular_.b)};
    const Numbers* diffuse_light[] = {&diffuse.r, &diffuse.g, &diffuse.b};
    const Numbers* glossy_light[] = {&glossy.r, &glossy.g, &glossy.b};
    for (int c = 0; c < 3; ++c) {
        const std::span<float> out = rgb.subspan(c * texels.size(), texels.size());
        for (std::size_t k = 0; k < texels.size(); ++k) out[k] = colour[c] * (*diffuse_light[c])[k];
        if (!field_.albedo.empty())
            for_each_run(texels, [&](std::size_t k, std::size_t size, TexelIndex at) {
                const float* albedo = &field_.albedo.row(at.j)[3 * std::size_t(at.i) + c];
                for (std::size_t n = 0; n < size; ++n) out[k + n] *= albedo[3 * n];
            });
        for (float& v : out) v += base[c];
        if (mirrored)
            for (std::size_t k = 0; k < texels.size(); ++k)
                out[k] += shine[c] * (*glossy_light[c])[k];
    }
}

void Shader::illumination(std::span<const TexelIndex> texels, const std::stop_token& stop,
                          std::span<float> d) const {
    if (first_sky_) {
        const std::vector<Rgb> sums = first_sky_->diffuse(texels);
        for (std::size_t k = 0; k < texels.size(); ++k) d[k] = std::min(float(sums[k].r), 1.0f);
        return;
    }
    const RayTile tile = starts(texels);
    std::fill(d.begin(), d.end(), 0.0f);
    Numbers of_sample;
    for (std::size_t q = 0; q < first_light_samples_ && !stop.stop_requested(); ++q) {
        illuminate(samples_[q], texels, tile, {of_sample.data(), texels.size()});
        const float weight = float(samples_[q].weight);
        for (std::size_t k = 0; k < texels.size(); ++k) d[k] += weight * of_sample[k];
    }
}

void Shader::thickness(std::span<const TexelIndex> texels, std::span<float> r) const {
    assert(first_light_samples_ == 1);
    packets_.inside_lengths(target_of(samples_.front()), starts(texels), r);
}

void Shader::specular(std::span<const TexelIndex> texels, std::span<float> s) const {
    if (first_sky_) {
        for (std::size_t k = 0; k < texels.size(); ++k)
            s[k] = float(first_sky_->highlight(normal(texels[k])).r);
        return;
    }
    const RayTile tile = starts(texels);
    const Mirrored mirrored(*this, texels);
    std::fill(s.begin(), s.end(), 0.0f);
    for (std::size_t q = 0; q < first_light_samples_; ++q)
        for_each_highlight(samples_[q], tile, mirrored,
                           [&](const float* of_part, Rgb, double weight) {
                               for (std::size_t k = 0; k < texels.size(); ++k)
                                   s[k] += float(weight) * of_part[k];
                           });
}

void Shader::scatter(std::span<const TexelIndex> texels, std::span<float> f) const {
    if (first_sky_) {
        std::fill(f.begin(), f.end(), float(first_sky_->scatter().r));
        return;
    }
    const RayTile tile = starts(texels);
    const Falloff falloff = scene_.material.scatter.falloff;
    std::fill(f.begin(), f.end(), 0.0f);
    for (std::size_t q = 0; q < first_light_samples_; ++q) {
        const LightSample& sample = samples_[q];
        const Directions light(solid_, sample.at, sample.at_infinity, tile);
        for (std::size_t k = 0; k < texels.size(); ++k)
            f[k] += float(sample.weight * scatter_factor({0, 0, light.z[k]}, falloff));
    }
}

}  // namespace relit
