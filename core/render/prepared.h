// What renders of one map have in common, whatever lights it: made once, kept in the caller's cache.
// For render().
#pragma once

#include <memory>
#include <stop_token>

#include "core/render/fringe.h"
#include "core/render/render.h"
#include "core/visibility/inside_lengths.h"

namespace relit {

/// A solid, its form for packets of rays, and its slopes.
struct PreparedSolid {
    Solid solid;
    PacketSolid packets;  ///< of `solid`
    Image slopes;         ///< dz/dx and dz/dy of every texel (normals.h)

    PreparedSolid(const Scene& scene, const RenderControl& control);
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

}  // namespace relit
