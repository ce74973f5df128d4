#include "core/render/shader.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/field/normals.h"
#include "core/render/ray_tile.h"
#include "core/shade/factors.h"
#include "core/visibility/sample_count.h"

namespace relit {
namespace {

Rgb rgb_at(const Image& image, TexelIndex at) {
    return {image.at(at.i, at.j, 0), image.at(at.i, at.j, 1), image.at(at.i, at.j, 2)};
}

}  // namespace

Shader::Shader(const Scene& scene, Transfer transfer, EnvironmentSampling sampling,
               const RenderControl& control, SkyLights skies,
               std::shared_ptr<const PreparedSolid> prepared, const TranslucentLight* translucent)
    : scene_(scene),
      field_(*scene.field),
      prepared_(prepared ? std::move(prepared) : prepared_solid(scene, control)),
      solid_(prepared_->solid),
      packets_(prepared_->packets),
      translucent_(translucent),
      lights_(scene_lights(scene, transfer, sampling, solid_.y_size(), std::move(skies),
                           control.cache)),
      base_(shading_colour(scene.material.base_colour, transfer)),
      diffuse_(shading_colour(scene.material.diffuse_colour, transfer)),
      specular_(shading_colour(scene.material.specular_colour, transfer)) {}

RayTile Shader::starts(std::span<const TexelIndex> texels) const {
    prefetch_next(texels[0]);
    RayTile tile = surface_starts(solid_, texels);
    sink(texels, tile);
    return tile;
}

// Rows of a square lie far apart in memory: asks for those of the one on the right, which is likely
// to be the next, while this one is shaded.
void Shader::prefetch_next(TexelIndex at) const {
    constexpr int side = RayTile::side;
    const int i = (at.i / side + 1) * side, row = at.j / side * side;
    if (i >= solid_.width) return;
    const bool sinks_along_normals = scene_.material.offset == Offset::normal;
    for (int j = row; j < std::min(row + side, solid_.height); ++j) {
        __builtin_prefetch(&solid_.z.row(j + 1)[i + 1]);
        if (!sinks_along_normals) continue;
        prepared_->slopes.prefetch(i, j, std::min(side, solid_.width - i));
    }
}

// Moves starts from the surface to p', t below it.
void Shader::sink(std::span<const TexelIndex> texels, RayTile& tile) const {
    const float depth = float(scene_.material.depth);
    const float texels_deep = float(scene_.material.depth * solid_.width);
    if (scene_.material.offset == Offset::view) {
        for (int k = 0; k < tile.count; ++k) tile.z[k] -= depth;
        return;
    }
    TileNumbers x, y;
    load_slopes(prepared_->slopes, field_, texels, 1, x, y);
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

void Shader::surface_layer(std::span<const TexelIndex> texels, std::span<float> rgb) const {
    for (std::size_t k = 0; k < texels.size(); ++k)
        for (int c = 0; c < 3; ++c)
            rgb[k + c * texels.size()] = translucent_->layer.at(texels[k].i, texels[k].j, c);
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

// View vectors mirrored at the normals.
struct Shader::Mirrored {
    TileNumbers x, y, z;

    Mirrored(const Shader& shader, std::span<const TexelIndex> texels) {
        load_slopes(shader.prepared_->shading_slopes(), shader.field_, texels,
                    float(shader.scene_.normal_scale), x, y);
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
    TileNumbers s;
    const auto add_part = [&](Vec3 at, Rgb radiance, double weight) {
        const TileDirections light(solid_, {at, sample.at_infinity}, tile);
        for (int k = 0; k < tile.count; ++k) {
            const float cosine = mirrored.x[k] * light.x[k] + mirrored.y[k] * light.y[k] +
                                 mirrored.z[k] * light.z[k];
            s[k] = ramp(cosine);
        }
        add(s, radiance, weight);
    };
    if (sample.parts.empty()) add_part(sample.at, sample.radiance, sample.weight);
    for (const SamplePart& part : sample.parts) add_part(part.at, part.radiance, part.weight);
}

// Share of the light that reaches the matt colour, d left out: (1 - k_s) ((1 - k_f) + k_f f).
void Shader::fill_matt_share(const LightSample& sample, const RayTile& tile,
                             std::span<float> share) const {
    const Scatter& scatter = scene_.material.scatter;
    const float matt = is_translucent() ? 0 : float(1 - scene_.material.specular.k);
    std::fill(share.begin(), share.end(), matt);
    if (scatter.k == 0 || matt == 0) return;
    const TileDirections light(solid_, target_of(sample), tile);
    const float k_f = float(scatter.k);
    const TileRamp ramp(scatter.falloff);
    for (int k = 0; k < tile.count; ++k) share[k] = matt * ((1 - k_f) + k_f * ramp(-light.z[k]));
}

// What skies light: all of it but their suns' share of the matt colour.
void Shader::add_skies(std::span<const TexelIndex> texels, bool is_glossy, TileSums& diffuse,
                       TileSums& glossy) const {
    const double matt = is_translucent() ? 0 : 1 - scene_.material.specular.k;
    for (const auto& sky : lights_.skies) {
        if (!sky) continue;
        if (matt > 0) {
            const std::vector<Rgb> lit = sky->diffuse(texels);
            for (std::size_t k = 0; k < texels.size(); ++k) diffuse.add(int(k), matt * lit[k]);
        }
        for (std::size_t k = 0; k < texels.size() && is_glossy; ++k)
            glossy.add(int(k), sky->highlight(normal(texels[k])));
    }
}

Vec3 Shader::normal(TexelIndex at) const {
    return normal_from(prepared_->shading_slopes().at(field_, at.i, at.j), scene_.normal_scale);
}

void Shader::beauty_row(int i, int j, int count, std::span<float> rgb) const {
    assert(shades_rows());
    const Material& m = scene_.material;
    const double matt = 1 - m.specular.k;
    const Rgb own = matt * base_, reflected = matt * diffuse_, glossy = m.specular.k * specular_;
    const float base[] = {float(own.r), float(own.g), float(own.b)};
    const float colour[] = {float(reflected.r), float(reflected.g), float(reflected.b)};
    std::vector<float> sums(3 * std::size_t(count));
    float* const lit[] = {sums.data(), sums.data() + count, sums.data() + 2 * std::size_t(count)};
    for (const auto& sky : lights_.skies)
        if (matt > 0) sky->add_diffuse(i, j, count, lit);
    for (int c = 0; c < 3; ++c)
        for (int k = 0; k < count; ++k) lit[c][k] *= colour[c];
    float* const out = rgb.data();
    for (int k = 0; k < count; ++k)
        for (int c = 0; c < 3; ++c) out[3 * k + c] = lit[c][k];
    if (!field_.albedo.empty()) {
        const float* albedo = &field_.albedo.row(j)[3 * std::size_t(i)];
        for (int n = 0; n < 3 * count; ++n) out[n] *= albedo[n];
    }
    for (int k = 0; k < count; ++k)
        for (int c = 0; c < 3; ++c) out[3 * k + c] = stored(out[3 * k + c] + base[c]);
    if (m.specular.k == 0) return;
    for (int k = 0; k < count; ++k) {
        const Vec3 n = normal(TexelIndex{i + k, j});
        Rgb shine;
        for (const auto& sky : lights_.skies) shine = shine + glossy * sky->highlight(n);
        const float of[] = {float(shine.r), float(shine.g), float(shine.b)};
        for (int c = 0; c < 3; ++c) out[3 * k + c] = stored(out[3 * k + c] + of[c]);
    }
}

void Shader::beauty(std::span<const TexelIndex> texels, const std::stop_token& stop,
                    std::span<float> rgb) const {
    const Material& m = scene_.material;
    const RayTile tile = starts(texels);
    std::optional<Mirrored> mirrored;
    if (m.specular.k > 0) mirrored.emplace(*this, texels);

    TileNumbers share, d;
    TileSums diffuse, glossy;
    add_skies(texels, mirrored.has_value(), diffuse, glossy);
    if (is_translucent())
        for (int k = 0; k < tile.count; ++k)
            diffuse.add(k, (1 - m.specular.k) * rgb_at(translucent_->matt, texels[k]));
    const std::span<float> shares(share.data(), texels.size());
    const auto add_matt = [&](const LightSample& light) {
        for (int k = 0; k < tile.count; ++k) share[k] *= d[k];
        diffuse.add(tile.count, share, light.radiance);
    };
    for (const LightSample& sun : lights_.suns) {
        if (stop.stop_requested()) break;
        fill_matt_share(sun, tile, shares);
        illuminate(sun, texels, tile, {d.data(), texels.size()});
        add_matt(sun);
    }
    for (const LightSample& sample : lights_.samples) {
        if (sample.radiance == Rgb{}) continue;
        if (stop.stop_requested()) break;
        fill_matt_share(sample, tile, shares);
        TileSums gloss;
        if (mirrored)
            for_each_highlight(sample, tile, *mirrored,
                               [&](const TileNumbers& s, Rgb radiance, double) {
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
    const TileNumbers* diffuse_light[] = {&diffuse.r, &diffuse.g, &diffuse.b};
    const TileNumbers* glossy_light[] = {&glossy.r, &glossy.g, &glossy.b};
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
        if (is_translucent() && !translucent_->sheen.empty())
            for (std::size_t k = 0; k < texels.size(); ++k)
                out[k] += translucent_->sheen.at(texels[k].i, texels[k].j, c);
    }
}

void Shader::illumination(std::span<const TexelIndex> texels, const std::stop_token& stop,
                          std::span<float> d) const {
    if (lights_.first_sky) {
        const std::vector<Rgb> sums = lights_.first_sky->diffuse(texels);
        for (std::size_t k = 0; k < texels.size(); ++k) d[k] = std::min(float(sums[k].r), 1.0f);
        return;
    }
    const RayTile tile = starts(texels);
    std::fill(d.begin(), d.end(), 0.0f);
    TileNumbers of_sample;
    for (std::size_t q = 0; q < lights_.first_light_samples && !stop.stop_requested(); ++q) {
        illuminate(lights_.samples[q], texels, tile, {of_sample.data(), texels.size()});
        const float weight = float(lights_.samples[q].weight);
        for (std::size_t k = 0; k < texels.size(); ++k) d[k] += weight * of_sample[k];
    }
}

void Shader::thickness(std::span<const TexelIndex> texels, std::span<float> r) const {
    assert(lights_.first_light_samples == 1);
    packets_.inside_lengths(target_of(lights_.samples.front()), starts(texels), r);
}

void Shader::specular(std::span<const TexelIndex> texels, std::span<float> s) const {
    if (lights_.first_sky) {
        for (std::size_t k = 0; k < texels.size(); ++k)
            s[k] = float(lights_.first_sky->highlight(normal(texels[k])).r);
        return;
    }
    const RayTile tile = starts(texels);
    const Mirrored mirrored(*this, texels);
    std::fill(s.begin(), s.end(), 0.0f);
    for (std::size_t q = 0; q < lights_.first_light_samples; ++q)
        for_each_highlight(lights_.samples[q], tile, mirrored,
                           [&](const TileNumbers& of_part, Rgb, double weight) {
                               for (std::size_t k = 0; k < texels.size(); ++k)
                                   s[k] += float(weight) * of_part[k];
                           });
}

void Shader::scatter(std::span<const TexelIndex> texels, std::span<float> f) const {
    if (lights_.first_sky) {
        std::fill(f.begin(), f.end(), float(lights_.first_sky->scatter().r));
        return;
    }
    const RayTile tile = starts(texels);
    const Falloff falloff = scene_.material.scatter.falloff;
    std::fill(f.begin(), f.end(), 0.0f);
    for (std::size_t q = 0; q < lights_.first_light_samples; ++q) {
        const LightSample& sample = lights_.samples[q];
        const TileDirections light(solid_, target_of(sample), tile);
        for (std::size_t k = 0; k < texels.size(); ++k)
            f[k] += float(sample.weight * scatter_factor({0, 0, light.z[k]}, falloff));
    }
}

}  // namespace relit
