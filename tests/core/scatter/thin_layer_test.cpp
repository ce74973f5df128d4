#include "core/scatter/thin_layer.h"

#include <gtest/gtest.h>

#include <limits>

#include "core/scatter/fresnel.h"
#include "tests/core/scatter/support.h"

namespace relit::test {
namespace {

using namespace scatter;

constexpr double infinity = std::numeric_limits<double>::infinity();

Vec3 direction_at(double cosine, double phi) {
    const double flat = std::sqrt(1 - cosine * cosine);
    return {flat * std::cos(phi), flat * std::sin(phi), cosine};
}

TEST(HenyeyGreenstein, IntegratesToOneWithMeanCosineG) {
    for (const double g : {-0.9, -0.25, 0.0, 0.5, 0.79, 0.95}) {
        double sum = 0, mean = 0;
        for (int part = 0; part < 64; ++part) {  // steep at one end
            const auto p = [&](double c) { return 2 * pi * henyey_greenstein(c, g); };
            const double from = -1 + part / 32.0, to = from + 1 / 32.0;
            sum += integral(from, to, p);
            mean += integral(from, to, [&](double c) { return c * p(c); });
        }
        EXPECT_NEAR(sum, 1, 1e-10) << g;
        EXPECT_NEAR(mean, g, 1e-10) << g;
    }
}

TEST(ThinLayer, ReflectionIsReciprocal) {
    Random random(23);
    for (int i = 0; i < 1000; ++i) {
        const ThinLayer layer{.tau = random.between(0, 5),
                              .albedo = random.between(0, 1),
                              .g = random.between(-0.9, 0.9),
                              .eta = random.between(1, 2)};
        const Vec3 a = random.direction_above({0, 0, 1}), b = random.direction_above({0, 0, 1});
        EXPECT_NEAR(reflected(layer, a, b), reflected(layer, b, a),
                    1e-12 * (1 + reflected(layer, a, b)));
    }
}

// Transmission the other way is that of the layer turned over, whose indices count from the other
// side; radiance over n^2 is what is kept.
TEST(ThinLayer, TransmissionIsReciprocalOverTheSquaredIndex) {
    Random random(29);
    for (int i = 0; i < 1000; ++i) {
        const double n3 = random.between(1, 2), eta = random.between(1, 2);
        const ThinLayer layer{.tau = random.between(0, 5),
                              .albedo = 0.9,
                              .g = random.between(-0.9, 0.9),
                              .eta = eta,
                              .eta_below = n3};
        ThinLayer turned = layer;
        turned.eta = eta / n3;
        turned.eta_below = 1 / n3;
        const Vec3 a = random.direction_above({0, 0, 1}), b = -random.direction_above({0, 0, 1});
        const double there = transmitted(layer, a, b) / (n3 * n3);
        const double back = transmitted(turned, {b.x, b.y, -b.z}, {a.x, a.y, -a.z});
        EXPECT_NEAR(there, back, 1e-12 * (1 + there)) << i;
    }
}

TEST(ThinLayer, TransmissionIsContinuousWhereTheCosinesMeet) {
    for (const double tau : {0.01, 0.5, 3.0, 20.0})
        for (const double mu : {0.2, 0.5, 0.9}) {
            const ThinLayer layer{.tau = tau, .g = 0.3};
            const Vec3 in = direction_at(mu, 0);
            const double limit = transmitted(layer, in, -direction_at(mu, 0));
            for (const double step : {-1e-5, -1e-6, -9e-7, 9e-7, 1e-6, 2e-6, 1e-5}) {
                const double near = transmitted(layer, in, -direction_at(mu + step, 0));
                // Its own slope over the step, and nothing more.
                EXPECT_NEAR(near / limit, 1, 3 * std::abs(step) * (1 + tau / mu) / mu)
                    << tau << ' ' << mu << ' ' << step;
            }
        }
}

// Either branch of the stable form against long double.
TEST(ThinLayer, TransmissionLosesNoDigits) {
    Random random(31);
    for (int i = 0; i < 10'000; ++i) {
        const double tau = std::pow(10, random.between(-4, 2)), mu_i = random.between(0.05, 1);
        const double mu_t = std::min(1.0, mu_i * (1 + std::pow(10, random.between(-5, -0.3))));
        if (mu_t - mu_i < 2e-6) continue;
        const long double exact =
            (std::exp((long double)-tau / mu_i) - std::exp((long double)-tau / mu_t)) /
            ((long double)mu_i - mu_t);
        const double value =
            transmitted({.tau = tau}, direction_at(mu_i, 0), -direction_at(mu_t, 1));
        EXPECT_NEAR(4 * pi * value, double(exact), 1e-9 * double(exact) + 1e-300)
            << tau << ' ' << mu_i << ' ' << mu_t;
    }
}

TEST(ThinLayer, NothingComesFromOrGoesToTheWrongSide) {
    const ThinLayer layer{.tau = 1, .g = 0.2, .eta = 1.4};
    const Vec3 up = direction_at(0.5, 1), down = -up, along{1, 0, 0};
    EXPECT_GT(reflected(layer, up, up), 0);
    EXPECT_GT(transmitted(layer, up, down), 0);
    for (const Vec3 wrong : {down, along}) {
        EXPECT_EQ(reflected(layer, up, wrong), 0);
        EXPECT_EQ(reflected(layer, wrong, up), 0);
        EXPECT_EQ(transmitted(layer, wrong, down), 0);
    }
    EXPECT_EQ(transmitted(layer, up, up), 0);
    EXPECT_EQ(transmitted(layer, up, along), 0);
    EXPECT_EQ(unscattered(layer, 0), 0);
    // A flat direction below a layer of lower index than what is below it has none inside.
    EXPECT_EQ(transmitted({.tau = 1, .eta = 1.2, .eta_below = 1.8}, up, -direction_at(0.1, 0)), 0);
}

// The projected cosine is the rendering equation's: no second one here (Lommel and Seeliger).
TEST(ThinLayer, EndlesslyDeepWithoutABoundaryIsTheLawOfLommelAndSeeliger) {
    const ThinLayer layer{.tau = infinity, .albedo = 0.8, .g = -0.25};
    for (const double mu_i : {0.1, 0.6, 1.0})
        for (const double mu_r : {0.2, 0.7, 1.0}) {
            const Vec3 in = direction_at(mu_i, 0), out = direction_at(mu_r, 2);
            EXPECT_NEAR(reflected(layer, in, out) * (mu_i + mu_r),
                        0.8 * henyey_greenstein(-dot(in, out), -0.25), 1e-14);
        }
    EXPECT_EQ(transmitted(layer, {0, 0, 1}, {0, 0, -1}), 0);
    EXPECT_EQ(unscattered(layer, 1), 0);
    for (const double mu : {0.1, 0.5, 1.0}) {
        const LayerEnergy energy = layer_energy({.tau = infinity, .albedo = 0.7}, mu);
        EXPECT_NEAR(energy.reflected, 0.35 * (1 - mu * std::log((1 + mu) / mu)), 1e-9) << mu;
    }
    EXPECT_NEAR(layer_energy({.tau = infinity}, 1).reflected, (1 - std::log(2)) / 2, 1e-12);
}

TEST(ThinLayer, GainsNoLight) {
    for (const double theta : {0.0, 20.0, 45.0, 70.0, 85.0, 89.9})
        for (const double albedo : {0.0, 0.5, 1.0})
            for (const double tau : {0.0, 1e-3, 0.1, 1.0, 10.0, infinity})
                for (const double g : {-0.8, 0.0, 0.5, 0.95})
                    for (const double eta : {1.0, 1.1, 1.5, 2.0})
                        for (const double below : {1.0, 1.33}) {
                            const LayerEnergy e = layer_energy({.tau = tau,
                                                                .albedo = albedo,
                                                                .g = g,
                                                                .eta = eta,
                                                                .eta_below = below},
                                                               std::cos(theta * pi / 180));
                            const double sum =
                                e.surface + e.reflected + e.transmitted + e.unscattered;
                            EXPECT_LE(sum, 1 + 1e-9) << theta << ' ' << albedo << ' ' << tau << ' '
                                                     << g << ' ' << eta << ' ' << below;
                            EXPECT_GE(
                                std::min({e.surface, e.reflected, e.transmitted, e.unscattered}),
                                0);
                        }
}

// The azimuth in closed form, against the sum of the BSDFs themselves over the hemispheres.
TEST(LayerEnergy, IsTheIntegralOfTheBsdfs) {
    constexpr int heights = 300, azimuths = 300;
    const ThinLayer layers[] = {{.tau = 0.5, .g = 0.3, .eta = 1.3},
                                {.tau = 2, .albedo = 0.9, .g = -0.5, .eta = 1.5, .eta_below = 1.33},
                                {.tau = 1, .albedo = 0.8, .g = 0.8, .eta = 1.2, .eta_below = 1.6},
                                {.tau = 0.2, .g = 0.9}};
    for (const ThinLayer& layer : layers)
        for (const double cos_i : {0.3, 0.95}) {
            double above = 0, below = 0;
            for (int i = 0; i < heights; ++i)
                for (int j = 0; j < azimuths; ++j) {
                    const double mu = (i + 0.5) / heights;
                    const Vec3 out = direction_at(mu, 2 * pi * (j + 0.5) / azimuths);
                    const double weight = mu * 2 * pi / (heights * azimuths);
                    above += weight * reflected(layer, direction_at(cos_i, 0), out);
                    below += weight * transmitted(layer, direction_at(cos_i, 0), -out);
                }
            const LayerEnergy energy = layer_energy(layer, cos_i);
            EXPECT_NEAR(energy.reflected, above, 2e-4) << layer.g << ' ' << cos_i;
            EXPECT_NEAR(energy.transmitted, below, 2e-4) << layer.g << ' ' << cos_i;
        }
}

TEST(LayerTable, IsWhatWasComputed) {
    for (const double eta : {1.0, 1.3, 1.5})
        for (const double tau : {0.01, 0.5, 5.0})
            for (const double g : {0.0, 0.8}) {
                const ThinLayer layer{.tau = tau, .albedo = 0.95, .g = g, .eta = eta};
                const LayerTable table(layer);
                const double allowed = eta < 1.3 ? 5e-3 : 1e-3;
                for (double mu = 0.0005; mu <= 1; mu += 0.0125) {
                    const LayerEnergy energy = layer_energy(layer, mu);
                    EXPECT_NEAR(table.reflected(mu), energy.reflected, allowed) << eta << ' ' << mu;
                    EXPECT_NEAR(table.transmitted(mu), energy.transmitted, allowed)
                        << eta << ' ' << mu;
                }
                EXPECT_NEAR(table.transmitted(1), layer_energy(layer, 1).transmitted, 1e-12);
                EXPECT_TRUE(std::isfinite(table.reflected(0)) &&
                            std::isfinite(table.transmitted(0)));
            }
}

TEST(ThinLayer, TheLiteralFormTakesTheBoundaryTwice) {
    ThinLayer layer{.tau = 1, .g = 0.4, .eta = 1.5};
    const Vec3 in = direction_at(0.4, 0), up = direction_at(0.8, 2), down = -up;
    const double once = reflected(layer, in, up), through = transmitted(layer, in, down);
    layer.hk_literal = true;
    EXPECT_NEAR(reflected(layer, in, up), once * transmittance(0.4, 1.5), 1e-15);
    EXPECT_NEAR(transmitted(layer, in, down), through * transmittance(0.4, 1.5), 1e-15);
}

TEST(LayerPresets, HaveTheOpticalDepthsOfSkin) {
    ASSERT_EQ(layer_presets().size(), 2u);
    const LayerPreset& epidermis = layer_presets()[0];
    const LayerPreset& dermis = layer_presets()[1];
    EXPECT_EQ(epidermis.name, "epidermis");
    EXPECT_EQ(dermis.name, "dermis");
    EXPECT_NEAR(thin_layer(epidermis.coefficients, epidermis.thinnest).tau, 0.54, 0.005);
    EXPECT_NEAR(thin_layer(epidermis.coefficients, epidermis.thickest).tau, 5.4, 0.05);
    EXPECT_NEAR(thin_layer(epidermis.coefficients, 0.05).albedo, 0.929, 5e-4);
    EXPECT_NEAR(thin_layer(dermis.coefficients, dermis.thinnest).tau, 13.2, 0.05);
    EXPECT_NEAR(thin_layer(dermis.coefficients, dermis.thickest).tau, 66, 0.05);
    EXPECT_NEAR(thin_layer(dermis.coefficients, 1).albedo, 0.986, 5e-4);
}

// One event of scattering followed by chance: entry by T_12, free paths, a direction by Henyey and
// Greenstein, out by T where no second event comes first.
struct Followed {
    int above = 0;
    int below = 0;
    int straight = 0;
};

Vec3 scattered(Vec3 from, double g, Random& random) {
    const double u = random.between(0, 1);
    const double fraction = (1 - g * g) / (1 - g + 2 * g * u);
    const double cosine = g == 0 ? 1 - 2 * u : (1 + g * g - fraction * fraction) / (2 * g);
    const Vec3 side =
        normalized(cross(from, std::abs(from.x) < 0.9 ? Vec3{1, 0, 0} : Vec3{0, 1, 0}));
    const Vec3 other = cross(from, side);
    const double flat = std::sqrt(std::max(0.0, 1 - cosine * cosine)),
                 phi = random.between(0, 2 * pi);
    return cosine * from + flat * std::cos(phi) * side + flat * std::sin(phi) * other;
}

bool leaves(double inside_cosine, double eta, Random& random) {
    return random.between(0, 1) < transmittance(inside_cosine, 1 / eta);
}

Followed followed(const ThinLayer& layer, double cos_i, int photons, Random& random) {
    Followed count;
    const double inside = refracted_cosine(cos_i, layer.eta);
    const Vec3 in{std::sqrt(1 - inside * inside), 0, -inside};
    const double down = layer.eta / layer.eta_below;
    for (int i = 0; i < photons; ++i) {
        if (random.between(0, 1) >= transmittance(cos_i, layer.eta)) continue;
        const double depth = -std::log(random.between(0, 1)) * inside;
        if (depth >= layer.tau) {
            count.straight += leaves(inside, down, random);
            continue;
        }
        if (random.between(0, 1) >= layer.albedo) continue;
        const Vec3 out = scattered(in, layer.g, random);
        const double way = (out.z > 0 ? depth : layer.tau - depth) / std::abs(out.z);
        if (-std::log(random.between(0, 1)) < way) continue;  // a second event
        if (!leaves(std::abs(out.z), out.z > 0 ? layer.eta : down, random)) continue;
        ++(out.z > 0 ? count.above : count.below);
    }
    return count;
}

// With 20 million photons all 30 shares were within 1.6 standard errors; one seed in twelve has a
// share beyond 3, so the seed is fixed.
TEST(LayerEnergy, AgreesWithPhotonsThatScatterOnce) {
    constexpr int photons = 300'000;
    Random random(38);
    const ThinLayer layers[] = {{.tau = 0.5},
                                {.tau = 1, .albedo = 0.8, .g = 0.79},
                                {.tau = 3, .albedo = 0.95, .g = -0.4},
                                {.tau = 0.7, .albedo = 0.9, .g = 0.5, .eta = 1.4},
                                {.tau = 2, .albedo = 1, .g = 0, .eta = 1.5, .eta_below = 1.33}};
    for (const ThinLayer& layer : layers)
        for (const double cos_i : {1.0, 0.5}) {
            SCOPED_TRACE(testing::Message() << layer.tau << ' ' << layer.eta << ' ' << cos_i);
            const Followed count = followed(layer, cos_i, photons, random);
            const LayerEnergy energy = layer_energy(layer, cos_i);
            const auto expect_share = [&](int counted, double share) {
                const double error = std::sqrt(share * (1 - share) / photons);
                EXPECT_NEAR(double(counted) / photons, share, 3 * error);
            };
            expect_share(count.above, energy.reflected);
            expect_share(count.below, energy.transmitted);
            expect_share(count.straight, energy.unscattered);
        }
}

}  // namespace
}  // namespace relit::test
