// Smooth functions on half of the sphere, orthonormal over solid angle: Zernike's polynomials on the
// disc that the hemisphere is mapped to with equal areas. Light through visibility becomes a sum of
// a few products with them. For visibility/ and render/.
//
// Spherical harmonics would spend half of their terms on the side that no light comes from, and more
// on the horizon, where that ends.
//
// Sources: Zernike 1934; Gautron and others 2004, "A novel hemispherical basis for accurate and
// efficient rendering".
#pragma once

#include <array>
#include <span>
#include <vector>

#include "core/base/vec.h"

namespace relit::hemisphere {

inline constexpr int degree = 9;
inline constexpr int functions = (degree + 1) * (degree + 2) / 2;

/// One function, or a pair of them: radial(z) times cos(order phi) and, for order > 0, radial(z)
/// times sin(order phi), phi the angle from +x towards +y.
struct Radial {
    int degree = 0;
    int order = 0;  ///< 0 <= order <= degree, of the same parity
};

/// Those up to `degree`. Functions are counted in their order, cosine before sine.
[[nodiscard]] std::span<const Radial> radials();

/// Value of the radial part at height z of the unit sphere, normalised. @pre 0 <= z <= 1
[[nodiscard]] double radial_value(Radial radial, double z);

/// Values of all functions at a unit direction. @pre direction.z >= 0
[[nodiscard]] std::array<double, functions> values(Vec3 direction);

struct Node {
    double z = 0;
    double weight = 0;
};

/// Heights and weights with which a sum over them integrates polynomials of z over [0, 1], up to
/// degree 2 n - 1 (Gauss and Legendre); lowest first.
[[nodiscard]] std::vector<Node> nodes(int n);

}  // namespace relit::hemisphere
