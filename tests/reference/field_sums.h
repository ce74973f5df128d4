// Plain double sums over an analytic height field, the reference for every faster way to carry
// light or highlights over a surface. Specification "translucency", section 8.
#pragma once

#include <vector>

#include "core/base/vec.h"
#include "core/scatter/lobes.h"
#include "core/scatter/medium.h"

namespace relit::test::reference {

/// n x n points, x = (i - (n-1)/2) dx and y alike, h = amp sin(kx x) cos(ky y) + slope x.
struct AnalyticField {
    int n = 0;
    double dx = 1;
    double amp = 0;
    double kx = 0;
    double ky = 0;
    double slope = 0;
};

struct FieldPoint {
    Vec3 position;
    Vec3 normal;
    double area = 0;  ///< of the surface: dx^2/n_z
};

[[nodiscard]] FieldPoint point_of(const AnalyticField& field, int i, int j);

/// M_o at (i, j): sum of R_d(|x_o - P|) B A by the standard dipole, B = cos_i T(cos_i) of one light
/// of radiance 1, without shadows.
[[nodiscard]] double exitance(const AnalyticField& field, const scatter::Coefficients& coefficients,
                              Vec3 to_light, int i, int j);

/// H at (i, j): sum of f e^{-sigma r} A, f of `lobe` in the frame of each point.
[[nodiscard]] double carried_highlight(const AnalyticField& field, const scatter::Lobe& lobe,
                                       double sigma, Vec3 to_light, Vec3 to_viewer, int i, int j);

/// f in the frame of (i, j).
[[nodiscard]] double local_highlight(const AnalyticField& field, const scatter::Lobe& lobe,
                                     Vec3 to_light, Vec3 to_viewer, int i, int j);

}  // namespace relit::test::reference
