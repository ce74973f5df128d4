#include "core/light/environment.h"

#include <gtest/gtest.h>

#include <numbers>

#include "core/base/angle.h"
#include "tests/support/maps.h"

namespace relit::test {
namespace {

std::shared_ptr<const Image> uniform_map(int width, int height, float value) {
    return std::make_shared<const Image>(width, height, 3, value);
}

Image noisy_map(int width, int height) {
    Random random(9);
    Image map(width, height, 3);
    for (float& v : map.values) v = float(std::pow(random(), 8) * 100);
    return map;
}

// The image's centre lights from the viewer's side, its top is up, and it reads unmirrored to
// somebody who stands at the relief.
TEST(Environment, ImageLiesOnTheSphereAsSpecified) {
    const int w = 1024, h = 512;
    const auto near = [](Vec3 a, Vec3 b) { return length(a - b) < 0.01; };
    EXPECT_TRUE(near(environment_direction(w / 2, h / 2, w, h), {0, 0, 1}));
    EXPECT_TRUE(near(environment_direction(w / 4, 0, w, h), {0, 1, 0}));
    EXPECT_TRUE(near(environment_direction(3 * w / 4, h / 2, w, h), {-1, 0, 0}));
    EXPECT_TRUE(near(environment_direction(0, h / 2, w, h), {0, 0, -1}));
}

TEST(Environment, YawMovesTheCentreRightAndPitchThenMovesItDown) {
    const Vec3 right = rotated({0, 0, 1}, {90, 0});
    EXPECT_NEAR(right.x, 1, 1e-12);
    const Vec3 down = rotated({0, 0, 1}, {0, 90});
    EXPECT_NEAR(down.y, -1, 1e-12);
    // Pitch leaves what yaw has put on its axis.
    EXPECT_NEAR(rotated({0, 0, 1}, {90, 45}).x, 1, 1e-12);
}

TEST(Environment, WeightsSumToOne) {
    for (const Weighting weighting : {Weighting::solid_angle, Weighting::uniform})
        for (const int limit : {100000, 64, 1}) {
            double sum = 0;
            for (const EnvironmentRegion& region :
                 environment_regions(noisy_map(32, 16), weighting, {limit, limit}))
                sum += region.weight;
            EXPECT_NEAR(sum, 1, 1e-9);
        }
}

TEST(Environment, GatheringKeepsTheLightAndTheSize) {
    const Image map = noisy_map(64, 32);
    const auto total = [](const std::vector<EnvironmentRegion>& regions) {
        Rgb sum;
        for (const auto& region : regions) sum = sum + region.radiance;
        return sum;
    };
    const auto all = environment_regions(map, Weighting::solid_angle, {.max_texels = 1 << 20});
    const auto few = environment_regions(map, Weighting::solid_angle, {.regions = 100});
    EXPECT_EQ(all.size(), 64u * 32);
    EXPECT_EQ(few.size(), 100u);
    EXPECT_NEAR(total(few).r, total(all).r, 1e-4 * total(all).r);
    EXPECT_NEAR(total(few).b, total(all).b, 1e-4 * total(all).b);
    double largest = 0;
    for (const auto& region : few) largest = std::max(largest, region.weight);
    EXPECT_LT(largest, 0.05);  // no region covers much of the sphere, however dark it is
}

TEST(Environment, GatheringKeepsASunWhereItIs) {
    Image map(128, 64, 3, 0.1f);
    for (int c = 0; c < 3; ++c) map.at(100, 20, c) = 5000;
    const Vec3 sun = environment_direction(100, 20, 128, 64);
    double best = -1;
    Rgb brightest;
    for (const auto& region : environment_regions(map, Weighting::solid_angle, {.regions = 50}))
        if (region.radiance.r > brightest.r) {
            brightest = region.radiance;
            best = dot(region.direction, sun);
        }
    EXPECT_GT(best, std::cos(radians(0.5)));
}

// Weights sum to 1 over the whole sphere, so a uniform white environment lights an open plane with
// 1/4, and `auto` with 0.4.
TEST(Environment, UniformWhiteLightsAnOpenPlaneWithAQuarter) {
    Scene scene;
    scene.field = shared(field_of(9, 9, [](int, int) { return 0; }));
    EnvironmentLight sky;
    sky.map = uniform_map(32, 16, 1);
    sky.intensity = 1;
    scene.lights = {sky};
    const Output centre{.region = Rect{4, 4, 1, 1}, .transfer = Transfer::none};
    EXPECT_NEAR(rendered(scene, centre).at(0, 0), 0.25, 0.002);
    sky.intensity.reset();
    for (const float brightness : {0.01f, 1.0f, 300.0f}) {
        sky.map = uniform_map(32, 16, brightness);
        scene.lights = {sky};
        EXPECT_NEAR(rendered(scene, centre).at(0, 0), 0.4, 0.003) << brightness;
    }
    sky.map = uniform_map(8, 4, 0);  // black: auto has nothing to go by
    scene.lights = {sky};
    EXPECT_EQ(rendered(scene, centre).at(0, 0), 0);
}

TEST(Environment, ColoursFromTheRightLightTheRightFlank) {
    Image map(32, 16, 3, 0);
    for (int j = 0; j < 16; ++j)
        for (int i = 4; i < 12; ++i)
            map.at(i, j, 0) = 1;  // left of the image's centre: on the right, +x
    EnvironmentLight sky;
    sky.map = std::make_shared<const Image>(map);
    sky.intensity = 1;
    Scene scene;
    scene.lights = {sky};
    const auto lit = [&](double slope) {
        scene.field = shared(tilted_plane(9, 9, 1, slope, 0));
        return rendered(scene, {.region = Rect{4, 4, 1, 1}, .transfer = Transfer::none}).at(0, 0);
    };
    EXPECT_GT(lit(-0.4), 1.2 * lit(0.4));  // falls towards +x: faces the right
}

}  // namespace
}  // namespace relit::test
