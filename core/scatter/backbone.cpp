#include "core/scatter/backbone.h"

#include <cassert>
#include <cmath>
#include <numbers>

namespace relit::scatter {
namespace {

constexpr double pi = std::numbers::pi;

constexpr double parallel = 1e-6;

// With B as near to `across` as it can be; with any where that is none.
StalkFrame frame_about(Vec3 along, Vec3 across) {
    Vec3 side = cross(across, along);
    if (length(side) <= parallel * length(across))
        side = cross(std::abs(along.x) < 0.9 ? Vec3{1, 0, 0} : Vec3{0, 1, 0}, along);
    const Vec3 normal = normalized(side);
    return {along, normal, cross(along, normal)};
}

StalkFrame next_frame(const StalkFrame& before, Vec3 step) {
    if (length(step) == 0) return before;
    StalkFrame frame;
    frame.tangent = normalized(step);
    const Vec3 side = cross(before.binormal, frame.tangent);
    frame.normal = length(side) < parallel ? before.normal : normalized(side);
    frame.binormal = normalized(cross(frame.tangent, frame.normal));
    return frame;
}

}  // namespace

Vec3 catmull_rom(Vec3 p0, Vec3 p1, Vec3 p2, Vec3 p3, double t) {
    const Vec3 linear = p2 - p0;
    const Vec3 square = 2 * p0 - 5 * p1 + 4 * p2 - p3;
    const Vec3 cube = 3 * p1 - p0 - 3 * p2 + p3;
    return 0.5 * (2 * p1 + t * (linear + t * (square + t * cube)));
}

std::vector<Vec3> backbone(std::span<const Vec3> control, int steps) {
    assert(control.size() >= 4 && steps >= 1);
    std::vector<Vec3> points;
    for (std::size_t s = 0; s + 3 < control.size(); ++s)
        for (int i = 0; i < steps; ++i)
            points.push_back(catmull_rom(control[s], control[s + 1], control[s + 2], control[s + 3],
                                         double(i) / steps));
    points.push_back(control[control.size() - 2]);
    return points;
}

std::vector<StalkFrame> stalk_frames(std::span<const Vec3> points, Vec3 first) {
    if (points.size() < 2) return {};
    StalkFrame frame = frame_about(normalized(points[1] - points[0]), first);
    std::vector<StalkFrame> frames;
    for (std::size_t k = 1; k < points.size(); ++k) {
        frame = next_frame(frame, points[k] - points[k - 1]);
        frames.push_back(frame);
    }
    return frames;
}

std::vector<Vec3> stalk_ring(Vec3 centre, const StalkFrame& frame, double radius, int count) {
    assert(count >= 3);
    std::vector<Vec3> ring;
    for (int i = 0; i < count; ++i) {
        const double angle = 2 * pi * i / count;
        ring.push_back(
            centre + radius * (std::cos(angle) * frame.normal + std::sin(angle) * frame.binormal));
    }
    return ring;
}

double stalk_radius(double u) {
    constexpr double bulb = 5.0 / 8;
    const double tapered = 0.5 * (1 - 0.6 * u);
    return u > bulb ? tapered + 0.25 * std::sin(pi * (u - bulb) / (1 - bulb)) : tapered;
}

}  // namespace relit::scatter
