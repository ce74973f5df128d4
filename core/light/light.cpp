#include "core/light/light.h"

#include <cmath>

#include "core/base/angle.h"
#include "core/light/environment.h"

namespace relit {
namespace {

// `auto` gives an open plane under a uniform sky 0.4 (section 6).
constexpr double auto_exposure = 1.6;

double intensity_of(const EnvironmentLight& light) {
    if (light.intensity) return *light.intensity;
    const double mean = mean_luminance(*light.map);
    return mean > 0 ? auto_exposure / mean : 0;
}

Vec3 direction_of(const DirectionalLight& light) {
    if (!light.direction) return direction_from(light.azimuth_deg, light.elevation_deg);
    const Vec3 d = *light.direction;
    const double size =
        std::hypot(d.x, d.y, d.z);  // any length: squares of tiny numbers would vanish
    return {d.x / size, d.y / size, d.z / size};
}

std::vector<LightSample> samples(const PointLight& light, MapExtent extent, Transfer transfer,
                                 EnvironmentSampling) {
    const Vec3 at{light.position.x, light.position.y * extent.y_size, light.position.z};
    return {{at, false, light.intensity * shading_colour(light.colour, transfer), 1, {}}};
}

std::vector<LightSample> samples(const DirectionalLight& light, MapExtent, Transfer transfer,
                                 EnvironmentSampling) {
    return {
        {direction_of(light), true, light.intensity * shading_colour(light.colour, transfer), 1, {}}};
}

std::vector<LightSample> samples(const EnvironmentLight& light, MapExtent extent, Transfer,
                                 EnvironmentSampling sampling) {
    const double intensity = intensity_of(light);
    const auto placed = [&](Vec3 direction) {
        const Vec3 turned = rotated(direction, light.rotation);
        if (!light.radius) return turned;
        return Vec3{0.5, 0.5 * extent.y_size, 0} + *light.radius * turned;
    };
    std::vector<LightSample> result;
    for (const EnvironmentRegion& region :
         environment_regions(*light.map, light.weighting, sampling)) {
        LightSample sample{
            placed(region.direction), !light.radius, intensity * region.radiance, region.weight, {}};
        for (const SamplePart& part : region.parts)
            sample.parts.push_back({placed(part.at), intensity * part.radiance, part.weight});
        result.push_back(std::move(sample));
    }
    return result;
}

}  // namespace

std::vector<LightSample> samples_of(const Light& light, MapExtent extent, Transfer transfer,
                                    EnvironmentSampling sampling) {
    return std::visit([&](const auto& l) { return samples(l, extent, transfer, sampling); }, light);
}

}  // namespace relit
