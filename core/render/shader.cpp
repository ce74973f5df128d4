#include "core/render/shader.h"

#include <limits>

#include "core/field/normals.h"
#include "core/shade/factors.h"
#include "core/visibility/inside_length.h"
#include "core/visibility/sample_count.h"

namespace relit {

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

Shader::Path Shader::path(Vec3 start, const LightSample& sample) {
    if (sample.at_infinity) return {sample.at, std::numeric_limits<double>::infinity()};
    const Vec3 way = sample.at - start;
    return {normalized(way), length(way)};
}

double Shader::illumination(Vec3 start, const Path& path) const {
    const Material& m = scene_.material;
    if (m.illumination == Illumination::count) {
        assert(path.distance < std::numeric_limits<double>::infinity());
        return 1.0 / sample_count(solid_, start, start + path.distance * path.to_light, m.steps);
    }
    const double r = inside_length(solid_, start, path.to_light, path.distance);
    return m.illumination == Illumination::length
               ? length_illumination(m.depth, r)
               : exponential_illumination(m.depth, r, m.attenuation);
}

Rgb Shader::beauty(int i, int j) const {
    const Material& m = scene_.material;
    const Texel at = texel(i, j);
    const Rgb albedo = scene_.field.albedo.empty()
                           ? Rgb{1, 1, 1}
                           : Rgb{scene_.field.albedo.at(i, j, 0), scene_.field.albedo.at(i, j, 1),
                                 scene_.field.albedo.at(i, j, 2)};
    const double matt = 1 - m.specular.k;
    Rgb diffuse;
    Rgb glossy;
    for (const LightSample& sample : samples_) {
        if (sample.radiance == Rgb{}) continue;
        const Path way = path(at.start, sample);
        const double f = scatter_factor(way.to_light, m.scatter.falloff);
        const double s =
            m.specular.k > 0 ? specular_factor(at.normal, way.to_light, m.specular.falloff) : 0;
        const double matt_share = matt * ((1 - m.scatter.k) + m.scatter.k * f);
        // Light that d cannot change needs no march.
        const bool needs_d = matt_share > 0 || (m.specular.occlude && s > 0);
        const double d = needs_d ? illumination(at.start, way) : 0;
        diffuse = diffuse + float(matt_share * d) * sample.radiance;
        glossy = glossy + float(m.specular.k * s * (m.specular.occlude ? d : 1)) * sample.radiance;
    }
    return float(matt) * base_ + albedo * diffuse_ * diffuse + specular_ * glossy;
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
        [&](const LightSample& sample) { return illumination(start, path(start, sample)); });
}

double Shader::thickness(int i, int j) const {
    assert(first_light_samples_ == 1);
    const Vec3 start = texel(i, j).start;
    const Path way = path(start, samples_.front());
    return inside_length(solid_, start, way.to_light, way.distance);
}

double Shader::specular(int i, int j) const {
    const Texel at = texel(i, j);
    return mean_over_first_light([&](const LightSample& sample) {
        return specular_factor(at.normal, path(at.start, sample).to_light,
                               scene_.material.specular.falloff);
    });
}

double Shader::scatter(int i, int j) const {
    const Vec3 start = texel(i, j).start;
    return mean_over_first_light([&](const LightSample& sample) {
        return scatter_factor(path(start, sample).to_light, scene_.material.scatter.falloff);
    });
}

Vec3 Shader::normal(int i, int j) const { return texel(i, j).normal; }

}  // namespace relit
