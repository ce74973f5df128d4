#include "core/render/surface_light.h"

#include <algorithm>
#include <cmath>

#include "core/base/hemisphere.h"
#include "core/render/ray_tile.h"
#include "core/render/scene_lights.h"
#include "core/scatter/fresnel.h"
#include "core/shade/factors.h"

namespace relit {
namespace {

// The scene as its surface sees skies: their d is V cos when rays start along the normal.
Scene matt_scene(const Scene& scene) {
    Scene matt = scene;
    matt.material.offset = Offset::normal;
    matt.material.illumination = Illumination::length;
    matt.material.specular.k = 0;
    return matt;
}

SkyLights skies_of(const Scene& matt, const Output& output, const PreparedSolid& prepared,
                   const RenderControl& control) {
    const Rect all{0, 0, matt.field->width(), matt.field->height()};
    SkyLights skies;
    for (const Light& light : matt.lights) {
        skies.emplace_back();
        // d of a sky knows nothing of bumps.
        if (prepared.bumped_slopes.empty() && SkyLight::covers(matt, light, prepared))
            skies.back() = std::make_unique<const SkyLight>(
                matt, std::get<EnvironmentLight>(light), prepared, SkyLight::Sum::colours,
                /*has_diffuse=*/true, all, output.accuracy == Accuracy::preview, control);
    }
    return skies;
}

// Texels of one square of the map, what is the same for all lights there, and their sums.
struct SurfaceTile {
    RayTile starts;
    TileNumbers slope_x, slope_y, normal_z;
    TileNumbers own_slope_x, own_slope_y;  // without the bump map
    bool is_bumped;                        // else there are none of these
    TileSums irradiance, entering, entering_behind, highlight, reflected;
    TileSums inward;  // x, y, z, times the luminance of what enters

    SurfaceTile(const HeightField& field, const PreparedSolid& prepared,
                std::span<const TexelIndex> texels)
        : starts(surface_starts(prepared.solid, texels)),
          is_bumped(!prepared.bumped_slopes.empty()) {
        load_slopes(prepared.shading_slopes(), field, texels, 1, slope_x, slope_y);
        if (is_bumped) load_slopes(prepared.slopes, field, texels, 1, own_slope_x, own_slope_y);
        for (int k = 0; k < starts.count; ++k)
            normal_z[k] = 1 / std::sqrt(1 + slope_x[k] * slope_x[k] + slope_y[k] * slope_y[k]);
    }

    [[nodiscard]] Vec3 normal(int k, double scale) const {
        return normalized({-scale * slope_x[k], -scale * slope_y[k], 1});
    }
};

// Mean cosine below the surface of diffuse light that enters, 0.86 at eta 1.3 and 0.89 at 1.5.
double mean_refracted_cosine(double eta) {
    double sum = 0, all = 0;
    for (const hemisphere::Node& node : hemisphere::nodes(32)) {
        const double enters = node.weight * node.z * scatter::transmittance(node.z, eta);
        sum += enters * scatter::refracted_cosine(node.z, eta);
        all += enters;
    }
    return sum / all;
}

class SurfaceLighting {
public:
    SurfaceLighting(const Scene& scene, const Output& output, const PreparedSolid& prepared,
                    SurfaceLightParts parts, const FilmLight* film, const RenderControl& control)
        : scene_(scene),
          prepared_(prepared),
          parts_(parts),
          lights_(scene_lights(
              scene, output.transfer, environment_sampling(output), prepared.solid.y_size(),
              skies_of(matt_scene(scene), output, prepared, control), control.cache)),
          diffuse_entry_(scatter::diffuse_transmittance(scene.material.medium.eta)),
          diffuse_depth_(mean_refracted_cosine(scene.material.medium.eta)),
          film_(film) {
        if (parts.highlight) lobe_tables_.resize(scene.lights.size());
        for (std::size_t n = 0; n < lights_.skies.size(); ++n) {
            if (!lights_.skies[n] || !(parts.highlight || has_back())) continue;
            const std::vector<LightSample> samples = environment_samples(n, control);
            if (parts.highlight) lobe_tables_[n] = lobe_table(samples, control);
            if (has_back()) behind_skies_ = behind_skies_ + behind_sky(samples);
        }
    }

    // Whether light enters at a back of the solid.
    [[nodiscard]] bool has_back() const {
        return parts_.entering && !prepared_.solid.endless_ground;
    }

    [[nodiscard]] int coarse_directions() const {
        int fewest = 0;
        for (const auto& sky : lights_.skies) {
            const int directions = sky ? sky->coarse_directions() : 0;
            if (directions > 0) fewest = fewest == 0 ? directions : std::min(fewest, directions);
        }
        return fewest;
    }

    // The sums of all lights at the texels of one square.
    [[nodiscard]] SurfaceTile lit(std::span<const TexelIndex> texels,
                                  const std::stop_token& stop) const {
        SurfaceTile tile(*scene_.field, prepared_, texels);
        add_skies(texels, tile);
        for (const auto* samples : {&lights_.suns, &lights_.samples})
            for (const LightSample& sample : *samples) {
                if (stop.stop_requested()) return tile;
                if (!(sample.radiance == Rgb{})) add(sample, samples == &lights_.suns, tile);
            }
        return tile;
    }

private:
    void add_skies(std::span<const TexelIndex> texels, SurfaceTile& tile) const;
    void add(const LightSample& sample, bool is_sun, SurfaceTile& tile) const;
    void add_behind(const LightSample& sample, SurfaceTile& tile) const;
    void add_highlight(const TileNumbers& visible, const TileNumbers& cosine,
                       const TileDirections& light, Rgb radiance, SurfaceTile& tile) const;
    [[nodiscard]] Rgb behind_sky(std::span<const LightSample> samples) const;
    void add_entering(int count, const TileNumbers& lit, const TileNumbers& cosine, Rgb radiance,
                      TileSums& entering) const;
    void add_inward(const TileSums& entering, const TileDirections& light, SurfaceTile& tile) const;
    void add_diffuse_entering(int k, Rgb lit, SurfaceTile& tile) const;
    void add_reflected(const TileNumbers& lit, const TileDirections& light, Rgb radiance,
                       SurfaceTile& tile) const;
    void fill_visibility(const RayTarget& light, const RayTile& starts, TileNumbers& v) const;
    [[nodiscard]] std::vector<LightSample> environment_samples(std::size_t light,
                                                               const RenderControl& control) const;
    [[nodiscard]] std::unique_ptr<const NormalTable> lobe_table(std::span<const LightSample> samples,
                                                                const RenderControl& control) const;

    const Scene& scene_;
    const PreparedSolid& prepared_;
    const SurfaceLightParts parts_;
    const SceneLights lights_;
    const double diffuse_entry_;                                   // F_dt of the medium
    const double diffuse_depth_;                                   // of -w_12 . n of diffuse light
    const FilmLight* const film_;                                  // null: none
    std::vector<std::unique_ptr<const NormalTable>> lobe_tables_;  // of skies
    Rgb behind_skies_;  // B / pi that they send to a back
};

// f towards the viewer, who is far above the map.
double lobe_value(const Material& m, Vec3 to_light, Vec3 normal) {
    const Highlight& h = m.highlight;
    const scatter::Lobe lobe{.kind = h.lobe,
                             .n_t = h.n_t,
                             .n_b = h.n_b,
                             .exponent = h.exponent,
                             .eta = m.medium.eta,
                             .least_cosine = 1e-3};
    return scatter::value(lobe, scatter::highlight_frame(normal), to_light, {0, 0, 1});
}

// V: what the way from the surface to a light leaves of it.
void SurfaceLighting::fill_visibility(const RayTarget& light, const RayTile& starts,
                                      TileNumbers& v) const {
    const Material& m = scene_.material;
    const std::span<float> r(v.data(), std::size_t(starts.count));
    prepared_.packets.inside_lengths(light, starts, r);
    const float depth = float(m.depth);
    if (m.illumination == Illumination::length)
        for (float& n : r) n = n > depth ? depth / n : 1;
    else
        for (float& n : r) n = float(exponential_illumination(0, n, m.attenuation));
}

// Share of light from `to_light` that enters a back, which faces away from the viewer.
double entering_back(const Material& m, Vec3 to_light) {
    const double cosine = std::max(0.0, -to_light.z), k_f = m.scatter.k;
    return cosine * scatter::transmittance(cosine, m.medium.eta) *
           ((1 - k_f) + k_f * scatter_factor(to_light, m.scatter.falloff));
}

void SurfaceLighting::add_behind(const LightSample& sample, SurfaceTile& tile) const {
    RayTile feet = tile.starts;
    feet.z.fill(float(prepared_.solid.floor_z));
    const TileDirections light(prepared_.solid, target_of(sample), feet);
    for (int k = 0; k < feet.count; ++k)
        tile.entering_behind.add(
            k,
            entering_back(scene_.material, {light.x[k], light.y[k], light.z[k]}) * sample.radiance);
}

// Suns and all.
Rgb SurfaceLighting::behind_sky(std::span<const LightSample> samples) const {
    Rgb sum;
    for (const LightSample& sample : samples)
        sum = sum + entering_back(scene_.material, sample.at) * sample.radiance;
    return sum;
}

// n . l, where the surface itself does not face away.
TileNumbers cosines(const SurfaceTile& tile, const TileDirections& light) {
    TileNumbers cosine;
    for (int k = 0; k < tile.starts.count; ++k)
        cosine[k] = std::max(0.0f, tile.normal_z[k] * (light.z[k] - tile.slope_x[k] * light.x[k] -
                                                       tile.slope_y[k] * light.y[k]));
    for (int k = 0; k < tile.starts.count && tile.is_bumped; ++k)
        if (light.z[k] - tile.own_slope_x[k] * light.x[k] - tile.own_slope_y[k] * light.y[k] <= 0)
            cosine[k] = 0;
    return cosine;
}

// V cos, or less of it where only light from behind counts.
TileNumbers lit_share(const Scatter& forward, const TileDirections& light,
                      const TileNumbers& visible, const TileNumbers& cosine, int count) {
    TileNumbers lit;
    const float k_f = float(forward.k);
    const TileRamp ramp(forward.falloff);
    for (int k = 0; k < count; ++k)
        lit[k] = visible[k] * (cosine[k] * ((1 - k_f) + (k_f > 0 ? k_f * ramp(-light.z[k]) : 0)));
    return lit;
}

void SurfaceLighting::add(const LightSample& sample, bool is_sun, SurfaceTile& tile) const {
    const int count = tile.starts.count;
    if (has_back() && !is_sun) add_behind(sample, tile);
    const TileDirections light(prepared_.solid, target_of(sample), tile.starts);
    const TileNumbers cosine = cosines(tile, light);
    if (std::all_of(cosine.begin(), cosine.begin() + count, [](float c) { return c == 0; })) return;
    TileNumbers visible;
    fill_visibility(target_of(sample), tile.starts, visible);
    const TileNumbers lit = lit_share(scene_.material.scatter, light, visible, cosine, count);
    tile.irradiance.add(count, lit, sample.radiance);
    if (parts_.entering) {
        TileSums entering;
        add_entering(count, lit, cosine, sample.radiance, entering);
        tile.entering.add(count, entering);
        if (parts_.inward) add_inward(entering, light, tile);
    }
    if (parts_.reflected) add_reflected(lit, light, sample.radiance, tile);
    if (parts_.highlight && !is_sun)  // a sky's table has the suns as well
        add_highlight(visible, cosine, light, sample.radiance, tile);
}

void SurfaceLighting::add_highlight(const TileNumbers& visible, const TileNumbers& cosine,
                                    const TileDirections& light, Rgb radiance,
                                    SurfaceTile& tile) const {
    TileNumbers shine{};
    for (int k = 0; k < tile.starts.count; ++k)
        if (cosine[k] > 0 && visible[k] > 0)
            shine[k] =
                visible[k] * float(lobe_value(scene_.material, {light.x[k], light.y[k], light.z[k]},
                                              tile.normal(k, scene_.normal_scale)));
    tile.highlight.add(tile.starts.count, shine, radiance);
}

void SurfaceLighting::add_entering(int count, const TileNumbers& lit, const TileNumbers& cosine,
                                   Rgb radiance, TileSums& entering) const {
    if (film_) {
        for (int k = 0; k < count; ++k)
            entering.add(k, lit[k] * (film_->entering(cosine[k]) * radiance));
        return;
    }
    TileNumbers share;
    for (int k = 0; k < count; ++k)
        share[k] = lit[k] * float(scatter::transmittance(cosine[k], scene_.material.medium.eta));
    entering.add(count, share, radiance);
}

// A light's way below the surface, by what of it enters.
void SurfaceLighting::add_inward(const TileSums& entering, const TileDirections& light,
                                 SurfaceTile& tile) const {
    const double eta = scene_.material.medium.eta;
    for (int k = 0; k < tile.starts.count; ++k) {
        const double weight = luminance(entering.at(k));
        if (!(weight > 0)) continue;
        const Vec3 w =
            scatter::refracted({light.x[k], light.y[k], light.z[k]}, tile.normal(k, 1), eta);
        tile.inward.add(k, Rgb{weight * w.x, weight * w.y, weight * w.z});
    }
}

void SurfaceLighting::add_reflected(const TileNumbers& lit, const TileDirections& light,
                                    Rgb radiance, SurfaceTile& tile) const {
    for (int k = 0; k < tile.starts.count; ++k)
        if (lit[k] > 0)
            tile.reflected.add(k, lit[k] * (film_->reflected({light.x[k], light.y[k], light.z[k]},
                                                             tile.normal(k, 1)) *
                                            radiance));
}

void SurfaceLighting::add_diffuse_entering(int k, Rgb lit, SurfaceTile& tile) const {
    const Rgb entering = film_ ? film_->diffuse_entering() * lit : diffuse_entry_ * lit;
    tile.entering.add(k, entering);
    if (!parts_.inward) return;
    const Vec3 w = -(diffuse_depth_ * luminance(entering)) * tile.normal(k, 1);
    tile.inward.add(k, Rgb{w.x, w.y, w.z});
}

// Skies without their suns: E / pi is what they know, and light from everywhere enters as diffuse
// light does.
void SurfaceLighting::add_skies(std::span<const TexelIndex> texels, SurfaceTile& tile) const {
    for (int k = 0; k < tile.starts.count && has_back(); ++k)
        tile.entering_behind.add(k, behind_skies_);
    for (std::size_t n = 0; n < lights_.skies.size(); ++n) {
        if (!lights_.skies[n]) continue;
        const std::vector<Rgb> lit = lights_.skies[n]->diffuse(texels);
        for (int k = 0; k < tile.starts.count; ++k) {
            tile.irradiance.add(k, lit[k]);
            if (parts_.entering) add_diffuse_entering(k, lit[k], tile);
            if (parts_.reflected)
                tile.reflected.add(k, film_->diffuse_reflected(tile.normal_z[k]) * lit[k]);
            if (parts_.highlight)
                tile.highlight.add(k, lobe_tables_[n]->at(tile.normal(k, scene_.normal_scale)));
        }
    }
}

std::vector<LightSample> SurfaceLighting::environment_samples(std::size_t light,
                                                              const RenderControl& control) const {
    const auto& environment = std::get<EnvironmentLight>(scene_.lights[light]);
    return samples_of(environment, {},
                      *shared_environment_lights(environment, final_environment, control.cache));
}

// Of all of an environment, as for its other highlights: shadows are not in it.
std::unique_ptr<const NormalTable> SurfaceLighting::lobe_table(std::span<const LightSample> samples,
                                                               const RenderControl& control) const {
    constexpr int size = 97;  // a step turns the normal by a degree in the middle
    return std::make_unique<const NormalTable>(
        size,
        [&](Vec3 normal) {
            Rgb sum;
            for (const LightSample& sample : samples)
                if (dot(normal, sample.at) > 0)
                    sum = sum + lobe_value(scene_.material, sample.at, normal) * sample.radiance;
            return sum;
        },
        control);
}

void store(const TileSums& sums, std::span<const TexelIndex> texels, Image& image) {
    if (image.empty()) return;
    for (int k = 0; k < int(texels.size()); ++k) {
        const Rgb c = sums.at(k);
        float* const out = &image.at(texels[k].i, texels[k].j);
        out[0] = float(c.r), out[1] = float(c.g), out[2] = float(c.b);
    }
}

void store_inward(const SurfaceTile& tile, std::span<const TexelIndex> texels, Image& image) {
    TileSums mean;
    for (int k = 0; k < tile.starts.count; ++k) {
        const double weight = luminance(tile.entering.at(k));
        if (weight > 0) mean.add(k, (1 / weight) * tile.inward.at(k));
    }
    store(mean, texels, image);
}

// The texels of a square of the map that are material.
std::vector<TexelIndex> solid_texels(const HeightField& field, int column, int row) {
    std::vector<TexelIndex> texels;
    texels.reserve(RayTile::max_rays);
    for (int j = row; j < std::min(row + RayTile::side, field.height()); ++j)
        for (int i = column; i < std::min(column + RayTile::side, field.width()); ++i)
            if (field.is_solid(i, j)) texels.push_back({i, j});
    return texels;
}

}  // namespace

SurfaceLight surface_light(const Scene& scene, const Output& output, const PreparedSolid& prepared,
                           SurfaceLightParts parts, const FilmLight* film,
                           const RenderControl& control) {
    assert(scene.material.illumination != Illumination::count);
    const HeightField& field = *scene.field;
    const SurfaceLighting lighting(scene, output, prepared, parts, film, control);
    const auto image = [&](bool is_wanted) {
        return is_wanted ? Image(field.width(), field.height(), 3) : Image();
    };
    SurfaceLight light{.irradiance = image(true),
                       .entering = image(parts.entering),
                       .entering_behind = image(lighting.has_back()),
                       .inward = image(parts.inward),
                       .highlight = image(parts.highlight),
                       .reflected = image(parts.reflected),
                       .coarse_directions = lighting.coarse_directions()};
    constexpr int side = RayTile::side;
    const int across = (field.width() + side - 1) / side;
    const int down = (field.height() + side - 1) / side;
    parallel_rows(control.executor, across * down, control.stop, [&](RowRange squares) {
        for (int n = squares.begin; n < squares.end; ++n) {
            const auto texels = solid_texels(field, n % across * side, n / across * side);
            if (texels.empty()) continue;
            const SurfaceTile tile = lighting.lit(texels, control.stop);
            store(tile.irradiance, texels, light.irradiance);
            store(tile.entering, texels, light.entering);
            store(tile.entering_behind, texels, light.entering_behind);
            store_inward(tile, texels, light.inward);
            store(tile.highlight, texels, light.highlight);
            store(tile.reflected, texels, light.reflected);
        }
    });
    return light;
}

}  // namespace relit
