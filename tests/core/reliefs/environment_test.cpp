// Environment light on real reliefs: small maps against the reference's full sum, large ones
// against core's own full sum.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/image/channels.h"
#include "core/image/resample.h"
#include "core/render/render.h"
#include "core/render/shader.h"
#include "tests/support/reference.h"
#include "tests/support/relief_files.h"
#include "tests/support/tolerances.h"

namespace relit::test {
namespace {

// A data environment averaged down to w x h.
std::shared_ptr<const Image> environment(const char* name, int w, int h, bool encoded) {
    const DecodedImage file = decode(read_data(name));
    Image map = rgb_channels(file.image, file.info.has_alpha);
    if (encoded) decode_srgb(map);
    return std::make_shared<const Image>(resample(map, w, h, executor()));
}

template <class Colour>
double encoded_error_squared(const std::array<float, 3>& values, const Colour& b) {
    double sum = 0;
    for (int c = 0; c < 3; ++c) {
        const double e = linear_to_srgb(values[c]) - linear_to_srgb(float(b[c]));
        sum += e * e / 3;
    }
    return sum;
}

double psnr_db(double squares, int pixels) {
    return -10 * std::log10(std::max(squares / pixels, 1e-12));
}

struct EnvironmentCase {
    const char* name;
    const char* file;
    bool encoded;
    int w, h;
    Rotation rotation;
    Weighting weighting;
    std::optional<double> radius;
    Base base;
};

const EnvironmentCase environment_cases[] = {
    {"hdr_16x8", "env/venice_sunset.hdr", false, 16, 8, {0, 0}, Weighting::solid_angle, {}, {}},
    {"hdr_32x16_rotated",
     "env/studio_small_03.hdr",
     false,
     32,
     16,
     {70, -25},
     Weighting::solid_angle,
     {},
     {}},
    {"ldr_32x16_rotated_panel_with_a_back",
     "env/rainbow_srgb.png",
     true,
     32,
     16,
     {-130, 40},
     Weighting::solid_angle,
     {},
     {Base::Kind::automatic, 0}},
    {"hdr_16x8_uniform_on_a_sphere",
     "env/venice_sunset.hdr",
     false,
     16,
     8,
     {30, 10},
     Weighting::uniform,
     1.0,
     {}},
};

std::array<float, 3> colour_at(const Shader& shader, int i, int j) {
    const TexelIndex at[] = {{i, j}};
    std::array<float, 3> rgb;
    shader.beauty(at, {}, rgb);
    return rgb;
}

float illumination_at(const Shader& shader, int i, int j) {
    const TexelIndex at[] = {{i, j}};
    float d = 0;
    shader.illumination(at, {}, {&d, 1});
    return d;
}

class EnvironmentAgainstReference : public testing::TestWithParam<EnvironmentCase> {};

TEST_P(EnvironmentAgainstReference, AgreesWithTheFullSum) {
    const EnvironmentCase& c = GetParam();
    const ReliefFile& file = relief_files[0];
    RELIT_SKIP_WITHOUT_DATA(c.file);
    Scene scene;
    scene.field = shared(load_relief(file));
    scene.base = c.base;
    scene.material.specular = {0.2, {0.7, 1}, true};
    scene.material.scatter.k = 0.3;
    EnvironmentLight sky;
    sky.map = environment(c.file, c.w, c.h, c.encoded);
    sky.rotation = c.rotation;
    sky.weighting = c.weighting;
    sky.radius = c.radius;
    scene.lights = {sky};
    const Shader shader(scene, Transfer::srgb, final_environment, {executor()});
    double squares = 0, d_errors = 0;
    int pixels = 0;
    for (int j = 40; j < 500; j += 46)
        for (int i = 40; i < 500; i += 46) {
            if (!scene.field->is_solid(i, j)) continue;
            const reference::Result expected = reference::shade(scene, i, j, 0.125);
            squares += encoded_error_squared(colour_at(shader, i, j), expected.colour);
            d_errors += std::abs(illumination_at(shader, i, j) - expected.illumination);
            ++pixels;
        }
    ASSERT_GT(pixels, 30);
    RecordProperty("psnr_db", std::to_string(psnr_db(squares, pixels)));
    EXPECT_GE(psnr_db(squares, pixels), tolerance::environment_psnr_db);
    EXPECT_LE(d_errors / pixels, tolerance::mean_d);
}

INSTANTIATE_TEST_SUITE_P(Maps, EnvironmentAgainstReference, testing::ValuesIn(environment_cases),
                         [](const auto& param_info) { return param_info.param.name; });

// A 512 x 256 map has 131072 lights; a render gathers them.
double gathered_psnr_db(const char* file, const Specular& specular, std::optional<double> radius) {
    Scene scene;
    scene.field = shared(smaller_field(load_relief(relief_files[4]), 79, 115, executor(), {}));
    scene.material.specular = specular;
    EnvironmentLight sky;
    sky.map = environment(file, 512, 256, false);
    sky.rotation = {40, 15};
    sky.radius = radius;
    scene.lights = {sky};
    const Shader full(scene, Transfer::srgb, {.max_texels = 512 * 256}, {executor()});
    const Shader gathered(scene, Transfer::srgb, final_environment, {executor()});
    std::vector<double> squares(11);
    parallel_rows(executor(), int(squares.size()), {}, [&](RowRange rows) {
        for (int row = rows.begin; row < rows.end; ++row)
            for (int i = 3; i < 79; i += 15) {
                const int j = 5 + 10 * row;
                squares[row] +=
                    encoded_error_squared(colour_at(gathered, i, j), colour_at(full, i, j));
            }
    });
    double sum = 0;
    for (const double s : squares) sum += s;
    return psnr_db(sum, 66);
}

class GatheredEnvironment : public testing::TestWithParam<const char*> {};

TEST_P(GatheredEnvironment, IsCloseToTheFullSum) {
    RELIT_SKIP_WITHOUT_DATA(GetParam());
    const double matt = gathered_psnr_db(GetParam(), {}, {});
    RecordProperty("psnr_db", std::to_string(matt));
    EXPECT_GE(matt, tolerance::gathered_environment_psnr_db);
}

TEST_P(GatheredEnvironment, KeepsSharpHighlightsWhole) {
    RELIT_SKIP_WITHOUT_DATA(GetParam());
    const double sharp = gathered_psnr_db(GetParam(), {1, {0.95, 1}, false}, {});
    const double mirror = gathered_psnr_db(GetParam(), {1, {0.99, 1}, false}, {});
    const double near_sphere = gathered_psnr_db(GetParam(), {0.5, {0.95, 1}, false}, 0.7);
    RecordProperty("sharp_db", std::to_string(sharp));
    RecordProperty("mirror_db", std::to_string(mirror));
    RecordProperty("near_sphere_db", std::to_string(near_sphere));
    EXPECT_GE(sharp, tolerance::gathered_highlight_psnr_db);
    EXPECT_GE(mirror, tolerance::gathered_highlight_psnr_db);
    EXPECT_GE(near_sphere, tolerance::gathered_highlight_psnr_db);
}

INSTANTIATE_TEST_SUITE_P(Maps, GatheredEnvironment,
                         testing::Values("env/venice_sunset.hdr", "env/studio_small_03.hdr",
                                         "env/rainbow.hdr"),
                         [](const auto& param_info) {
                             std::string name = param_info.param;
                             name = name.substr(4, name.find('.') - 4);
                             return name;
                         });

}  // namespace
}  // namespace relit::test
