#include "core/light/light.h"

#include <cmath>

#include "core/base/angle.h"
#include "core/light/environment.h"

namespace relit {
namespace {

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
    return samples_of(light, extent, gathered_environment(*light.map, light.weighting, sampling));
}

}  // namespace

std::vector<LightSample> samples_of(const Light& light, MapExtent extent, Transfer transfer,
                                    EnvironmentSampling sampling) {
    return std::visit([&](const auto& l) { return samples(l, extent, transfer, sampling); }, light);
}

}  // namespace relit
