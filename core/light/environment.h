// Environment maps: where the texels of an equirectangular image lie on the sphere, what they
// weigh, and how many of them become few. For samples_of(). Sources: integrated model, section 6;
// Debevec 2005, "A median cut algorithm for light probe sampling".
#pragma once

#include <cstdint>

#include "core/light/light.h"

namespace relit {

/// Unit direction of the centre of texel (i, j) of a width x height map, before rotation.
[[nodiscard]] Vec3 environment_direction(int i, int j, int width, int height);

[[nodiscard]] Vec3 rotated(Vec3 direction, Rotation rotation);

/// Mean luminance over the sphere, texels weighted by solid angle.
[[nodiscard]] double mean_luminance(const Image& map);

/// A part of an environment taken as one light: its mean direction (unit, before rotation), the sum
/// of its weights and its weighted colours.
struct EnvironmentRegion {
    Vec3 direction;
    double weight = 0;              ///< the weights of all regions sum to 1
    Rgb radiance;                   ///< sum of weight * colour
    std::vector<SamplePart> parts;  ///< where it has more than one texel; directions as above
};

/// The map as regions: its texels where they are few enough, else `sampling.regions` rectangles of
/// texels, the most important one halved again and again. Importance is weight times the mean of 1
/// and the relative luminance, so that neither a region's energy nor its size gets out of hand.
[[nodiscard]] std::vector<EnvironmentRegion> environment_regions(const Image& map,
                                                                 Weighting weighting,
                                                                 EnvironmentSampling sampling);

/// An environment's lights before intensity and rotation: what a map and its weighting give, to be
/// kept for all who use them.
struct GatheredEnvironment {
    std::vector<EnvironmentRegion> regions;
    double mean_luminance = 0;  ///< as above

    [[nodiscard]] std::uint64_t bytes() const;
};

[[nodiscard]] GatheredEnvironment gathered_environment(const Image& map, Weighting weighting,
                                                       EnvironmentSampling sampling);

/// The samples of an environment light whose map and weighting `gathered` is made of.
/// @param with_parts  false: nobody asks for highlights
[[nodiscard]] std::vector<LightSample> samples_of(const EnvironmentLight& light, MapExtent extent,
                                                  const GatheredEnvironment& gathered,
                                                  bool with_parts = true);

}  // namespace relit
