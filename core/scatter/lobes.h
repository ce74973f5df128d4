// Shapes of highlights: Ward, Ashikhmin and Shirley, Lafortune and the cosine, each a function of
// two directions in the frame of a surface. For highlights at a point and, carried below the
// surface (highlight.h), from others.
//
// Source: Yu, Liu, Hu 2019, section 3, with what is damaged there read as specification
// "translucency", section 5.1, has it; each lobe's own paper below.
#pragma once

#include "core/base/vec.h"

namespace relit::scatter {

/// Right-handed, orthonormal.
struct Frame {
    Vec3 t;
    Vec3 b;
    Vec3 n;
};

/// t = n x X, where that has a direction (n x Y else), b = n x t. On a plane that faces the viewer
/// t is +y and b is -x. @param normal  unit vector
[[nodiscard]] Frame highlight_frame(Vec3 normal);

enum class LobeKind { cosine, ward, ward_duer, ashikhmin, lafortune };

struct Lobe {
    LobeKind kind = LobeKind::cosine;
    /// Exponents along t and b (Ward, Ashikhmin; > 0) or weights of them (Lafortune; any).
    double n_t = 10;
    double n_b = 10;
    double n_n = 1;        ///< Lafortune: weight of n
    double exponent = 10;  ///< cosine, Lafortune: k > 0
    double eta = 1.5;      ///< Ashikhmin: index for Schlick's reflectance
    /// Least value of the cosines that Ward and Ashikhmin divide by: 1e-3 in pictures, where
    /// grazing light would make spikes; 0 as published.
    double least_cosine = 0;
};

/// Value of the lobe, >= 0; 0 when a direction is below the surface. Symmetric in w_i and w_o.
/// @param w_i, w_o  unit vectors to the light and to the viewer
[[nodiscard]] double value(const Lobe& lobe, const Frame& frame, Vec3 w_i, Vec3 w_o);

}  // namespace relit::scatter
