#include "core/scatter/backbone.h"

#include <gtest/gtest.h>

#include "tests/core/scatter/support.h"

namespace relit::test {
namespace {

using namespace scatter;

const std::vector<Vec3> control = {{0, 0, 0},     {0, 0, 1},     {0.3, 0.1, 2},
                                   {0.2, 0.5, 3}, {0, 0.6, 4.5}, {-0.3, 0.5, 5}};

void expect_near(Vec3 a, Vec3 b, double by) { EXPECT_NEAR(length(a - b), 0, by); }

void expect_orthonormal(const StalkFrame& f) {
    for (const Vec3 axis : {f.tangent, f.normal, f.binormal}) EXPECT_NEAR(length(axis), 1, 1e-12);
    EXPECT_NEAR(dot(f.tangent, f.normal), 0, 1e-12);
    EXPECT_NEAR(dot(f.tangent, f.binormal), 0, 1e-12);
    EXPECT_NEAR(dot(f.normal, f.binormal), 0, 1e-12);
}

TEST(Backbone, PassesItsInnerPointsWithoutABend) {
    const auto points = backbone(control, 8);
    ASSERT_EQ(points.size(), 3 * 8 + 1u);
    for (int k = 0; k < 4; ++k) expect_near(points[8 * k], control[k + 1], 1e-14);
    constexpr double h = 1e-6;
    for (int k = 1; k < 3; ++k) {  // slope at the end of a segment and at the beginning of the next
        const auto q = [&](int s, double t) {
            return catmull_rom(control[s], control[s + 1], control[s + 2], control[s + 3], t);
        };
        const Vec3 before = (1 / h) * (q(k - 1, 1) - q(k - 1, 1 - h));
        const Vec3 after = (1 / h) * (q(k, h) - q(k, 0));
        expect_near(before, after, 1e-4);
        expect_near(before, 0.5 * (control[k + 2] - control[k]), 1e-4);
    }
}

TEST(StalkFrames, AreOrthonormalAndFollowTheBackbone) {
    const auto points = backbone(control, 8);
    const auto frames = stalk_frames(points, {0, 1, 0});
    ASSERT_EQ(frames.size(), points.size() - 1);
    for (std::size_t k = 0; k < frames.size(); ++k) {
        expect_orthonormal(frames[k]);
        expect_near(frames[k].tangent, normalized(points[k + 1] - points[k]), 1e-14);
        if (k > 0) {
            EXPECT_GT(dot(frames[k].normal, frames[k - 1].normal), 0.9);
        }
    }
}

TEST(StalkFrames, OfAPlanarBackboneDoNotTwist) {
    std::vector<Vec3> points;
    for (int i = 0; i <= 64; ++i) points.push_back({std::cos(0.1 * i), 0, std::sin(0.1 * i)});
    for (const StalkFrame& frame : stalk_frames(points, {0, 1, 0}))
        expect_near(frame.binormal, {0, 1, 0}, 1e-12);
}

TEST(StalkFrames, AreFramesWhereNothingTellsThem) {
    const std::vector<Vec3> turns = {{0, 0, 0}, {0, 0, 1}, {0, 1, 1},
                                     {0, 1, 1}, {1, 1, 1}, {0, 1, 1}};
    for (const Vec3 first :
         {Vec3{0, 1, 0}, Vec3{0, 0, 1}, Vec3{0, 0, 0}, Vec3{1, 0, 0}, Vec3{0, 9, 0}})
        for (const StalkFrame& frame : stalk_frames(turns, first)) expect_orthonormal(frame);
    EXPECT_TRUE(stalk_frames(std::vector<Vec3>{{1, 2, 3}}, {0, 1, 0}).empty());
    for (const StalkFrame& frame : stalk_frames(std::vector<Vec3>(3, {1, 2, 3}), {0, 1, 0}))
        expect_orthonormal(frame);
}

TEST(StalkRing, IsACircleAcrossTheBackbone) {
    const auto frames = stalk_frames(backbone(control, 8), {0, 1, 0});
    for (const StalkFrame& frame : frames) {
        const Vec3 centre{0.1, 0.2, 0.3};
        const auto ring = stalk_ring(centre, frame, 0.25, 16);
        ASSERT_EQ(ring.size(), 16u);
        for (std::size_t i = 0; i < ring.size(); ++i) {
            EXPECT_NEAR(length(ring[i] - centre), 0.25, 1e-14);
            EXPECT_NEAR(dot(ring[i] - centre, frame.tangent), 0, 1e-14);
            EXPECT_NEAR(length(ring[i] - ring[(i + 1) % 16]), 0.5 * std::sin(pi / 16), 1e-14);
        }
    }
}

TEST(StalkRadius, TapersAndEndsInABulb) {
    EXPECT_EQ(stalk_radius(0), 0.5);
    for (double u = 0.01; u <= 0.625; u += 0.01)
        EXPECT_LT(stalk_radius(u), stalk_radius(u - 0.01)) << u;
    EXPECT_NEAR(stalk_radius(0.8125), 0.5 * (1 - 0.6 * 0.8125) + 0.25, 1e-14);
    EXPECT_NEAR(stalk_radius(0.625 + 1e-9), stalk_radius(0.625), 1e-8);
    EXPECT_NEAR(stalk_radius(1), 0.2, 1e-12);
}

}  // namespace
}  // namespace relit::test
