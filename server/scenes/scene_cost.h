// What a picture will cost, told from the scene before anything is decoded or marched: so that what is
// legal in each field and absurd in all of them together is refused at once. For whoever takes scenes
// from strangers.
#pragma once

#include <string>

#include "server/limits.h"
#include "server/schema/description.h"

namespace relit::server {

struct SceneCost {
    /// Texels times the samples of light that are marched from each, about 45 ns of a thread each on
    /// maps of a million texels; other work in the same measure. Within a factor of 4 or so.
    double texel_samples = 0;
    std::string heaviest;  ///< pointer to the field that weighs most
};

/// Of the final picture, or of a preview, whose map and environments are coarser.
/// @param map_width, map_height  of the height map, texels
/// @param is_noise  it takes away an environment's short cut (SkyLight::is_noise()); known once the map
///                  is there
[[nodiscard]] SceneCost scene_cost(const SceneDescription& scene, int map_width, int map_height,
                                   bool is_noise = false);

struct SceneMemory {
    /// That the map, what is prepared of it and the picture take at most while it is rendered.
    double bytes = 0;
    std::string largest;  ///< pointer to the field that takes most
};

/// Of maps of millions of texels within a quarter or so; colour images and environments of other sizes
/// than the map are left out, as their own limits bound them.
[[nodiscard]] SceneMemory scene_memory(const SceneDescription& scene, int map_width,
                                       int map_height);

/// @throws Error too_costly, with the cost and the limit (max-scene-cost), or the memory and its limit
///         (max-render-memory); `pointer` is the heaviest field
void check_cost(const SceneDescription& scene, int map_width, int map_height, const Limits& limits,
                bool is_noise = false);

}  // namespace relit::server
