// Stalks: a smooth backbone through control points, frames along it that do not twist, rings of
// vertices around it. For meshes of anemones and plants.
//
// Source: Catmull and Rom 1974; specification "translucency", section 6 (stalks).
#pragma once

#include <span>
#include <vector>

#include "core/base/vec.h"

namespace relit::scatter {

/// q(t) between p1 (t = 0) and p2 (t = 1).
[[nodiscard]] Vec3 catmull_rom(Vec3 p0, Vec3 p1, Vec3 p2, Vec3 p3, double t);

/// The curve from the second control point to the last but one, C1; the ends only give direction.
/// @param steps  per segment, >= 1
/// @return       (control.size() - 3) steps + 1 points
/// @pre          at least 4 control points (asserted)
[[nodiscard]] std::vector<Vec3> backbone(std::span<const Vec3> control, int steps);

/// Orthonormal: T along the backbone, B and N across.
struct StalkFrame {
    Vec3 tangent;
    Vec3 normal;
    Vec3 binormal;
};

/// One frame per step between points: T_k = unit(Q_k - Q_{k-1}), N_k = unit(B_{k-1} x T_k),
/// B_k = unit(T_k x N_k). Where B_{k-1} and T_k are parallel within 1e-6, N_{k-1} stays; a step of
/// length 0 keeps the frame before it.
/// @param first  B_0; any vector across serves where it lies along the first step
[[nodiscard]] std::vector<StalkFrame> stalk_frames(std::span<const Vec3> points, Vec3 first);

/// Points at distance `radius` from `centre`, evenly from N towards B. @pre count >= 3 (asserted)
[[nodiscard]] std::vector<Vec3> stalk_ring(Vec3 centre, const StalkFrame& frame, double radius,
                                           int count);

/// Radius at the share u of a stalk's height, 0 <= u <= 1: tapered from 0.5, with a bulb at the top.
[[nodiscard]] double stalk_radius(double u);

}  // namespace relit::scatter
