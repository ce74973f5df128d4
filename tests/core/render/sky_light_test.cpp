// Environments at infinity by way of SkyTransfer: against the full sum over their texels, for every
// option that d depends on; and the same bytes however they were made.
#include "core/render/sky_light.h"

#include <gtest/gtest.h>

#include "core/render/shader.h"
#include "tests/support/maps.h"
#include "tests/support/skies.h"
#include "tests/support/tolerances.h"

namespace relit::test {
namespace {

constexpr int sky_size = 48;  // rows of an environment whose full sum is affordable

Scene scene_of(HeightField field, std::shared_ptr<const Image> sky) {
    Scene scene;
    scene.field = shared(std::move(field));
    scene.relief = 0.12;
    EnvironmentLight light;
    light.map = std::move(sky);
    light.rotation = {40, 15};
    scene.lights = {light};
    return scene;
}

// The full sum at a lattice of 4 x 4 squares of texels, and the picture there.
double rms_error(const Scene& scene) {
    const Output output{.transfer = Transfer::none};
    const Image picture = rendered(scene, output);
    const Shader full(scene, output.transfer, {.max_texels = 1 << 20}, {executor()});
    const int width = scene.field->width(), height = scene.field->height();
    constexpr int squares = 5;
    std::vector<double> sums(squares * squares);
    std::vector<int> counts(sums.size());
    parallel_rows(executor(), int(sums.size()), {}, [&](RowRange rows) {
        for (int n = rows.begin; n < rows.end; ++n) {
            std::vector<TexelIndex> texels;
            for (int k = 0; k < 16; ++k) {
                // Within one of the shader's squares.
                const TexelIndex at{(width - 4) * (n % squares) / (squares - 1) / 4 * 4 + k % 4,
                                    (height - 4) * (n / squares) / (squares - 1) / 4 * 4 + k / 4};
                if (scene.field->is_solid(at.i, at.j)) texels.push_back(at);
            }
            if (texels.empty()) continue;
            std::vector<float> expected(3 * texels.size());  // all reds, greens, blues
            full.beauty(texels, {}, expected);
            for (std::size_t k = 0; k < texels.size(); ++k) {
                const float* found =
                    &picture.values[(std::size_t(texels[k].j) * width + texels[k].i) *
                                    picture.channels];
                for (std::size_t c = 0; c < 3; ++c) {
                    const double e = found[c] - expected[c * texels.size() + k];
                    sums[n] += e * e / 3;
                }
                ++counts[n];
            }
        }
    });
    double sum = 0;
    int count = 0;
    for (std::size_t n = 0; n < sums.size(); ++n) sum += sums[n], count += counts[n];
    return std::sqrt(sum / count);
}

HeightField masked_hills(int width, int height) {
    HeightField field = hills(width, height, 3);
    field.alpha = Image(width, height, 1);
    for (int j = 0; j < height; ++j)
        for (int i = 0; i < width; ++i)
            field.alpha.at(i, j) = std::hypot(i - 0.5 * width, j - 0.5 * height) < 0.55 * height;
    return field;
}

struct SkyCase {
    const char* name;
    void (*change)(Scene&);
    bool sharp_sun = false, sharp_boxes = false;  // see tolerance::sharp_sky_rms
};

const SkyCase sky_cases[] = {
    {"as_it_is", [](Scene&) {}},
    {"offset_along_the_view", [](Scene& s) { s.material.offset = Offset::view; }},
    {"exponential", [](Scene& s) { s.material.illumination = Illumination::exponential; }, true,
     false},
    {"panel_with_a_back", [](Scene& s) { s.base.kind = Base::Kind::automatic; }},
    {"panel_with_a_deep_floor",
     [](Scene& s) {
         s.base = {Base::Kind::level, -0.05};
     }},
    {"shallow_depth", [](Scene& s) { s.material.depth = 0.004; }},
    {"great_depth", [](Scene& s) { s.material.depth = 0.04; }},
    {"masked", [](Scene& s) { s.field = shared(masked_hills(160, 120)); }},
    {"masked_panel",
     [](Scene& s) {
         s.field = shared(masked_hills(160, 120));
         s.base.kind = Base::Kind::automatic;
     }},
    {"scattering",
     [](Scene& s) {
         s.material.scatter.k = 0.6;
         s.base.kind = Base::Kind::automatic;
     }},
    {"glossy",
     [](Scene& s) {
         s.material.specular = {0.5, {0.7, 1}, false};
     }},
    {"very_glossy",
     [](Scene& s) {
         s.material.specular = {0.5, {0.95, 1}, false};
     }},
    {"uniform_weights",
     [](Scene& s) { std::get<EnvironmentLight>(s.lights[0]).weighting = Weighting::uniform; },
     false, true},
    {"beside_a_point_light", [](Scene& s) { s.lights.emplace_back(PointLight{}); }},
    {"from_the_side",
     [](Scene& s) {
         std::get<EnvironmentLight>(s.lights[0]).rotation = {-120, -30};
     }},
};

class SkyLightOf : public testing::TestWithParam<SkyCase> {};

TEST_P(SkyLightOf, SunAndSkyIsCloseToTheFullSum) {
    Scene scene = scene_of(hills(160, 120, 3), sun_and_sky(sky_size));
    GetParam().change(scene);
    const double error = rms_error(scene);
    RecordProperty("rms", std::to_string(error));
    EXPECT_LE(error, GetParam().sharp_sun ? tolerance::sharp_sky_rms : tolerance::sun_and_sky_rms);
}

TEST_P(SkyLightOf, SoftBoxesAreCloseToTheFullSum) {
    Scene scene = scene_of(hills(160, 120, 3), soft_boxes(sky_size));
    GetParam().change(scene);
    const double error = rms_error(scene);
    RecordProperty("rms", std::to_string(error));
    EXPECT_LE(error, GetParam().sharp_boxes ? tolerance::sharp_sky_rms : tolerance::soft_boxes_rms);
}

INSTANTIATE_TEST_SUITE_P(Options, SkyLightOf, testing::ValuesIn(sky_cases),
                         [](const auto& param_info) { return param_info.param.name; });

TEST(SkyLight, GivesTheSameNumbersWithAnyInstructionsThreadsAndCache) {
    Scene scene = scene_of(masked_hills(75, 50), sun_and_sky(32));
    scene.material.specular.k = 0.3;
    scene.base.kind = Base::Kind::automatic;
    HeightField& field = own_field(scene);
    field.key = field.shape_key = "hills";
    const Image expected = rendered(scene);
    for (const Simd simd : available_simd())
        for (const int threads : {1, 3}) {
            SharedCache cache(1 << 24);
            for (int again = 0; again < 2; ++again)
                EXPECT_EQ(
                    render(scene, {}, {Executor(threads), {}, {}, simd, &cache}).pixels.values,
                    expected.values)
                    << name_of(simd) << ", " << threads << " threads, render " << again;
            EXPECT_GT(cache.hits(), 0u);
        }
}

TEST(SkyLight, APartOfTheMapHasTheNumbersOfTheWhole) {
    const Scene scene = scene_of(hills(90, 70), sun_and_sky(32));
    const Image whole = rendered(scene);
    const Rect part{37, 21, 29, 30};
    const Image cut = rendered(scene, {.region = part});
    for (int j = 0; j < part.height; ++j)
        for (int i = 0; i < part.width; ++i)
            for (int c = 0; c < 3; ++c)
                ASSERT_EQ(cut.at(i, j, c), whole.at(part.x + i, part.y + j, c)) << i << ' ' << j;
}

TEST(SkyLight, RotationIntensityAndMaterialColoursTakeTheTransferFromTheCache) {
    Scene scene = scene_of(hills(64, 64), sun_and_sky(32));
    HeightField& field = own_field(scene);
    field.key = field.shape_key = "hills";
    SharedCache cache(1 << 24);
    const RenderControl control{executor(), {}, {}, best_simd(), &cache};
    const Image first = render(scene, {}, control).pixels;
    const std::uint64_t made = cache.misses();
    auto& light = std::get<EnvironmentLight>(scene.lights[0]);
    light.rotation = {100, 0};
    light.intensity = 2;
    light.map = soft_boxes(32);
    scene.material.diffuse_colour = hex_colour(200, 120, 40);
    EXPECT_NE(render(scene, {}, control).pixels.values, first.values);
    EXPECT_EQ(cache.misses(), made);
    scene.material.depth *= 2;  // changes every d
    (void)render(scene, {}, control);
    EXPECT_GT(cache.misses(), made);
}

TEST(SkyLight, PreviewsAreCoarseUntilTheFinalTransferIsThere) {
    Scene scene = scene_of(hills(64, 64), soft_boxes(32));
    HeightField& field = own_field(scene);
    field.key = field.shape_key = "hills";
    SharedCache cache(1 << 24);
    const RenderControl control{executor(), {}, {}, best_simd(), &cache};
    const Output preview{.accuracy = Accuracy::preview};
    EXPECT_EQ(render(scene, preview, control).coarse_environment,
              preview_sky.azimuths * preview_sky.elevations);
    const Picture final = render(scene, {}, control);
    EXPECT_EQ(final.coarse_environment, 0);
    const Picture fine = render(scene, preview, control);
    EXPECT_EQ(fine.coarse_environment, 0);
    EXPECT_EQ(fine.pixels.values, final.pixels.values);
}

// A transfer alone would blur the sun's shadows.
TEST(SkyLight, ShadowsOfASunAreSharp) {
    const auto lit_from = [](Rotation rotation) {
        Scene scene = scene_of(hills(64, 48), sun_in_the_sky(sky_size));
        std::get<EnvironmentLight>(scene.lights[0]).rotation = rotation;
        return scene;
    };
    for (const Rotation rotation : {Rotation{}, Rotation{-40, -20}, Rotation{90, 10}}) {
        Scene scene = lit_from(rotation);
        EXPECT_LT(rms_error(scene), tolerance::sun_and_sky_rms) << rotation.yaw_deg;
        scene.material.specular = {0.4, {0.5, 1}, false};
        scene.material.scatter.k = 0.4;
        EXPECT_LT(rms_error(scene), tolerance::sun_and_sky_rms) << rotation.yaw_deg;
    }
}

TEST(SkyLight, OnlySmallStrongLightsAreSuns) {
    const auto suns = [](std::shared_ptr<const Image> sky) {
        const Scene scene = scene_of(hills(32, 32), std::move(sky));
        const PreparedSolid prepared(scene, {executor()});
        const SkyLight light(scene, std::get<EnvironmentLight>(scene.lights[0]), prepared,
                             SkyLight::Sum::colours, true, {0, 0, 32, 32}, false, {executor()});
        return light.suns().size();
    };
    EXPECT_EQ(suns(sun_in_the_sky(sky_size)), 1u);
    EXPECT_EQ(suns(soft_boxes(sky_size)), 0u);
    EXPECT_EQ(suns(sun_and_sky(sky_size)), 0u) << "11 degrees across";
    EXPECT_EQ(suns(white_sky(sky_size)), 0u);
}

// What the definition says of a uniform sky over endless ground: a plane has d = cos(theta).
TEST(SkyLight, IlluminationOfAPlaneUnderAUniformSkyIsAQuarter) {
    Scene scene = scene_of(field_of(64, 48, [](int, int) { return 0.5; }), white_sky(64));
    scene.relief = 0.02;
    const Image d = rendered(scene, {.layer = Layer::illumination});
    EXPECT_NEAR(d.at(32, 24), 0.25, 0.003);
}

TEST(SkyLight, DataLayersAreThoseOfTheSamples) {
    Scene scene = scene_of(hills(64, 48), sun_and_sky(32));
    scene.material.specular = {0.4, {0.5, 1}, false};
    scene.material.scatter.k = 0.4;
    scene.base.kind = Base::Kind::automatic;
    const Shader full(scene, Transfer::srgb, {.max_texels = 1 << 20}, {executor()});
    const TexelIndex at[] = {{30, 20}};
    const auto layer = [&](Layer l) { return rendered(scene, {.layer = l}).at(30, 20); };
    float d = 0, s = 0, f = 0;
    full.illumination(at, {}, {&d, 1});
    full.specular(at, {&s, 1});
    full.scatter(at, {&f, 1});
    EXPECT_NEAR(layer(Layer::illumination), d, 0.003);
    EXPECT_NEAR(layer(Layer::specular), s, 0.002);
    EXPECT_NEAR(layer(Layer::scatter), f, 0.001);
}

TEST(SkyLight, LeavesToTheSamplesWhatDependsOnMoreThanDirections) {
    Scene scene = scene_of(hills(32, 32), sun_and_sky(32));
    const auto covered = [&] {
        const RenderControl control{executor()};
        return SkyLight::covers(scene, scene.lights[0], PreparedSolid(scene, control));
    };
    EXPECT_TRUE(covered());
    const Scene whole = scene;
    std::get<EnvironmentLight>(scene.lights[0]).radius = 2;
    EXPECT_FALSE(covered());
    scene = whole;
    scene.material.specular = {0.5, {0, 1}, true};
    EXPECT_FALSE(covered());
    scene = whole;
    scene.base = {Base::Kind::level, 0.05};  // above starts of rays
    EXPECT_FALSE(covered());
    scene = whole;
    scene.material.depth = 1e-5;  // too fine for 16-bit heights
    EXPECT_FALSE(covered());
    scene = whole;
    Random random(1);
    scene.field = shared(field_of(32, 32, [&](int, int) { return random(); }));
    scene.relief = 0.5;
    EXPECT_FALSE(covered());
    scene = whole;
    scene.lights = {EnvironmentLight{.map = sun_and_sky(16)}};  // summed in full
    EXPECT_FALSE(covered());
}

}  // namespace
}  // namespace relit::test
