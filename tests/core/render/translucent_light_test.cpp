// The models of subsurface scattering through render(): against the double sum over all texels with
// the exact scalar march, and against what is known of planes.
#include "core/render/translucent_light.h"

#include <gtest/gtest.h>

#include <numeric>

#include "core/base/angle.h"
#include "core/base/error.h"
#include "core/field/normals.h"
#include "core/scatter/dipole.h"
#include "core/scatter/fresnel.h"
#include "core/scatter/highlight.h"
#include "tests/support/maps.h"
#include "tests/support/skies.h"
#include "tests/support/translucent.h"

namespace relit::test {
namespace {

// L_o of section 2.1, every texel with every other.
Image summed_subsurface(const Scene& scene) {
    const HeightField& field = *scene.field;
    const Solid solid = make_solid(field, scene.relief, scene.base, scene.material.depth);
    const Material& m = scene.material;
    const int width = field.width(), height = field.height();
    const double eta = m.medium.eta, spacing = 1.0 / width;
    Image sum(width, height, 3);
    for (int c = 0; c < 3; ++c) {
        const scatter::StandardDipole dipole(scatter::channel(m.medium, c, m.mm_per_width));
        for (int q = 0; q < height; ++q)
            for (int p = 0; p < width; ++p) {
                const double n_z = normal_from(slopes_at(field, scene.relief, p, q)).z;
                double flux = 0;
                for (int j = 0; j < height; ++j)
                    for (int i = 0; i < width; ++i) {
                        const double area =
                            spacing * spacing / normal_from(slopes_at(field, scene.relief, i, j)).z;
                        const double r =
                            length(surface_point(solid, i, j) - surface_point(solid, p, q));
                        flux += dipole.at(r) * area * lit_texel(scene, solid, i, j).entering;
                    }
                sum.at(p, q, c) = float(scatter::transmittance(n_z, eta) /
                                        scatter::diffuse_transmittance(eta) * flux);
            }
    }
    return sum;
}

TEST(TranslucentLight, IsTheDoubleSumOverAllTexels) {
    // Texels finer than a mean free path, so that the plain sum is one.
    for (const Light& light : {Light(sun(40)), Light(PointLight{{0.2, 0.7, 0.5}})}) {
        Scene scene = scene_of(hills(24, 20), dipole_of("marble", 6), light);
        const Image expected = summed_subsurface(scene);
        EXPECT_LT(rms(rendered(scene, layer(Layer::subsurface)), expected), 0.005);
        EXPECT_LT(rms(rendered(scene, raw), expected), 0.005) << "all that beauty shows";
    }
}

TEST(TranslucentLight, OfAWideEvenPlaneIsTheTotalOfTheProfile) {
    for (const char* medium : {"marble", "skin1", "ketchup", "whole-milk"}) {
        const Scene scene = scene_of(flat(48, 48), dipole_of(medium, 4000), sun(90));
        const Image picture = rendered(scene, layer(Layer::subsurface));
        const double eta = scene.material.medium.eta, t = scatter::transmittance(1, eta);
        for (int c = 0; c < 3; ++c) {
            const scatter::StandardDipole dipole(scatter::channel(scene.material.medium, c, 4000));
            const double expected = t * t / scatter::diffuse_transmittance(eta) * dipole.total();
            EXPECT_NEAR(at_middle(picture, c) / expected, 1, 0.01) << medium << ' ' << c;
        }
    }
}

TEST(TranslucentLight, GivesBackAllUniformLightThatEntersAWhiteMedium) {
    Material white = dipole_of("spectralon", 1e6);
    EnvironmentLight sky;
    sky.map = environment_of(48, [](Vec3) { return Rgb{1, 1, 1}; });
    sky.intensity = 4;  // its mean over the sphere counts: a floor sees the half of it, at an angle
    const Scene scene = scene_of(flat(48, 48), white, sky);
    EXPECT_NEAR(at_middle(rendered(scene, layer(Layer::irradiance))), 1, 0.01);
    const double eta = white.medium.eta;
    const double seen = scatter::transmittance(1, eta);  // of what leaves, straight up
    EXPECT_NEAR(at_middle(rendered(scene, layer(Layer::subsurface))) / seen, 1, 0.01);
}

TEST(TranslucentLight, OfEveryModelIsTheTotalOnAWidePlane) {
    for (const Model model : {Model::dipole, Model::better_dipole, Model::normalised_diffusion}) {
        Material m = dipole_of("skin2", 4000);
        m.model = model;
        const Scene scene = scene_of(flat(40, 40), m, sun(90));
        const scatter::Coefficients medium = scatter::channel(m.medium, 1, 4000);
        const double total = model == Model::better_dipole
                                 ? scatter::BetterDipole(medium).total()
                                 : scatter::StandardDipole(medium).total();
        const double eta = m.medium.eta, t = scatter::transmittance(1, eta);
        EXPECT_NEAR(at_middle(rendered(scene, layer(Layer::subsurface)), 1) /
                        (t * t / scatter::diffuse_transmittance(eta) * total),
                    1, 0.01)
            << int(model);
    }
}

TEST(TranslucentLight, IrradianceOfAPlaneIsTheCosineForEveryModel) {
    for (const Model model : {Model::integrated, Model::dipole}) {
        Material m;
        m.model = model;
        const Scene scene = scene_of(flat(40, 40), m, sun(30));
        EXPECT_NEAR(at_middle(rendered(scene, layer(Layer::irradiance))), 0.5, 1e-5);
    }
}

TEST(TranslucentLight, IrradianceOfASkyIsTheSumOverItsTexels) {
    Scene scene = scene_of(hills(40, 32), dipole_of("marble", 80));
    EnvironmentLight sky;
    sky.map = sun_and_sky(48);  // by its transfer
    scene.lights = {sky};
    const Image fast = rendered(scene, layer(Layer::irradiance));
    EnvironmentLight few = sky;
    few.radius = 900;  // far away, yet summed over regions
    scene.lights = {few};
    EXPECT_LT(rms(fast, rendered(scene, layer(Layer::irradiance))), 0.06);
}

TEST(TranslucentLight, SubsurfaceHighlightsAreTheLocalOnesOnAPlane) {
    Material m = dipole_of("marble", 800);
    m.highlight.k = 0.7;
    for (const auto lobe : {scatter::LobeKind::cosine, scatter::LobeKind::ward,
                            scatter::LobeKind::ashikhmin, scatter::LobeKind::lafortune}) {
        m.highlight.lobe = lobe;
        if (lobe == scatter::LobeKind::lafortune) m.highlight.n_t = m.highlight.n_b = -0.5;
        m.highlight.transport = HighlightTransport::local;
        const double local =
            at_middle(rendered(scene_of(flat(48, 48), m, sun(60)), layer(Layer::highlight)));
        m.highlight.transport = HighlightTransport::subsurface;
        const double carried =
            at_middle(rendered(scene_of(flat(48, 48), m, sun(60)), layer(Layer::highlight)));
        EXPECT_GT(local, 1e-3) << int(lobe);
        EXPECT_NEAR(carried / local, 1, 0.01) << int(lobe);
    }
}

TEST(TranslucentLight, SubsurfaceHighlightsAreTheDoubleSum) {
    Material m = dipole_of("marble", 2);  // extinction 2.6 per mm: texels far finer than its length
    m.highlight = {.k = 0.5, .n_t = 4, .n_b = 8};
    const Scene scene = scene_of(hills(24, 20), m, sun(40));
    const HeightField& field = *scene.field;
    const Solid solid = make_solid(field, scene.relief, scene.base, m.depth);
    const scatter::Lobe lobe{
        .kind = m.highlight.lobe, .n_t = 4, .n_b = 8, .eta = m.medium.eta, .least_cosine = 1e-3};
    const auto& s = m.medium.sigma_s;
    const auto& a = m.medium.sigma_a;
    const scatter::HighlightFalloff falloff{
        2 * (std::accumulate(s.begin(), s.end(), 0.0) + std::accumulate(a.begin(), a.end(), 0.0)) /
        3};
    Image expected(field.width(), field.height(), 3);
    for (int q = 0; q < field.height(); ++q)
        for (int p = 0; p < field.width(); ++p) {
            double sum = 0;
            for (int j = 0; j < field.height(); ++j)
                for (int i = 0; i < field.width(); ++i) {
                    const Vec3 n = normal_from(slopes_at(field, scene.relief, i, j));
                    const Lit lit = lit_texel(scene, solid, i, j);
                    const double r =
                        length(surface_point(solid, i, j) - surface_point(solid, p, q));
                    sum +=
                        scatter::value(lobe, scatter::highlight_frame(n), lit.to_light, {0, 0, 1}) *
                        lit.visibility * falloff.at(r) / (24.0 * 24 * n.z);
                }
            for (int c = 0; c < 3; ++c)
                expected.at(p, q, c) = float(0.5 * falloff.normalisation() * sum);
        }
    EXPECT_LT(rms(rendered(scene, layer(Layer::highlight)), expected), 0.01);
}

TEST(TranslucentLight, ThroughAFilmOfNothingIsAsWithoutOne) {
    Scene scene = scene_of(hills(32, 24), dipole_of("skin1", 40), sun(50));
    const Image bare = rendered(scene, raw);
    scatter::Medium thin = scene.material.medium;
    scene.material.film = Film{.medium = thin, .thickness = 1e-7};
    EXPECT_LT(rms(rendered(scene, raw), bare), 1e-3);
    scene.material.film = Film{.thickness = 0.01};
    const Image filmed = rendered(scene, raw);
    EXPECT_GT(rms(filmed, bare), 0.05);
    for (const float v : filmed.values) EXPECT_TRUE(v >= 0 && std::isfinite(v));
}

TEST(TranslucentLight, BumpsTurnNormalsAndMoveNothing) {
    // A plane whose bump map rises evenly has the cosine of the slope, and no shadows of its own.
    Scene scene = scene_of(flat(40, 40), dipole_of("marble", 800), sun(40, 90));
    own_field(scene).bump = tilted_plane(40, 40, 0.2, -0.3, 0).heights;
    scene.bump_relief = 0.2;
    const Vec3 n = normalized({0.3, 0, 1});
    const Vec3 l{std::cos(radians(40)), 0, std::sin(radians(40))};
    EXPECT_NEAR(at_middle(rendered(scene, layer(Layer::irradiance))), dot(n, l), 1e-4);
    const Image normals = rendered(scene, {.layer = Layer::normal});
    EXPECT_NEAR(at_middle(normals), 0.5 * n.x + 0.5, 1e-4);
    EXPECT_NEAR(at_middle(rendered(scene, {.layer = Layer::thickness})),
                at_middle(rendered(scene_of(flat(40, 40), dipole_of("marble", 800), sun(40, 90)),
                                   {.layer = Layer::thickness})),
                1e-6);
    scene.lights = {sun(-10, 90)};  // before the bumps, behind the surface
    own_field(scene).bump = tilted_plane(40, 40, 2, -3, 0).heights;
    scene.bump_relief = 2;
    EXPECT_EQ(at_middle(rendered(scene, layer(Layer::irradiance))), 0);
}

TEST(TranslucentLight, WeighsScatteringAndMattReflection) {
    Scene scene = scene_of(hills(32, 24), dipole_of("marble", 80), sun(50));
    const Image subsurface = rendered(scene, layer(Layer::subsurface));
    const Image irradiance = rendered(scene, layer(Layer::irradiance));
    scene.material.bssrdf_weight = 0.8;
    scene.material.diffuse_weight = 0.2;
    scene.material.specular.k = 0.25;
    scene.material.specular_colour = hex_colour(0, 0, 0);
    own_field(scene).albedo = Image(32, 24, 3, 0.5f);
    const Image picture = rendered(scene, raw);
    for (std::size_t n = 0; n < picture.values.size(); ++n)
        EXPECT_NEAR(picture.values[n],
                    0.75 * 0.5 * (0.8 * subsurface.values[n] + 0.2 * irradiance.values[n]), 1e-5);
}

TEST(TranslucentLight, IsTheSameForAnyThreadsAndInstructionSet) {
    Material m = dipole_of("skin1", 30);
    m.highlight.k = 0.4;
    m.film = Film{};
    Scene scene = scene_of(hills(75, 52), m, PointLight{{0.3, 0.8, 0.4}});
    own_field(scene).alpha = Image(75, 52, 1, 1.0f);
    for (int j = 10; j < 30; ++j)
        for (int i = 20; i < 40; ++i) own_field(scene).alpha.at(i, j) = 0;
    const Image expected = render(scene, {}, {Executor(1)}).pixels;
    for (const Simd simd : available_simd())
        for (const int threads : {1, 3})
            EXPECT_EQ(
                render(scene, {}, {.executor = Executor(threads), .simd = simd}).pixels.values,
                expected.values)
                << name_of(simd) << ' ' << threads;
}

TEST(TranslucentLight, OfARegionIsThatPartOfTheWholePicture) {
    const Scene scene = scene_of(hills(48, 36), dipole_of("marble", 80), sun(30));
    const Rect region{5, 7, 20, 11};
    Output part = raw;
    part.region = region;
    const Image whole = rendered(scene, raw), of_region = rendered(scene, part);
    for (int y = 0; y < region.height; ++y)
        for (int x = 0; x < region.width; ++x)
            EXPECT_EQ(of_region.at(x, y, 1), whole.at(region.x + x, region.y + y, 1));
}

TEST(TranslucentLight, PreviewsAreNearTheFinalPicture) {
    const Scene scene = scene_of(hills(160, 120), dipole_of("marble", 80), sun(30));
    Output preview = raw;
    preview.accuracy = Accuracy::preview;
    EXPECT_LT(rms(rendered(scene, preview), rendered(scene, raw)), 0.03);
}

TEST(TranslucentLight, IsFiniteForMediaAtTheEdgesOfTheirRanges) {
    for (const double sigma : {1e-6, 1e4})
        for (const double absorption : {0.0, 1e4})
            for (const double width : {1e-3, 1e6})
                for (const int size : {1, 5}) {
                    Material m = dipole_of("marble", width);
                    m.medium = {.sigma_a = {absorption, 0, absorption},
                                .sigma_s = {sigma, sigma, sigma},
                                .g = {0.99, -0.99, 0},
                                .eta = 1};
                    m.highlight.k = 1;
                    m.film = Film{.medium = m.medium, .thickness = 100};
                    constexpr auto published = scatter::DirectionalEnergy::published;
                    constexpr auto matched = scatter::DirectionalEnergy::matched;
                    for (const auto& [model, energy] :
                         {std::pair(Model::dipole, published),
                          std::pair(Model::better_dipole, published),
                          std::pair(Model::directional_dipole, published),
                          std::pair(Model::directional_dipole, matched),
                          std::pair(Model::normalised_diffusion, published)}) {
                        m.model = model;
                        m.directional_energy = energy;
                        for (const float v :
                             rendered(scene_of(hills(size, size), m, sun(30)), raw).values)
                            EXPECT_TRUE(std::isfinite(v) && v >= 0)
                                << sigma << ' ' << absorption << ' ' << width << ' ' << size << ' '
                                << int(model) << ' ' << int(energy);
                    }
                }
}

TEST(TranslucentLight, LightFromBehindComesThroughAPanelAsFarAsItsMediumLetsIt) {
    // A flat panel lit evenly from behind: the integral of R over its back, by rings.
    Material m = dipole_of("skin1", 40);
    Scene scene = scene_of(flat(40, 40), m, sun(-90));
    scene.base = {Base::Kind::level, -0.01};
    const double thickness = 0.5 * scene.relief + 0.01, eta = m.medium.eta;
    const double t = scatter::transmittance(1, eta);
    const Image picture = rendered(scene, layer(Layer::subsurface));
    for (int c = 0; c < 3; ++c) {
        const scatter::StandardDipole dipole(scatter::channel(m.medium, c, 40));
        double through = 0;
        for (int n = 0; n < 100'000; ++n) {
            const double rho = (n + 0.5) * 1e-4;
            through += dipole.at(std::hypot(rho, thickness)) * 2 * std::numbers::pi * rho * 1e-4;
        }
        const double expected = t * t / scatter::diffuse_transmittance(eta) * through;
        EXPECT_NEAR(at_middle(picture, c) / expected, 1, 1e-3) << c;
    }
    EXPECT_GT(at_middle(picture, 0), 3 * at_middle(picture, 2)) << "red goes farther";
    PointLight lamp;
    lamp.position = {0.5, 0.5, -0.4};
    scene.lights = {lamp};
    const Image lit = rendered(scene, layer(Layer::subsurface));
    EXPECT_GT(at_middle(lit), 1.2 * lit.at(0, 0, 0)) << "brightest before the lamp";
    EnvironmentLight sky;
    sky.map = environment_of(48, [](Vec3) { return Rgb{1, 1, 1}; });
    scene.lights = {sky};
    const Image with_back = rendered(scene, layer(Layer::subsurface));
    scene.base = {};
    EXPECT_GT(at_middle(with_back), 1.001 * at_middle(rendered(scene, layer(Layer::subsurface))));
}

TEST(TranslucentLight, OfNoLightIsNothing) {
    const Scene scene = scene_of(hills(32, 24), dipole_of("marble", 80), sun(-30));
    for (const float v : rendered(scene, raw).values) EXPECT_EQ(v, 0);
}

TEST(TranslucentLight, StopsWhenAsked) {
    std::stop_source stop;
    stop.request_stop();
    const Scene scene = scene_of(hills(64, 64), dipole_of("marble", 80));
    EXPECT_THROW((void)render(scene, {}, {.executor = executor(), .stop = stop.get_token()}),
                 Error);
}

}  // namespace
}  // namespace relit::test
