#include "core/render/render.h"

#include <gtest/gtest.h>

#include <atomic>
#include <limits>
#include <thread>

#include "core/base/error.h"
#include "core/render/finish.h"
#include "tests/support/maps.h"

namespace relit::test {
namespace {

constexpr float inf = std::numeric_limits<float>::infinity();

Scene hilly_scene(int width = 48, int height = 36) {
    Scene scene;
    scene.field = shared(hills(width, height));
    scene.material.specular = {0.2, {0.6, 1}, true};
    return scene;
}

// A disc of material with a soft edge.
void mask_disc(HeightField& field) {
    field.alpha = Image(field.width(), field.height(), 1);
    for (int j = 0; j < field.height(); ++j)
        for (int i = 0; i < field.width(); ++i) {
            const double distance = std::hypot(i - 0.5 * field.width(), j - 0.5 * field.height());
            field.alpha.at(i, j) =
                float(std::clamp(0.5 + (0.4 * field.height() - distance) / 4, 0.0, 1.0));
        }
}

Image cropped(const Image& image, Rect r) {
    Image part(r.width, r.height, image.channels);
    for (int y = 0; y < r.height; ++y)
        for (int x = 0; x < r.width; ++x)
            for (int c = 0; c < image.channels; ++c)
                part.at(x, y, c) = image.at(r.x + x, r.y + y, c);
    return part;
}

double largest_difference(const Image& a, const Image& b) {
    EXPECT_EQ(a.values.size(), b.values.size());
    double largest = 0;
    for (std::size_t k = 0; k < std::min(a.values.size(), b.values.size()); ++k)
        largest = std::max<double>(largest, std::abs(a.values[k] - b.values[k]));
    return largest;
}

TEST(Render, GivesTheSameNumbersForAnyNumberOfThreads) {
    const Scene scene = hilly_scene();
    const Image expected = render(scene, {}, {Executor(1)}).pixels;
    for (const int threads : {2, 3, 8})
        EXPECT_EQ(render(scene, {}, {Executor(threads)}).pixels.values, expected.values);
}

TEST(Render, GivesTheSameNumbersOnEveryInstructionSet) {
    Scene scene = hilly_scene(75, 52);
    mask_disc(own_field(scene));
    const Image expected = rendered(scene);
    for (const Simd simd : available_simd())
        EXPECT_EQ(render(scene, {}, {.executor = executor(), .simd = simd}).pixels.values,
                  expected.values)
            << name_of(simd);
}

TEST(Render, OfARegionIsThatPartOfTheWholePicture) {
    const Scene scene = hilly_scene();
    const Rect region{5, 7, 20, 11};
    EXPECT_EQ(rendered(scene, {.region = region}).values, cropped(rendered(scene), region).values);
}

TEST(Render, OfRegionsAtAnotherSizeJoinsWithoutASeam) {
    const Scene scene = hilly_scene();
    const Image whole = rendered(scene, {.width = 96, .height = 72});
    const Image tile = rendered(scene, {.width = 48, .height = 36, .region = Rect{12, 9, 24, 18}});
    EXPECT_LT(largest_difference(tile, cropped(whole, {24, 18, 48, 36})), 1e-5);
}

TEST(Render, SizesKeepTheAspectWhereOnlyOneIsGiven) {
    const auto size = [](const Output& output) {
        const PictureSize s = picture_size(output, 400, 300);
        return std::pair{s.width, s.height};
    };
    EXPECT_EQ(size({}), (std::pair{400, 300}));
    EXPECT_EQ(size({.width = 200}), (std::pair{200, 150}));
    EXPECT_EQ(size({.height = 30}), (std::pair{40, 30}));
    EXPECT_EQ(size({.width = 7, .height = 9}), (std::pair{7, 9}));
    EXPECT_EQ(size({.width = 1, .region = Rect{0, 0, 300, 20}}), (std::pair{1, 1}));
}

// Mirror the map, the light and the result together: the same picture.
TEST(Render, IsTheSameWhenMapAndLightAreMirrored) {
    Scene scene = hilly_scene();
    const Image picture = rendered(scene);
    Scene mirrored = scene;
    HeightField& field = own_field(mirrored);
    for (int j = 0; j < 36; ++j)
        for (int i = 0; i < 48; ++i) field.heights.at(i, j) = scene.field->heights.at(47 - i, j);
    std::get<PointLight>(mirrored.lights[0]).position.x =
        1 - std::get<PointLight>(scene.lights[0]).position.x;
    const Image other = rendered(mirrored);
    for (int j = 0; j < 36; ++j)
        for (int i = 0; i < 48; ++i) ASSERT_NEAR(other.at(47 - i, j, 0), picture.at(i, j, 0), 1e-5);
}

TEST(Render, IsTheSameWhenASquareMapAndTheLightAreTurnedByAQuarter) {
    Scene scene = hilly_scene(40, 40);
    mask_disc(own_field(scene));
    DirectionalLight sun;
    sun.elevation_deg = 15;
    sun.azimuth_deg = 300;
    scene.lights = {sun};
    Scene turned = scene;  // clockwise: (i, j) goes to (39 - j, i)
    HeightField& field = own_field(turned);
    for (int j = 0; j < 40; ++j)
        for (int i = 0; i < 40; ++i) {
            field.heights.at(39 - j, i) = scene.field->heights.at(i, j);
            field.alpha.at(39 - j, i) = scene.field->alpha.at(i, j);
        }
    sun.azimuth_deg += 90;
    turned.lights = {sun};
    // The fringe's nearest texel is a matter of sides where two are equally near: compare what is
    // material.
    const Image picture = rendered(scene);
    const Image other = rendered(turned);
    for (int j = 0; j < 40; ++j)
        for (int i = 0; i < 40; ++i)
            if (scene.field->is_solid(i, j)) {
                ASSERT_NEAR(other.at(39 - j, i, 1), picture.at(i, j, 1), 1e-5) << i << ", " << j;
            }
}

TEST(Render, GivesAPlaneTheCosineAsItsIlluminationLayer) {
    Scene scene;
    scene.field = shared(tilted_plane(32, 32, 0.5, 0.2, 0));
    scene.relief = 0.5;
    DirectionalLight sun;
    sun.direction = Vec3{0, 0, 3};
    scene.lights = {sun};
    const Image d = rendered(scene, {.layer = Layer::illumination});
    EXPECT_EQ(d.channels, 1);
    EXPECT_NEAR(d.at(16, 16), 1 / std::sqrt(1.04), 1e-5);
}

TEST(Render, SumsItsLights) {
    Scene scene = hilly_scene();
    DirectionalLight sun;
    PointLight lamp;
    lamp.colour = {{0.2, 0.5, 1}, false};
    const Output linear{.transfer = Transfer::none};
    scene.lights = {sun};
    const Image a = rendered(scene, linear);
    scene.lights = {lamp};
    const Image b = rendered(scene, linear);
    scene.lights = {sun, lamp};
    const Image both = rendered(scene, linear);
    for (std::size_t k = 0; k < both.values.size(); ++k)
        ASSERT_NEAR(both.values[k], a.values[k] + b.values[k], 1e-5);  // the base colour is black
}

TEST(Render, TakesFringeColourFromTheNearestMaterialAndNoneWithoutAlpha) {
    Scene scene;
    scene.field = shared(hills(16, 16));
    own_field(scene).alpha = Image(16, 16, 1, 0);
    for (int j = 0; j < 16; ++j) {
        for (int i = 0; i < 8; ++i) own_field(scene).alpha.at(i, j) = 1;
        own_field(scene).alpha.at(8, j) = 0.3f;
        own_field(scene).alpha.at(9, j) = 0.1f;
    }
    const Image picture = rendered(scene);
    ASSERT_EQ(picture.channels, 4);
    for (int c = 0; c < 3; ++c) {
        EXPECT_EQ(picture.at(8, 5, c), picture.at(7, 5, c));
        EXPECT_EQ(picture.at(9, 5, c), picture.at(7, 5, c));
        EXPECT_EQ(picture.at(10, 5, c), 0);
    }
    EXPECT_EQ(picture.at(8, 5, 3), 0.3f);
    EXPECT_EQ(picture.at(10, 5, 3), 0);
}

TEST(Render, OfAWhollyMaskedMapIsEmptyNotAnError) {
    Scene scene;
    scene.field = shared(hills(8, 8));
    own_field(scene).alpha = Image(8, 8, 1, 0.2f);
    const Image picture = rendered(scene);
    EXPECT_EQ(picture.at(3, 3, 0), 0);
    EXPECT_EQ(picture.at(3, 3, 3), 0.2f);
}

TEST(Render, LaysABackgroundUnderThePictureInLinearLight) {
    Scene scene;
    scene.field = shared(hills(16, 16));
    own_field(scene).alpha = Image(16, 16, 1, 0.5f);
    for (int j = 0; j < 16; ++j) own_field(scene).alpha.at(0, j) = 0;
    const Image picture = rendered(scene, {.background = hex_colour(255, 0, 128)});
    ASSERT_EQ(picture.channels, 3);
    EXPECT_NEAR(picture.at(0, 3, 2), 128 / 255.0,
                1e-6);  // exactly the colour where nothing covers it
    const Image alone = rendered(scene, {});
    const double mixed = 0.5 * srgb_to_linear(alone.at(9, 9, 0)) + 0.5;
    EXPECT_NEAR(picture.at(9, 9, 0), linear_to_srgb(float(mixed)), 1e-4);
}

TEST(Render, BackgroundColourStaysWhatItIsUnderAnyExposure) {
    Scene scene;
    scene.field = shared(hills(8, 8));
    own_field(scene).alpha = Image(8, 8, 1, 0);
    const Image picture = rendered(
        scene, {.exposure = 3, .tone = Tone::filmic, .background = hex_colour(10, 200, 30)});
    EXPECT_NEAR(picture.at(4, 4, 1), 200 / 255.0, 1e-6);
}

TEST(Render, ForAFloatFileIsLinearUncutAndAssociated) {
    Scene scene;
    scene.field = shared(field_of(8, 8, [](int, int) { return 0; }));
    own_field(scene).alpha = Image(8, 8, 1, 0.75f);
    DirectionalLight zenith;
    zenith.direction = Vec3{0, 0, 1};
    zenith.intensity = 6;
    scene.lights = {zenith};
    const Image picture = rendered(scene, {.exposure = 1, .linear = true});
    EXPECT_NEAR(picture.at(4, 4, 0), 6 * 2 * 0.75, 1e-4);
    EXPECT_EQ(picture.at(4, 4, 3), 0.75f);
}

TEST(Render, DataLayersAreNeverExposedTonedOrEncoded) {
    const Scene scene = hilly_scene();
    for (const Layer layer : {Layer::illumination, Layer::thickness, Layer::normal, Layer::specular,
                              Layer::scatter, Layer::height, Layer::alpha})
        EXPECT_EQ(rendered(scene, {.layer = layer, .exposure = 4, .tone = Tone::filmic}).values,
                  rendered(scene, {.layer = layer}).values);
}

TEST(Render, ThicknessIsCutAtOneExceptInFloatFiles) {
    Scene scene = hilly_scene();
    DirectionalLight behind;
    behind.elevation_deg = -30;
    scene.lights = {behind};
    EXPECT_EQ(rendered(scene, {.layer = Layer::thickness}).at(3, 3), 1);
    EXPECT_EQ(rendered(scene, {.layer = Layer::thickness, .linear = true}).at(3, 3), inf);
    const Image resized = rendered(scene, {.layer = Layer::thickness, .width = 90, .linear = true});
    for (const float r : resized.values) EXPECT_FALSE(std::isnan(r));
}

TEST(Render, NormalLayerHoldsTheScaledNormal) {
    Scene scene;
    scene.field = shared(tilted_plane(16, 16, 0.5, 0.2, 0));
    scene.relief = 0.5;
    scene.normal_scale = 3;
    const Image normal = rendered(scene, {.layer = Layer::normal});
    const double length = std::sqrt(0.36 + 1);
    EXPECT_NEAR(normal.at(8, 8, 0), 0.5 - 0.5 * 0.6 / length, 1e-5);
    EXPECT_NEAR(normal.at(8, 8, 2), 0.5 + 0.5 / length, 1e-5);
}

TEST(Render, PreviewMayUseASmallerMapFinalNever) {
    const Scene scene = hilly_scene();
    const Output small{.accuracy = Accuracy::preview, .width = 24};
    const Picture preview = render(scene, small, {executor()});
    EXPECT_TRUE(preview.coarse_map);
    EXPECT_EQ(preview.pixels.width, 24);
    EXPECT_EQ(preview.pixels.height, 18);
    EXPECT_FALSE(render(scene, {.width = 24}, {executor()}).coarse_map);
    EXPECT_FALSE(render(scene, {.accuracy = Accuracy::preview}, {executor()}).coarse_map);
    EXPECT_LT(largest_difference(preview.pixels, rendered(scene, {.width = 24})), 0.25);
}

TEST(Render, StopsWhenItIsToldTo) {
    const Scene scene = hilly_scene(512, 512);
    std::stop_source stop;
    std::atomic<int> rows = 0;
    try {
        (void)render(scene, {}, {executor(), stop.get_token(), [&](double) {
                                     if (++rows == 5) stop.request_stop();
                                 }});
        FAIL() << "went on";
    } catch (const Error& e) {
        EXPECT_EQ(e.code, error_code::cancelled);
    }
    EXPECT_LT(rows, 20);
}

TEST(Render, ReportsProgressThatRisesToOne) {
    std::vector<double> told;
    (void)render(hilly_scene(), {}, {executor(), {}, [&](double share) { told.push_back(share); }});
    EXPECT_GT(told.size(), 3u);
    EXPECT_TRUE(std::is_sorted(told.begin(), told.end()));
    EXPECT_EQ(told.back(), 1);
}

TEST(Render, FilmicCurveRollsOffAndKeepsBlack) {
    EXPECT_EQ(filmic(0), 0);
    float last = -1;
    for (float x = 0; x < 100; x += 0.5f) {
        EXPECT_GT(filmic(x), last);
        last = filmic(x);
    }
    EXPECT_NEAR(filmic(1e6f), 2.51 / 2.43, 1e-3);
}

TEST(Render, OfTheBrightestSceneThereMayBeHasNoNan) {
    Scene scene = hilly_scene(12, 9);
    own_field(scene).albedo = Image(12, 9, 3, 3e38f);
    scene.material.diffuse_colour = {{1e4, 1e4, 1e4}, false};
    EnvironmentLight sky;
    sky.map = std::make_shared<const Image>(8, 4, 3, 3e38f);
    sky.intensity = 1e4;
    PointLight lamp;
    lamp.colour = {{1e4, 1e4, 1e4}, false};
    lamp.intensity = 1e4;
    scene.lights = {lamp, lamp, sky};
    for (const Tone tone : {Tone::clip, Tone::filmic})
        for (const bool linear : {false, true}) {
            const Image picture =
                rendered(scene, {.width = 20, .exposure = 20, .tone = tone, .linear = linear});
            for (const float v : picture.values) ASSERT_FALSE(std::isnan(v));
            EXPECT_GE(*std::max_element(picture.values.begin(), picture.values.end()), 1);
        }
}

TEST(Render, ThicknessStaysEndlessBesideEndlessWhenScaled) {
    Scene scene;
    scene.field = shared(field_of(6, 6, [](int i, int) { return i < 3 ? 0 : 1; }));
    DirectionalLight level;
    level.azimuth_deg = 90;
    level.elevation_deg = 0;
    scene.lights = {level};
    const Image r =
        rendered(scene, {.layer = Layer::thickness, .width = 24, .height = 6, .linear = true});
    for (int i = 0; i + 1 < 24; ++i)
        EXPECT_FALSE(std::isinf(r.at(i, 3)) && r.at(i + 1, 3) == 0) << i;
}

TEST(Render, UnderAnEnvironmentTurnedByWholeTurnsIsTheSame) {
    Scene scene;
    scene.field = shared(field_of(4, 4, [](int, int) { return 0.5; }));
    scene.material.offset = Offset::view;
    EnvironmentLight sky;
    sky.map = std::make_shared<const Image>(2, 1, 3, 1.0f);
    scene.lights = {sky};
    const Image expected = rendered(scene, {.layer = Layer::illumination});
    for (const double yaw : {180.0, 360.0, -360.0, 720.0}) {
        sky.rotation = {yaw, 0};
        scene.lights = {sky};
        EXPECT_LT(largest_difference(rendered(scene, {.layer = Layer::illumination}), expected),
                  1e-6)
            << yaw;
    }
}

TEST(Render, OfAMapOfOneTexelWorks) {
    Scene scene;
    scene.field = shared(field_of(1, 1, [](int, int) { return 0.5; }));
    const Image picture = rendered(scene, {.width = 5, .height = 3});
    EXPECT_EQ(picture.width, 5);
    EXPECT_GT(picture.at(2, 1, 0), 0.1f);
}

TEST(Render, WithALightAtTheStartOfItsRayHasNoNan) {
    Scene scene;
    scene.field = shared(field_of(4, 4, [](int, int) { return 0.5; }));
    PointLight inside;
    inside.position = {1.5 / 4, 2.5 / 4, 0.075 - 0.008};
    scene.lights = {inside};
    scene.material.specular.k = 0.5;
    for (const float v : rendered(scene).values) EXPECT_TRUE(std::isfinite(v));
}

// Whatever was rendered before, a picture is its own scene's.
TEST(Render, WithACacheGivesTheSamePictures) {
    SharedCache cache(1 << 20);
    HeightField field = hills(40, 30);
    mask_disc(field);
    field.key = field.shape_key = "hills";
    Scene scene;
    scene.field = shared(std::move(field));
    std::vector<Scene> scenes;
    for (const double relief : {0.15, 0.3})
        for (const double depth : {0.008, 0.03})
            for (const Base base :
                 {Base{}, Base{Base::Kind::automatic, 0}, Base{Base::Kind::level, 0.05},
                  Base{Base::Kind::level, -0.05}}) {
                scene.relief = relief;
                scene.material.depth = depth;
                scene.base = base;
                scenes.push_back(scene);
            }
    for (const Scene& one : scenes)
        for (const Output& output : {Output{}, Output{.accuracy = Accuracy::preview, .width = 20}})
            EXPECT_EQ(render(one, output, {.executor = executor(), .cache = &cache}).pixels.values,
                      rendered(one, output).values);
    // Two maps; a solid for each relief and floor, a floor at -depth for each depth; nearest texels.
    EXPECT_EQ(cache.misses(), 1 + 2 * (2 * (3 + 2) + 1));
}

}  // namespace
}  // namespace relit::test
