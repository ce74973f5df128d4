#include "core/render/shader.h"

#include <algorithm>

#include "core/field/normals.h"
#include "core/shade/factors.h"
#include "core/visibility/sample_count.h"

namespace relit {
namespace {

RayTarget target_of(const LightSample& sample) { return {sample.at, sample.at_infinity}; }

}  // namespace

Shader::Shader(const Scene& scene, Transfer transfer, EnvironmentSampling sampling,
               const RenderControl& control, SkyLights skies)
    : scene_(scene),
      field_(*scene.field),
      prepared_(prepared_solid(scene, control)),
      solid_(prepared_->solid),
      packets_(prepared_->packets),
      first_light_samples_(0),
      skies_(std::move(skies)),
      base_(shading_colour(scene.material.base_colour, transfer)),
      diffuse_(shading_colour(scene.material.diffuse_colour, transfer)),
      specular_(shading_colour(scene.material.specular_colour, transfer)) {
    for (int i = 0; i < solid_.width; ++i) column_x_.push_back(surface_point(solid_, i, 0).x);
    for (int j = 0; j < solid_.height; ++j) row_y_.push_back(surface_point(solid_, 0, j).y);
    assert(!scene.lights.empty());
    assert(skies_.empty() || skies_.size() == scene.lights.size());
    for (std::size_t n = 0; n < scene.lights.size(); ++n) {
        if (!skies_.empty() && skies_[n]) continue;
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

Vec3 Shader::start(TexelIndex at) const { return starts({&at, 1}).front(); }

std::vector<Vec3> Shader::starts(std::span<const TexelIndex> texels) const {
    // A tile's rows lie far apart in memory: ask for all of them before waiting for the first.
    for (std::size_t k = 0; k < texels.size(); k += 16) {
        const int below = std::min(texels[k].j + 1, solid_.height - 1);
        __builtin_prefetch(&field_.heights.row(below)[texels[k].i]);
        __builtin_prefetch(&solid_.z.row(texels[k].j + 1)[texels[k].i + 1]);
    }
    std::vector<Vec3> from(texels.size());
    std::vector<Slopes> slopes(texels.size());  // none: offset along the view
    if (scene_.material.offset == Offset::normal)
        for (std::size_t k = 0; k < texels.size(); ++k)
            slopes[k] = slopes_at(field_, scene_.relief, texels[k].i, texels[k].j);
    for (std::size_t k = 0; k < texels.size(); ++k)
        from[k] = {column_x_[texels[k].i], row_y_[texels[k].j],
                   solid_.z.at(texels[k].i + 1, texels[k].j + 1)};
    for (std::size_t k = 0; k < texels.size(); ++k)
        from[k] = from[k] - scene_.material.depth * normal_from(slopes[k]);
    return from;
}

Vec3 Shader::normal(TexelIndex at) const {
    return normal_from(slopes_at(field_, scene_.relief, at.i, at.j), scene_.normal_scale);
}

void Shader::illuminate(const LightSample& sample, std::span<const Vec3> from,
                        std::span<double> d) const {
    const Material& m = scene_.material;
    if (m.illumination == Illumination::count) {
        assert(!sample.at_infinity);
        for (std::size_t k = 0; k < from.size(); ++k)
            d[k] = 1.0 / sample_count(solid_, from[k], sample.at, m.steps);
        return;
    }
    packets_.inside_lengths(target_of(sample), from, d);
    if (m.illumination == Illumination::length)
        for (double& r : d) r = length_illumination(m.depth, r);
    else
        for (double& r : d) r = exponential_illumination(m.depth, r, m.attenuation);
}

template <class Add>
void Shader::for_each_highlight(const LightSample& sample, Vec3 from, Vec3 normal,
                                const Add& add) const {
    const Falloff falloff = scene_.material.specular.falloff;
    const auto factor = [&](Vec3 place) {
        const Vec3 to_light = sample.at_infinity ? place : normalized(place - from);
        return specular_factor(normal, to_light, falloff);
    };
    if (sample.parts.empty()) add(factor(sample.at), sample.radiance, sample.weight);
    for (const SamplePart& part : sample.parts) add(factor(part.at), part.radiance, part.weight);
}

Rgb Shader::highlight(const LightSample& sample, Vec3 from, Vec3 normal) const {
    Rgb sum;
    for_each_highlight(sample, from, normal,
                       [&](double s, Rgb radiance, double) { sum = sum + s * radiance; });
    return sum;
}

Rgb Shader::albedo(TexelIndex at) const {
    const Image& map = field_.albedo;
    if (map.empty()) return {1, 1, 1};
    return {map.at(at.i, at.j, 0), map.at(at.i, at.j, 1), map.at(at.i, at.j, 2)};
}

std::vector<Rgb> Shader::beauty(std::span<const TexelIndex> texels,
                                const std::stop_token& stop) const {
    const Material& m = scene_.material;
    const double matt = 1 - m.specular.k;
    std::vector<Vec3> from, normals;
    if (!samples_.empty()) from = starts(texels);
    if (m.specular.k > 0)
        for (const TexelIndex at : texels) normals.push_back(normal(at));

    std::vector<double> matt_share(texels.size(), matt), d(texels.size());
    std::vector<Rgb> gloss(texels.size()), diffuse(texels.size()), glossy(texels.size());
    for (const auto& sky : skies_) {
        if (!sky) continue;
        const std::vector<Rgb> sums =
            matt > 0 ? sky->diffuse(texels) : std::vector<Rgb>(texels.size());
        for (std::size_t k = 0; k < texels.size(); ++k) {
            diffuse[k] = diffuse[k] + matt * sums[k];
            if (m.specular.k > 0) glossy[k] = glossy[k] + sky->highlight(normals[k]);
        }
    }
    for (const LightSample& sample : samples_) {
        if (sample.radiance == Rgb{}) continue;
        if (stop.stop_requested()) break;
        // Light that d cannot change needs no march.
        bool needs_d = false;
        for (std::size_t k = 0; k < texels.size(); ++k) {
            if (m.scatter.k > 0) {
                const Vec3 to_light = ray_to(target_of(sample), from[k]).direction;
                const double f = scatter_factor(to_light, m.scatter.falloff);
                matt_share[k] = matt * ((1 - m.scatter.k) + m.scatter.k * f);
            }
            if (m.specular.k > 0) gloss[k] = highlight(sample, from[k], normals[k]);
            needs_d |= matt_share[k] > 0 || (m.specular.occlude && !(gloss[k] == Rgb{}));
        }
        if (needs_d) illuminate(sample, from, d);
        for (std::size_t k = 0; k < texels.size(); ++k) {
            diffuse[k] = diffuse[k] + (matt_share[k] * d[k]) * sample.radiance;
            glossy[k] = glossy[k] + (m.specular.occlude ? d[k] : 1) * gloss[k];
        }
    }
    std::vector<Rgb> colours(texels.size());
    for (std::size_t k = 0; k < texels.size(); ++k)
        colours[k] = matt * base_ + albedo(texels[k]) * diffuse_ * diffuse[k] +
                     m.specular.k * specular_ * glossy[k];
    return colours;
}

void Shader::beauty_row(int i, int j, int count, float* out) const {
    assert(!sends_rays());
    const Material& m = scene_.material;
    const double matt = 1 - m.specular.k;
    const Rgb base = matt * base_, diffuse = matt * diffuse_, glossy = m.specular.k * specular_;
    std::vector<Rgb> sums(count);
    for (const auto& sky : skies_)
        if (matt > 0) sky->add_diffuse(i, j, sums);
    for (int k = 0; k < count; ++k, out += 3) {
        const TexelIndex at{i + k, j};
        Rgb colour = base + albedo(at) * diffuse * sums[k];
        if (m.specular.k > 0) {
            const Vec3 n = normal(at);
            for (const auto& sky : skies_) colour = colour + glossy * sky->highlight(n);
        }
        out[0] = stored_number(colour.r);
        out[1] = stored_number(colour.g);
        out[2] = stored_number(colour.b);
    }
}

std::vector<double> Shader::illumination(std::span<const TexelIndex> texels,
                                         const std::stop_token& stop) const {
    std::vector<double> mean(texels.size()), d(texels.size());
    if (first_sky_) {
        const std::vector<Rgb> sums = first_sky_->diffuse(texels);
        for (std::size_t k = 0; k < texels.size(); ++k) mean[k] = std::min(sums[k].r, 1.0);
        return mean;
    }
    const std::vector<Vec3> from = starts(texels);
    for (std::size_t q = 0; q < first_light_samples_ && !stop.stop_requested(); ++q) {
        illuminate(samples_[q], from, d);
        for (std::size_t k = 0; k < texels.size(); ++k) mean[k] += samples_[q].weight * d[k];
    }
    return mean;
}

std::vector<double> Shader::thickness(std::span<const TexelIndex> texels) const {
    assert(first_light_samples_ == 1);
    std::vector<double> r(texels.size());
    packets_.inside_lengths(target_of(samples_.front()), starts(texels), r);
    return r;
}

double Shader::specular(TexelIndex at) const {
    if (first_sky_) return first_sky_->highlight(normal(at)).r;
    double sum = 0;
    for (std::size_t q = 0; q < first_light_samples_; ++q)
        for_each_highlight(samples_[q], start(at), normal(at),
                           [&](double s, Rgb, double weight) { sum += weight * s; });
    return sum;
}

double Shader::scatter(TexelIndex at) const {
    if (first_sky_) return first_sky_->scatter().r;
    double sum = 0;
    for (std::size_t q = 0; q < first_light_samples_; ++q) {
        const Vec3 to_light = ray_to(target_of(samples_[q]), start(at)).direction;
        sum += samples_[q].weight * scatter_factor(to_light, scene_.material.scatter.falloff);
    }
    return sum;
}

}  // namespace relit
