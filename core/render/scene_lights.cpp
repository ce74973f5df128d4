#include "core/render/scene_lights.h"

#include <cassert>

namespace relit {

SceneLights scene_lights(const Scene& scene, Transfer transfer, EnvironmentSampling sampling,
                         double y_size, SkyLights skies, SharedCache* cache) {
    assert(!scene.lights.empty());
    assert(skies.empty() || skies.size() == scene.lights.size());
    SceneLights lights{.skies = std::move(skies)};
    for (std::size_t n = 0; n < scene.lights.size(); ++n) {
        if (!lights.skies.empty() && lights.skies[n]) {
            const std::vector<LightSample>& suns = lights.skies[n]->suns();
            lights.suns.insert(lights.suns.end(), suns.begin(), suns.end());
            continue;
        }
        const auto* environment = std::get_if<EnvironmentLight>(&scene.lights[n]);
        const std::vector<LightSample> of_light =
            environment ? samples_of(*environment, {y_size},
                                     *shared_environment_lights(*environment, sampling, cache))
                        : samples_of(scene.lights[n], {y_size}, transfer, sampling);
        lights.samples.insert(lights.samples.end(), of_light.begin(), of_light.end());
        if (n == 0) lights.first_light_samples = of_light.size();
    }
    if (!lights.skies.empty()) lights.first_sky = lights.skies.front().get();
    return lights;
}

}  // namespace relit
