// The renderer against the reference on real reliefs: scans with masks, terrain, an albedo; all
// kinds of light and material.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/data.h"
#include "tests/support/maps.h"
#include "tests/support/reference.h"
#include "tests/support/relief_files.h"
#include "tests/support/tolerances.h"

namespace relit::test {
namespace {

struct SceneCase {
    const char* name;
    void (*change)(Scene&);
};

PointLight point(Vec3 position, double intensity = 1) {
    PointLight light;
    light.position = position;
    light.intensity = intensity;
    return light;
}

DirectionalLight sun(double azimuth_deg, double elevation_deg) {
    DirectionalLight light;
    light.azimuth_deg = azimuth_deg;
    light.elevation_deg = elevation_deg;
    return light;
}

const SceneCase scene_cases[] = {
    {"defaults", [](Scene&) {}},
    {"point",
     [](Scene& s) {
         s.lights = {point({0.8, 0.2, 0.4})};
     }},
    {"raking_sun", [](Scene& s) { s.lights = {sun(300, 8)}; }},
    {"view_offset", [](Scene& s) { s.material.offset = Offset::view; }},
    {"light_behind_with_floor_and_scattering",
     [](Scene& s) {
         s.lights = {point({0.5, 0.5, -0.35}, 1.6)};
         s.base = {Base::Kind::level, -0.01};
         s.relief = 0.25;
         s.material.scatter.k = 0.6;
     }},
    {"gloss",
     [](Scene& s) {
         s.material.specular = {0.4, {0.5, 1}, false};
         s.material.specular_colour = hex_colour(255, 201, 106);
     }},
    {"occluded_gloss_with_normal_scale",
     [](Scene& s) {
         s.material.specular = {0.5, {0.3, 1}, true};
         s.normal_scale = 2;
     }},
    {"exponential",
     [](Scene& s) {
         s.material.illumination = Illumination::exponential;
         s.material.attenuation = 40;
     }},
    {"light_inside_the_map_without_floor",
     [](Scene& s) {
         s.lights = {point({0.45, 0.55, 0.12})};
         s.base = {};
     }},
    {"floor_above_0",
     [](Scene& s) {
         s.base = {Base::Kind::level, 0.05};
     }},
    {"automatic_floor_deep_material",
     [](Scene& s) {
         s.base = {Base::Kind::automatic, 0};
         s.material.depth = 0.03;
         s.lights = {sun(45, -25)};
     }},
    {"two_lights",
     [](Scene& s) {
         s.lights = {sun(120, 55), point({0.1, 0.9, 0.3}, 0.8)};
     }},
    {"count",
     [](Scene& s) {
         s.material.illumination = Illumination::count;
         s.material.offset = Offset::view;
         s.relief = 1;
         s.lights = {point({0.3, 0.8, 1.4}, 2)};
     }},
    {"base_colour_exposed_by_albedo",
     [](Scene& s) {
         s.material.base_colour = hex_colour(18, 10, 5);
         s.material.diffuse_colour = {{0.3, 0.7, 0.9}, false};
         own_field(s).albedo = Image(s.field->width(), s.field->height(), 3, 0.25f);
     }},
};

class AgainstReference
    : public testing::TestWithParam<std::tuple<const ReliefFile*, const SceneCase*>> {};

struct Errors {
    std::vector<double> d;
    double squares = 0;
    std::size_t colours = 0;

    [[nodiscard]] double mean_d() const {
        double sum = 0;
        for (const double e : d) sum += e;
        return sum / double(d.size());
    }
    [[nodiscard]] double quantile_d(double share) {
        std::sort(d.begin(), d.end());
        return d[std::size_t(share * double(d.size() - 1))];
    }
    [[nodiscard]] double psnr_db() const {
        return -10 * std::log10(std::max(squares / double(colours), 1e-12));
    }
};

double encoded(double linear) {
    const double v = std::clamp(linear, 0.0, 1.0);
    return v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055;
}

// Rendered as regions of one row, spread over the map; every third texel of them is held against
// the reference.
void compare_row(const Scene& scene, int j, Errors& errors) {
    const Rect row{0, j, scene.field->width(), 1};
    const Image d = rendered(scene, {.layer = Layer::illumination, .region = row});
    const Image beauty = rendered(scene, {.region = row});
    for (int i = j % 3; i < row.width; i += 3) {
        if (!scene.field->is_solid(i, j)) continue;
        const reference::Result expected = reference::shade(scene, i, j);
        errors.d.push_back(std::abs(d.at(i, 0) - expected.illumination));
        for (int c = 0; c < 3; ++c) {
            const double e = beauty.at(i, 0, c) - encoded(expected.colour[c]);
            errors.squares += e * e;
            ++errors.colours;
        }
    }
}

TEST_P(AgainstReference, IlluminationAndColourAgree) {
    const auto [file, scene_case] = GetParam();
    RELIT_SKIP_WITHOUT_DATA(file->heights);
    Scene scene;
    scene.field = shared(load_relief(*file));
    scene_case->change(scene);
    Errors errors;
    for (int k = 0; k < 10; ++k)
        compare_row(scene, (2 * k + 1) * scene.field->height() / 20, errors);
    ASSERT_GT(errors.d.size(), 200u);
    RecordProperty("mean_d", std::to_string(errors.mean_d()));
    RecordProperty("d_of_99_percent", std::to_string(errors.quantile_d(0.99)));
    RecordProperty("psnr_db", std::to_string(errors.psnr_db()));
    EXPECT_LE(errors.mean_d(), tolerance::mean_d);
    EXPECT_LE(errors.quantile_d(0.99), tolerance::d_of_99_percent);
    EXPECT_GE(errors.psnr_db(), tolerance::beauty_psnr_db);
}

std::vector<const ReliefFile*> all_reliefs() {
    std::vector<const ReliefFile*> all;
    for (const ReliefFile& file : relief_files) all.push_back(&file);
    return all;
}

std::vector<const SceneCase*> all_scenes() {
    std::vector<const SceneCase*> all;
    for (const SceneCase& scene : scene_cases) all.push_back(&scene);
    return all;
}

INSTANTIATE_TEST_SUITE_P(Reliefs, AgainstReference,
                         testing::Combine(testing::ValuesIn(all_reliefs()),
                                          testing::ValuesIn(all_scenes())),
                         [](const auto& param_info) {
                             return std::string(std::get<0>(param_info.param)->name) + "_" +
                                    std::get<1>(param_info.param)->name;
                         });

}  // namespace
}  // namespace relit::test
