// The directional dipole through render(): against the double sum over all texels with the exact scalar
// march, and against what is known of planes.
#include <gtest/gtest.h>

#include <numbers>

#include "core/render/translucent_light.h"
#include "core/scatter/directional_dipole.h"
#include "tests/support/skies.h"
#include "tests/support/translucent.h"

namespace relit::test {
namespace {

// L_o of section 3, every texel with every other, S as core/scatter has it.
Image summed_directional(const Scene& scene) {
    const HeightField& field = *scene.field;
    const Solid solid = make_solid(field, scene.relief, scene.base, scene.material.depth);
    const Material& m = scene.material;
    const int width = field.width(), height = field.height();
    const auto point = [&](int i, int j) {
        return scatter::SurfacePoint{surface_point(solid, i, j),
                                     normal_from(slopes_at(field, scene.relief, i, j))};
    };
    Image sum(width, height, 3);
    for (int j = 0; j < height; ++j)
        for (int i = 0; i < width; ++i) {
            const scatter::SurfacePoint entry = point(i, j);
            const Lit lit = lit_texel(scene, solid, i, j);
            const double flux =
                std::numbers::pi * lit.irradiance / (width * width * entry.normal.z);
            for (int c = 0; c < 3; ++c) {
                const scatter::DirectionalDipole dipole = scatter::directional_dipole(
                    scatter::channel(m.medium, c, m.mm_per_width), {.robust = true});
                for (int q = 0; flux > 0 && q < height; ++q)
                    for (int p = 0; p < width; ++p)
                        sum.at(p, q, c) += float(
                            flux * bssrdf(dipole, entry, lit.to_light, point(p, q), {0, 0, 1}));
            }
        }
    return sum;
}

TEST(DirectionalLightBelow, IsTheDoubleSumOverAllTexels) {
    for (const Light& light : {Light(sun(35)), Light(PointLight{{0.2, 0.7, 0.5}})}) {
        Material m = dipole_of("marble", 0.6);  // texels far finer than a mean free path
        m.model = Model::directional_dipole;
        const Scene scene = scene_of(hills(40, 30), m, light);
        const Image expected = summed_directional(scene);
        EXPECT_LT(rms(rendered(scene, layer(Layer::subsurface)), expected), 0.01);
        EXPECT_LT(rms(rendered(scene, raw), expected), 0.01) << "all that beauty shows";
    }
}

TEST(DirectionalLightBelow, MatchedToTheBetterDipoleIsAsBrightWhereStraightLightMeetsAPlane) {
    Material m = dipole_of("skin2", 4000);
    for (const Accuracy accuracy : {Accuracy::final, Accuracy::preview}) {
        Output output = layer(Layer::subsurface);
        output.accuracy = accuracy;
        const auto picture = [&](Model model, scatter::DirectionalEnergy energy) {
            m.model = model;
            m.directional_energy = energy;
            return rendered(scene_of(flat(40, 40), m, sun(90)), output);
        };
        using enum scatter::DirectionalEnergy;
        const Image better = picture(Model::better_dipole, published);
        const Image with = picture(Model::directional_dipole, matched);
        const Image without = picture(Model::directional_dipole, published);
        for (int c = 0; c < 3; ++c) {
            EXPECT_NEAR(at_middle(with, c) / at_middle(better, c), 1, 0.02) << c;
            EXPECT_GT(at_middle(without, c), 1.2 * at_middle(better, c)) << c;
        }
        EXPECT_EQ(picture(Model::better_dipole, matched).values, better.values) << "no use for it";
    }
}

TEST(DirectionalLightBelow, IsNotTakenFromACacheForAnotherEnergy) {
    Material m = dipole_of("skin2", 40);
    m.model = Model::directional_dipole;
    Scene scene = scene_of(hills(24, 20), m, sun(40));
    HeightField& field = own_field(scene);
    field.key = field.shape_key = "hills";
    SharedCache cache(1 << 24);
    const auto picture = [&](SharedCache* kept) {
        return render(scene, raw, {.executor = executor(), .cache = kept}).pixels.values;
    };
    EXPECT_EQ(picture(&cache), picture(nullptr));
    scene.material.directional_energy = scatter::DirectionalEnergy::matched;
    EXPECT_EQ(picture(&cache), picture(nullptr));
}

TEST(DirectionalLightBelow, IsTheHalfSpaceTotalOnAWidePlane) {
    Material m = dipole_of("skin2", 4000);
    m.model = Model::directional_dipole;
    const double eta = m.medium.eta, t = scatter::transmittance(1, eta);
    const auto middle = [&](const Light& light, int c) {
        return at_middle(rendered(scene_of(flat(40, 40), m, light), layer(Layer::subsurface)), c);
    };
    EnvironmentLight sky;
    sky.map = environment_of(48, [](Vec3) { return Rgb{1, 1, 1}; });
    sky.intensity = 4;
    for (int c = 0; c < 3; ++c) {
        const double total = half_space_total(
            scatter::directional_dipole(scatter::channel(m.medium, c, m.mm_per_width)));
        EXPECT_NEAR(middle(sun(90), c) / (t * t / scatter::diffuse_transmittance(eta) * total), 1,
                    0.01);
        // Slanting light comes back more than straight light does.
        const double of_sky = middle(sky, c) / (t * total);
        EXPECT_GT(of_sky, 0.99);
        EXPECT_LT(of_sky, 1.15);
    }
    m.film = Film{.medium = m.medium, .thickness = 1e-7};
    const double filmed = middle(sun(60), 1);
    m.film.reset();
    EXPECT_NEAR(filmed / middle(sun(60), 1), 1, 2e-3);
}

}  // namespace
}  // namespace relit::test
