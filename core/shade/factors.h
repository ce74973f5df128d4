// The factors of the integrated model, one pure function of numbers each: illumination d, specular
// s, scatter f. For the pixel formula in render/. Source: integrated model, sections 2 and 4;
// Perumal 2017, 3.3 to 3.5, 4.3.5, 4.3.6.
#pragma once

#include <algorithm>
#include <cmath>

#include "core/base/vec.h"
#include "core/shade/material.h"

namespace relit {

/// d = min(1, t/r); 1 when r = 0, 0 when r is endless.
inline double length_illumination(double t, double r) { return r > t ? t / r : 1; }

/// d = exp(-a max(0, r - t)); 0 when r is endless.
inline double exponential_illumination(double t, double r, double attenuation) {
    return std::exp(-attenuation * std::max(0.0, r - t));
}

/// clamp((c - lo)/(hi - lo), 0, 1).
inline double ramp(double c, Falloff falloff) {
    return std::clamp((c - falloff.lo) / (falloff.hi - falloff.lo), 0.0, 1.0);
}

/// s = ramp(R . l), R = 2 (n . v) n - v the view vector v = (0, 0, 1) mirrored at the normal.
/// @param normal, to_light  unit vectors
inline double specular_factor(Vec3 normal, Vec3 to_light, Falloff falloff) {
    const Vec3 mirrored = 2 * normal.z * normal - Vec3{0, 0, 1};
    return ramp(dot(mirrored, to_light), falloff);
}

/// f = ramp(-v . l): 1 with the light straight behind.
inline double scatter_factor(Vec3 to_light, Falloff falloff) { return ramp(-to_light.z, falloff); }

}  // namespace relit
