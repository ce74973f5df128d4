// How much of a ray lies inside the solid: r, the one quantity that gives shading, shadow and
// translucency. For inside_lengths(), which leaves to it what packets cannot do, and for tests.
// Source: integrated model, section 2; Perumal 2017, 3.2.1.
//
// This is the exact scalar march: the meaning of r in this project. Faster ones are held against
// it.
#pragma once

#include "core/field/solid.h"
#include "core/visibility/ray.h"

namespace relit {

/// Length of the part of a ray that lies inside the solid, in scene units.
///
/// @param solid  what is lit
/// @param ray    starts usually `depth` below the surface
/// @return       r in [0, ray.distance]; infinity over endless ground when the light is in it or
///               behind it
///
/// Exact for the bilinear surface up to 1e-9 scene units. Allocates nothing; safe from any thread.
[[nodiscard]] double inside_length(const Solid& solid, const Ray& ray) noexcept;

}  // namespace relit
