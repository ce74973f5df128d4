// The thesis's own measure of the light's path: how many of S + 1 evenly spaced samples lie inside
// the solid. For `count` illumination, kept literal. Source: integrated model, section 2 (count);
// Perumal 2017, 4.3.1.
#pragma once

#include "core/base/vec.h"
#include "core/field/solid.h"

namespace relit {

/// s = 1 + the number of samples from + i (to - from)/steps, i = 0..steps, that lie inside the
/// solid.
///
/// @param steps  S >= 1
/// @return       s in [1, steps + 2]; d = 1/s
[[nodiscard]] int sample_count(const Solid& solid, Vec3 from, Vec3 to, int steps) noexcept;

}  // namespace relit
