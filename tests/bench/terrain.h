// The map that the benchmarks measure on.
#pragma once

#include "core/field/height_field.h"

namespace relit::bench {

/// Fractal terrain of `size` x `size` texels with heights 0..1; made once.
[[nodiscard]] const HeightField& terrain(int size);

}  // namespace relit::bench
