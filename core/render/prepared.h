// What renders of one map have in common, whatever lights it: made once, kept in the caller's cache.
// For render().
#pragma once

#include <functional>
#include <memory>
#include <stop_token>
#include <string>

#include "core/field/map_slopes.h"
#include "core/light/environment.h"
#include "core/render/fringe.h"
#include "core/render/render.h"
#include "core/transport/directional_sum.h"
#include "core/transport/transport.h"
#include "core/visibility/inside_lengths.h"
#include "core/visibility/sky_transfer.h"

namespace relit {

/// A solid, its form for packets of rays, and its slopes.
struct PreparedSolid {
    Solid solid;
    PacketSolid packets;  ///< of `solid`
    MapSlopes slopes;
    MapSlopes bumped_slopes;  ///< with those of the bump map; empty: there is none
    double roughness;         ///< SkyTransfer::roughness()

    PreparedSolid(const Scene& scene, const RenderControl& control);

    /// What normals to shade with are made of.
    [[nodiscard]] const MapSlopes& shading_slopes() const {
        return bumped_slopes.empty() ? slopes : bumped_slopes;
    }
};

/// The scene's solid. From the cache, as all here, where the map has a key.
[[nodiscard]] std::shared_ptr<const PreparedSolid> prepared_solid(const Scene& scene,
                                                                  const RenderControl& control);

/// The nearest solid texels of a map with a mask.
[[nodiscard]] std::shared_ptr<const NearestSolid> nearest_solid(const HeightField& field,
                                                                SharedCache* cache);

/// smaller_field() of a map. @throws Error cancelled
[[nodiscard]] std::shared_ptr<const HeightField> smaller_shared_field(const HeightField& field,
                                                                      int width, int height,
                                                                      const RenderControl& control);

/// An environment as lights. @param light  its map and weighting count
[[nodiscard]] std::shared_ptr<const GatheredEnvironment> shared_environment_lights(
    const EnvironmentLight& light, EnvironmentSampling sampling, SharedCache* cache);

/// The scene's surface as samples of its texels; those that are no material have no area.
[[nodiscard]] std::shared_ptr<const TransportSurface> prepared_surface(
    const Scene& scene, const PreparedSolid& prepared, const RenderControl& control);

/// Names a material's medium and its size, numbers and all.
[[nodiscard]] std::string medium_key(const Material& m);

/// How light is carried below a surface: a profile per colour, in scene units.
struct CarryingKernel {
    std::string name;  ///< names the profiles, numbers and all, for a cache
    std::function<RadialProfile(int colour)> profile;
};

/// What sums light over a scene's surface. @throws Error cancelled
[[nodiscard]] std::shared_ptr<const Transport> prepared_transport(
    const Scene& scene, std::shared_ptr<const TransportSurface> surface,
    const CarryingKernel& kernel, TransportAccuracy accuracy, const RenderControl& control);

/// What sums the directional dipole of the scene's material over its surface. @throws Error cancelled
[[nodiscard]] std::shared_ptr<const DirectionalSum> prepared_directional_sum(
    const Scene& scene, const PreparedSolid& prepared, const TransportSurface& surface,
    TransportAccuracy accuracy, const RenderControl& control);

/// What the light of a sky does to the texels of `part`.
struct PreparedSky {
    std::shared_ptr<const SkyTransfer> transfer;
    bool coarse = false;  ///< of fewer directions than a final picture takes
};

/// As exact as for a final picture, or less where `preview` says that this will do and it is not
/// there yet. @pre SkyTransfer::covers() the scene's solid. @throws Error cancelled
[[nodiscard]] PreparedSky prepared_sky(const Scene& scene, const Solid& solid, Rect part,
                                       bool preview, const RenderControl& control);

}  // namespace relit
