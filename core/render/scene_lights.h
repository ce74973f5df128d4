// The lights of a scene as shading takes them: samples to send rays to, and skies that need none.
// For shader.cpp and surface_light.cpp.
#pragma once

#include <vector>

#include "core/render/sky_light.h"

namespace relit {

struct SceneLights {
    std::vector<LightSample> samples;     ///< of all lights that have no sky, in the scene's order
    std::size_t first_light_samples = 0;  ///< how many of them are the first light's
    SkyLights skies;                      ///< one per light, or none at all
    std::vector<LightSample> suns;        ///< of the skies
    const SkyLight* first_sky = nullptr;  ///< the first light, if it is one
};

/// What stands for environments that are no skies, in a picture of that accuracy.
[[nodiscard]] inline EnvironmentSampling environment_sampling(const Output& output) {
    return output.accuracy == Accuracy::preview ? preview_environment : final_environment;
}

/// @param skies  in place of the samples of some lights: one per light, null where there is none
/// @param y_size  of the map in scene units
[[nodiscard]] SceneLights scene_lights(const Scene& scene, Transfer transfer,
                                       EnvironmentSampling sampling, double y_size, SkyLights skies,
                                       SharedCache* cache);

}  // namespace relit
