// Vectors of three for geometry, in double: positions in scene units, directions, normals.
#pragma once

#include <cmath>

namespace relit {

/// x to the right, y up, z towards the viewer (integrated model, section 1).
struct Vec3 {
    double x = 0;
    double y = 0;
    double z = 0;

    friend constexpr bool operator==(const Vec3&, const Vec3&) = default;
};

constexpr Vec3 operator+(Vec3 a, Vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
constexpr Vec3 operator-(Vec3 a, Vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
constexpr Vec3 operator-(Vec3 a) { return {-a.x, -a.y, -a.z}; }
constexpr Vec3 operator*(double s, Vec3 a) { return {s * a.x, s * a.y, s * a.z}; }
constexpr double dot(Vec3 a, Vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
constexpr Vec3 cross(Vec3 a, Vec3 b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double length(Vec3 a) { return std::sqrt(dot(a, a)); }

/// `a` at length 1; towards the viewer when `a` is too short to have a direction.
inline Vec3 normalized(Vec3 a) {
    const double len = length(a);
    return len > 0 ? (1 / len) * a : Vec3{0, 0, 1};
}

}  // namespace relit
