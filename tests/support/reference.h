// The integrated model the slow and obvious way, to hold the renderer against: double precision, a
// dense march, the full sum over every texel of an environment. Shares Scene, as plain data, with
// core, and nothing that computes: no visibility, normals, lights or shading. Written from the
// specification (integrated model, sections 1 to 6), short enough to check by eye.
#pragma once

#include "core/render/scene.h"

namespace relit::reference {

struct Result {
    double illumination = 0;       // weighted mean of d over the first light
    double r = 0;                  // of the first light's first sample
    double colour[3] = {0, 0, 0};  // section 5, transfer srgb
};

/// The numbers of texel (i, j), which must be material. @param step march step in texels, at most
/// 1/8
Result shade(const Scene& scene, int i, int j, double step = 1.0 / 16);

}  // namespace relit::reference
