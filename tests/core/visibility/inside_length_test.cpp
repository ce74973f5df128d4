#include "core/visibility/inside_length.h"

#include <gtest/gtest.h>

#include <limits>

#include "core/base/angle.h"
#include "core/field/normals.h"
#include "core/shade/factors.h"
#include "tests/support/maps.h"
#include "tests/support/tolerances.h"

namespace relit::test {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

double r_to_point(const Solid& solid, Vec3 from, Vec3 light) {
    return inside_length(solid, ray_to_point(from, light));
}

// Length by brute force: the share of many points of the segment that is_inside() calls solid.
double sampled_length(const Solid& solid, Vec3 from, Vec3 direction, double distance, int samples) {
    int inside = 0;
    for (int k = 0; k < samples; ++k)
        inside += is_inside(solid, from + ((k + 0.5) / samples * distance) * direction);
    return distance * inside / samples;
}

// A plane has a closed-form answer: d = cos(theta) for every depth and every tilt (integrated
// model, section 2).
TEST(InsideLength, OnAPlaneGivesTheCosineForEveryTiltDepthAndSize) {
    for (const double slope_x : {0.0, 0.2, -0.35})
        for (const double slope_y : {0.0, 0.3})
            for (const double depth : {0.002, 0.008, 0.02})
                for (const int width : {64, 97}) {
                    SCOPED_TRACE(testing::Message()
                                 << "slopes " << slope_x << " " << slope_y << " depth " << depth);
                    const HeightField field = tilted_plane(width, 48, 0.6, slope_x, slope_y);
                    const Solid plane = make_solid(field, 0.6, {}, depth);
                    const Vec3 n = normal_from(slopes_at(field, 0.6, width / 2, 24));
                    const Vec3 from = surface_point(plane, width / 2, 24) - depth * n;
                    for (const double azimuth : {0.0, 45.0, 133.0, 270.0}) {
                        const Vec3 l = direction_from(azimuth, 60);
                        const double r = inside_length(plane, ray_along(from, l));
                        EXPECT_NEAR(length_illumination(depth, r), dot(n, l), tolerance::plane_d);
                        // Offset along the view: min(1, cos(theta)/n_z).
                        const Vec3 below =
                            surface_point(plane, width / 2, 24) - depth * Vec3{0, 0, 1};
                        EXPECT_NEAR(
                            length_illumination(depth, inside_length(plane, ray_along(below, l))),
                            std::min(1.0, dot(n, l) / n.z), tolerance::plane_d);
                    }
                }
}

TEST(InsideLength, OnAPlaneGivesTheCosineTowardsAPointLight) {
    const HeightField field = tilted_plane(96, 96, 0.6, 0.2, -0.1);
    const double depth = 0.008;
    const Solid plane = make_solid(field, 0.6, {}, depth);
    const Vec3 light{0.9, 0.2, 1.1};
    for (int k = 10; k < 90; k += 7) {
        const Vec3 n = normal_from(slopes_at(field, 0.6, k, 95 - k));
        const Vec3 from = surface_point(plane, k, 95 - k) - depth * n;
        EXPECT_NEAR(length_illumination(depth, r_to_point(plane, from, light)),
                    dot(n, normalized(light - from)), tolerance::plane_d);
    }
}

// The way out over ground at z = 0 beyond the border counts as the ground does under the map.
TEST(InsideLength, LeavesTheMapOverEndlessGroundWithoutAChange) {
    const Solid ground = make_solid(field_of(32, 32, [](int, int) { return 0; }), 0.15, {}, 0.008);
    const Vec3 l = direction_from(90, 3);
    for (const int i : {0, 15, 31}) {
        const double r =
            inside_length(ground, ray_along(surface_point(ground, i, 31) - Vec3{0, 0, 0.008}, l));
        EXPECT_NEAR(r, 0.008 / l.z, 1e-12) << "column " << i;
    }
}

TEST(InsideLength, GrowsByAWallsThicknessAlongTheRayAndNoMore) {
    const auto map = [](double wall) {
        return field_of(128, 32, [&](int i, int) { return i >= 80 && i < 90 ? wall : 0.1; });
    };
    const double relief = 0.5;
    const Vec3 from{20.5 / 128, 0.12, 0.05 - 0.004};
    const Vec3 l = direction_from(90, 10);
    const double without =
        inside_length(make_solid(map(0.1), relief, {}, 0.004), ray_along(from, l));
    const double with = inside_length(make_solid(map(1.0), relief, {}, 0.004), ray_along(from, l));
    // The ray meets the wall's bilinear flanks half-way up, at 0.5 * (0.05 + 0.5) in the mean;
    // exact: where it crosses them.
    const auto flank =
        [&](double column,
            double direction) {  // where the ray meets the flank that starts at `column`
            const double slope = direction * (0.5 - 0.05) * 128;  // per scene unit
            const double x0 = (column + 0.5) / 128;
            const double z0 = direction > 0 ? 0.05 : 0.5;
            // from.z + (x - from.x) tan = z0 + slope (x - x0)
            const double tan = l.z / l.x;
            return (z0 - slope * x0 - from.z + tan * from.x) / (tan - slope);
        };
    const double thickness = (flank(89, -1) - flank(79, 1)) / l.x;
    EXPECT_NEAR(with - without, thickness, 1e-6);
}

TEST(InsideLength, NeverShrinksWhenAHeightBetweenIsRaised) {
    Random random(7);
    HeightField field = field_of(24, 24, [&](int, int) { return 0.6 * random(); });
    const Vec3 light{0.9, 0.8, 0.3};
    for (int trial = 0; trial < 300; ++trial) {
        const Solid before = make_solid(field, 0.3, {}, 0.02);
        const int i = int(random() * 24), j = int(random() * 24);
        const Vec3 from = surface_point(before, 4, 17) - Vec3{0, 0, 0.02};
        const double r = r_to_point(before, from, light);
        if (i == 4 && j == 17) continue;
        const float old = field.heights.at(i, j);
        field.heights.at(i, j) = std::min(1.0f, old + 0.3f);
        EXPECT_GE(r_to_point(make_solid(field, 0.3, {}, 0.02), from, light), r - 1e-12);
        field.heights.at(i, j) = old;
    }
}

// Any map, mask, floor and ray, against counting points of the segment.
TEST(InsideLength, EqualsBruteForceOnRandomRoughMasksAndRays) {
    Random random(11);
    for (int trial = 0; trial < 400; ++trial) {
        const Solid solid = rough_solid(trial, random);
        const double y_size = solid.y_size();
        const Vec3 from{random(), random() * y_size, random() * 0.8 - 0.05};
        Vec3 to{random() * 2 - 0.5, (random() * 2 - 0.5) * y_size, random()};
        if (trial % 5 == 0) to.x = from.x;  // straight along a column, up, or both
        if (trial % 7 == 0) to.y = from.y;
        const double distance = length(to - from);
        const double r = r_to_point(solid, from, to);
        EXPECT_NEAR(r, sampled_length(solid, from, normalized(to - from), distance, 20000),
                    0.002 * distance)
            << "trial " << trial << ", map " << solid.width << " x " << solid.height;
    }
}

TEST(InsideLength, AlongALineOfTexelCentresOrBordersIsAsBesideIt) {
    const HeightField field = hills(32, 32);
    const Solid solid = make_solid(field, 0.3, {}, 0.01);
    for (const double column : {8.0, 8.5})
        for (const Vec3 l :
             {direction_from(0, 12), direction_from(180, 12), direction_from(90, 12)}) {
            const Vec3 on{column / 32, column / 32, 0.1};
            const Vec3 beside = on + Vec3{1e-9, 1e-9, 0};
            EXPECT_NEAR(inside_length(solid, ray_along(on, l)),
                        inside_length(solid, ray_along(beside, l)), 1e-6);
        }
}

TEST(InsideLength, StraightUpIsTheDepthAndStraightDownIsEndless) {
    const Solid solid = make_solid(hills(16, 16), 0.3, {}, 0.01);
    const Vec3 from = surface_point(solid, 5, 6) - Vec3{0, 0, 0.01};
    EXPECT_NEAR(inside_length(solid, ray_along(from, Vec3{0, 0, 1})), 0.01, 1e-12);
    EXPECT_EQ(inside_length(solid, ray_along(from, Vec3{0, 0, -1})), infinity);
}

TEST(InsideLength, IsEndlessForEveryLightInOrBehindEndlessGround) {
    const Solid solid = make_solid(hills(16, 16), 0.3, {}, 0.01);
    const Vec3 from = surface_point(solid, 5, 6) - Vec3{0, 0, 0.01};
    EXPECT_EQ(r_to_point(solid, from, {0.5, 0.5, -0.35}), infinity);
    EXPECT_EQ(inside_length(solid, ray_along(from, direction_from(20, -0.01))), infinity);
    EXPECT_LT(r_to_point(solid, from, {0.5, 0.5, 0}), infinity);
}

TEST(InsideLength, ThroughAPanelWithABackIsItsThickness) {
    const Solid panel = make_solid(field_of(16, 16, [](int, int) { return 0.5; }), 0.2,
                                   {Base::Kind::level, -0.03}, 0.01);
    const Vec3 from = surface_point(panel, 8, 8) - Vec3{0, 0, 0.01};
    EXPECT_NEAR(inside_length(panel, ray_along(from, Vec3{0, 0, -1})), 0.1 - 0.01 + 0.03, 1e-7);
    EXPECT_NEAR(inside_length(panel, ray_along(from, direction_from(0, -60))),
                0.12 / std::sin(radians(60)), 1e-7);
}

TEST(InsideLength, CountsFromTheFloorOnWhereTheRayStartsBelowIt) {
    const Solid panel = make_solid(field_of(16, 16, [](int, int) { return 0.5; }), 0.2,
                                   {Base::Kind::level, 0.04}, 0.01);
    EXPECT_NEAR(inside_length(panel, ray_along(Vec3{0.5, 0.5, -0.02}, Vec3{0, 0, 1})), 0.1 - 0.04,
                1e-7);
}

TEST(InsideLength, OfASingleTexelMapIsThatOfABox) {
    const Solid box =
        make_solid(field_of(1, 1, [](int, int) { return 1; }), 0.5, {Base::Kind::level, 0}, 0.01);
    EXPECT_NEAR(inside_length(box, ray_along(Vec3{0.25, 0.5, 0.25}, Vec3{1, 0, 0})), 0.75, 1e-9);
    EXPECT_NEAR(inside_length(box, ray_along(Vec3{0.25, 0.5, 0.25}, Vec3{0, -1, 0})), 0.5, 1e-9);
}

TEST(InsideLength, TowardsALightOnTheGroundIsFinite) {
    const Solid flat = make_solid(field_of(24, 16, [](int, int) { return 0.2; }), 0.15, {}, 0.008);
    for (const Vec3 light : {Vec3{1.3, 0.7, 0}, Vec3{0.5, 0.5, 0}})
        for (int j = 0; j < 16; ++j)
            for (int i = 0; i < 24; ++i) {
                const Vec3 from = surface_point(flat, i, j) - Vec3{0, 0, 0.008};
                EXPECT_LE(r_to_point(flat, from, light), length(light - from) + 1e-12)
                    << i << ", " << j;
            }
}

// Sines and cosines leave traces of a right angle: they must not decide what is in the ground.
TEST(InsideLength, TakesDirectionsThatAreAllButLevelOrStraightAsThat) {
    const Solid solid = make_solid(hills(16, 16), 0.3, {}, 0.01);
    const Vec3 from = surface_point(solid, 5, 6) - Vec3{0, 0, 0.01};
    for (const double trace : {6e-17, -6e-17, 1e-310, -1e-320}) {
        EXPECT_EQ(inside_length(solid, ray_along(from, {1, 0, trace})),
                  inside_length(solid, ray_along(from, {1, 0, 0})));
        EXPECT_EQ(inside_length(solid, ray_along(from, {trace, 0, 1})),
                  inside_length(solid, ray_along(from, {0, 0, 1})));
    }
}

TEST(InsideLength, EndsAtTheLight) {
    const Solid box =
        make_solid(field_of(4, 4, [](int, int) { return 1; }), 0.5, {Base::Kind::level, 0}, 0.01);
    EXPECT_NEAR(r_to_point(box, {0.2, 0.5, 0.25}, {0.6, 0.5, 0.25}), 0.4, 1e-9);
    EXPECT_EQ(r_to_point(box, {0.2, 0.5, 0.25}, {0.2, 0.5, 0.25}), 0);
}

// t -> 0 on a smooth convex surface: d -> max(0, cos(theta)) away from the terminator.
TEST(InsideLength, TendsToTheCosineOnASphereAsTheDepthVanishes) {
    const int size = 512;
    const double radius = 0.4;
    const HeightField sphere = field_of(size, size, [&](int i, int j) {
        const double x = (i + 0.5) / size - 0.5, y = (size - 0.5 - j) / size - 0.5;
        return std::sqrt(std::max(0.0, radius * radius - x * x - y * y)) / radius;
    });
    const double depth = 1e-4;
    const Solid solid = make_solid(sphere, radius, {}, depth);
    const Vec3 l = direction_from(315, 35);
    for (int j = 130; j < 390; j += 26)
        for (int i = 130; i < 390; i += 26) {
            const Vec3 p = surface_point(solid, i, j);
            const Vec3 n = normal_from(slopes_at(sphere, radius, i, j));
            if (n.z < 0.5 || std::abs(dot(n, l)) < 0.15) continue;
            const double d =
                length_illumination(depth, inside_length(solid, ray_along(p - depth * n, l)));
            EXPECT_NEAR(d, std::max(0.0, dot(n, l)), 0.02) << i << ", " << j;
        }
}

}  // namespace
}  // namespace relit::test
