#include "core/render/shader.h"

#include "core/field/normals.h"
#include "core/shade/factors.h"
#include "core/visibility/inside_length.h"
#include "core/visibility/sample_count.h"

namespace relit {
namespace {

Ray ray_to(const LightSample& sample, Vec3 start) {
    return sample.at_infinity ? ray_along(start, sample.at) : ray_to_point(start, sample.at);
}

}  // namespace

Shader::Shader(const Scene& scene, Transfer transfer, EnvironmentSampling sampling)
    : scene_(scene),
      solid_(make_solid(scene.field, scene.relief, scene.base, scene.material.depth)),
      first_light_samples_(0),
      base_(shading_colour(scene.material.base_colour, transfer)),
      diffuse_(shading_colour(scene.material.diffuse_colour, transfer)),
      specular_(shading_colour(scene.material.specular_colour, transfer)) {
    assert(!scene.lights.empty());
    for (const Light& light : scene.lights) {
        const std::vector<LightSample> of_light =
            samples_of(light, {solid_.y_size()}, transfer, sampling);
        samples_.insert(samples_.end(), of_light.begin(), of_light.end());
        if (first_light_samples_ == 0) first_light_samples_ = of_light.size();
    }
}

Shader::Texel Shader::texel(int i, int j) const {
    const Slopes slopes = slopes_at(scene_.field, scene_.relief, i, j);
    const Vec3 inward =
        scene_.material.offset == Offset::normal ? normal_from(slopes) : Vec3{0, 0, 1};
    return {surface_point(solid_, i, j) - scene_.material.depth * inward,
            normal_from(slopes, scene_.normal_scale)};
}

double Shader::illumination(const LightSample& sample, const Ray& ray) const {
    const Material& m = scene_.material;
    if (m.illumination == Illumination::count) {
        assert(!sample.at_infinity);
        return 1.0 / sample_count(solid_, ray.from, sample.at, m.steps);
    }
    const double r = inside_length(solid_, ray);
    return m.illumination == Illumination::length
               ? length_illumination(m.depth, r)
               : exponential_illumination(m.depth, r, m.attenuation);
}

template <class Add>
void Shader::for_each_highlight(const LightSample& sample, const Texel& at, const Add& add) const {
    const Falloff falloff = scene_.material.specular.falloff;
    const auto factor = [&](Vec3 place) {
        const Vec3 to_light = sample.at_infinity ? place : normalized(place - at.start);
        return specular_factor(at.normal, to_light, falloff);
    };
    if (sample.parts.empty()) add(factor(sample.at), sample.radiance, sample.weight);
    for (const SamplePart& part : sample.parts) add(factor(part.at), part.radiance, part.weight);
}

Rgb Shader::highlight(const LightSample& sample, const Texel& at) const {
    Rgb sum;
    if (scene_.material.specular.k == 0) return sum;
    for_each_highlight(sample, at,
                       [&](double s, Rgb radiance, double) { sum = sum + s * radiance; });
    return sum;
}

Rgb Shader::albedo(int i, int j) const {
    const Image& map = scene_.field.albedo;
    return map.empty() ? Rgb{1, 1, 1} : Rgb{map.at(i, j, 0), map.at(i, j, 1), map.at(i, j, 2)};
}

Rgb Shader::beauty(int i, int j) const {
    const Material& m = scene_.material;
    const Texel at = texel(i, j);
    const double matt = 1 - m.specular.k;
    Rgb diffuse;
    Rgb glossy;
    for (const LightSample& sample : samples_) {
        if (sample.radiance == Rgb{}) continue;
        const Ray ray = ray_to(sample, at.start);
        const double f = scatter_factor(ray.direction, m.scatter.falloff);
        const double matt_share = matt * ((1 - m.scatter.k) + m.scatter.k * f);
        const Rgb gloss = highlight(sample, at);
        // Light that d cannot change needs no march.
        const bool needs_d = matt_share > 0 || (m.specular.occlude && !(gloss == Rgb{}));
        const double d = needs_d ? illumination(sample, ray) : 0;
        diffuse = diffuse + (matt_share * d) * sample.radiance;
        glossy = glossy + (m.specular.occlude ? d : 1) * gloss;
    }
    return matt * base_ + albedo(i, j) * diffuse_ * diffuse + m.specular.k * specular_ * glossy;
}

template <class Value>
double Shader::mean_over_first_light(const Value& value) const {
    double sum = 0;
    for (std::size_t q = 0; q < first_light_samples_; ++q)
        sum += samples_[q].weight * value(samples_[q]);
    return sum;
}

double Shader::illumination(int i, int j) const {
    const Vec3 start = texel(i, j).start;
    return mean_over_first_light(
        [&](const LightSample& sample) { return illumination(sample, ray_to(sample, start)); });
}

double Shader::thickness(int i, int j) const {
    assert(first_light_samples_ == 1);
    const Vec3 start = texel(i, j).start;
    return inside_length(solid_, ray_to(samples_.front(), start));
}

double Shader::specular(int i, int j) const {
    const Texel at = texel(i, j);
    double sum = 0;
    for (std::size_t q = 0; q < first_light_samples_; ++q)
        for_each_highlight(samples_[q], at,
                           [&](double s, Rgb, double weight) { sum += weight * s; });
    return sum;
}

double Shader::scatter(int i, int j) const {
    const Vec3 start = texel(i, j).start;
    return mean_over_first_light([&](const LightSample& sample) {
        return scatter_factor(ray_to(sample, start).direction, scene_.material.scatter.falloff);
    });
}

Vec3 Shader::normal(int i, int j) const { return texel(i, j).normal; }

}  // namespace relit
