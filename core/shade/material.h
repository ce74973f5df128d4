// What the solid is made of: the integrated model's parameters, plain data with the defaults of the
// interface. Source: integrated model, sections 2, 4 and 5.
#pragma once

#include "core/image/colour.h"

namespace relit {

/// Which d is made of r (section 2).
enum class Illumination {
    length,       ///< min(1, t / r)
    exponential,  ///< exp(-a max(0, r - t))
    count,        ///< 1 / s: samples inside, the thesis's code; needs lights at a finite distance
};

/// Which way p' lies under the surface (section 2).
enum class Offset {
    normal,  ///< along the surface normal
    view,    ///< along the view vector
};

/// ramp(c; lo, hi) rises from 0 at lo to 1 at hi; -1 <= lo < hi <= 1 (section 4).
struct Falloff {
    double lo = 0;
    double hi = 1;
};

struct Specular {
    double k = 0;  ///< k_s in [0, 1]
    Falloff falloff;
    bool occlude = false;  ///< highlights are shadowed by d
};

struct Scatter {
    double k = 0;  ///< k_f in [0, 1]
    Falloff falloff;
};

struct Material {
    Colour base_colour = hex_colour(0, 0, 0);            ///< c_B
    Colour diffuse_colour = hex_colour(255, 255, 255);   ///< c_D
    Colour specular_colour = hex_colour(255, 255, 255);  ///< c_S
    double depth = 0.008;                                ///< t, scene units, > 0
    Offset offset = Offset::normal;
    Illumination illumination = Illumination::length;
    double attenuation = 20;  ///< a, 1/scene unit, > 0
    int steps = 100;          ///< S of `count`, >= 1
    Specular specular;
    Scatter scatter;
};

}  // namespace relit
