#include "core/scatter/dipole.h"

#include <gtest/gtest.h>

#include <limits>

#include "core/scatter/fresnel.h"
#include "core/scatter/normalised_diffusion.h"
#include "tests/core/scatter/support.h"

namespace relit::test {
namespace {

using namespace scatter;

constexpr double infinity = std::numeric_limits<double>::infinity();

template <typename Profile>
class Dipoles : public testing::Test {};
using BothDipoles = testing::Types<StandardDipole, BetterDipole>;
TYPED_TEST_SUITE(Dipoles, BothDipoles);

TYPED_TEST(Dipoles, DiscAndTotalAreTheProfilesIntegrals) {
    for (const NamedMedium& medium : measured_media()) {
        for (int c = 0; c < 3; ++c) {
            SCOPED_TRACE(testing::Message() << medium.name << ' ' << c);
            const Coefficients k = channel(medium.medium, c);
            const TypeParam profile(k);
            const double path = derived(k).free_path;
            const auto at = [&](double r) { return profile.at(r); };
            for (const double radius : {0.01, 0.3, 1.0, 7.0, 30.0}) {
                const double disc = profile.within(radius * path);
                EXPECT_NEAR(disc_integral(path, radius * path, at) / disc, 1, 1e-6) << radius;
            }
            const double far = 60 / derived(k).sigma_tr;
            EXPECT_NEAR(disc_integral(path, far, at) / profile.total(), 1, 1e-6);
            EXPECT_NEAR(profile.within(infinity) / profile.total(), 1, 1e-12);
            EXPECT_EQ(profile.within(0), 0);
        }
    }
}

// Cells much smaller than the source's depth, where e^{-s z} - z e^{-s d}/d would cancel.
TYPED_TEST(Dipoles, SmallDiscsLoseNoDigits) {
    const TypeParam profile(measured("marble", 0));
    for (const double a : {1e-3, 1e-6, 1e-9})
        EXPECT_NEAR(profile.within(a) / (pi * a * a * profile.at(0)), 1, 2 * a + 1e-12) << a;
}

TYPED_TEST(Dipoles, ArePositiveAndFallWithDistance) {
    for (const char* name : {"marble", "ketchup", "skim-milk", "espresso"})
        for (int c = 0; c < 3; ++c) {
            const TypeParam profile(measured(name, c));
            const double step = derived(measured(name, c)).free_path / 20;
            double before = infinity, disc = 0;
            for (int i = 0; i < 400; ++i) {
                const double here = profile.at(i * step), within = profile.within((i + 1) * step);
                EXPECT_GT(here, 0) << name << c << ' ' << i;
                EXPECT_LT(here, before) << name << c << ' ' << i;
                EXPECT_GE(within, disc) << name << c << ' ' << i;
                EXPECT_LE(within, profile.total() * (1 + 1e-12)) << name << c << ' ' << i;
                before = here;
                disc = within;
            }
        }
}

TYPED_TEST(Dipoles, ScaleWithTheSquareOfTheUnit) {
    const Medium& medium = find_medium("skin2")->medium;
    for (int c = 0; c < 3; ++c) {
        const TypeParam one(channel(medium, c)), scaled(channel(medium, c, 80));
        for (const double r : {0.0, 0.1, 1.0, 5.0}) {
            EXPECT_NEAR(scaled.at(r / 80) / (6400 * one.at(r)), 1, 1e-12) << r;
            EXPECT_NEAR(scaled.within(r / 80), one.within(r), 1e-12) << r;
        }
        EXPECT_NEAR(scaled.total(), one.total(), 1e-13);
    }
}

TYPED_TEST(Dipoles, AreFiniteForAbsurdMedia) {
    for (const double sigma_a : {0.0, 1e-6, 1.0, 1e4, 1e6})
        for (const double sigma_s : {0.0, 1e-6, 1.0, 1e4, 1e6})
            for (const double g : {-0.99, 0.0, 0.999})
                for (const double eta : {1.0, 1.01, 1.3, 3.0}) {
                    if (sigma_a + sigma_s == 0) continue;
                    const TypeParam profile(Coefficients{sigma_a, sigma_s, g, eta});
                    for (const double r : {0.0, 1e-9, 1e-3, 1.0, 1e3, 1e300}) {
                        EXPECT_TRUE(profile.at(r) >= 0 && profile.at(r) < infinity)
                            << sigma_a << ' ' << sigma_s << ' ' << r;
                        EXPECT_TRUE(profile.within(r) >= 0 && profile.within(r) <= 1 + 1e-9)
                            << sigma_a << ' ' << sigma_s << ' ' << r;
                    }
                    EXPECT_TRUE(profile.total() >= 0 && profile.total() <= 1 + 1e-9);
                }
}

TEST(StandardDipole, IsTheClosedTotalOfItsAlbedo) {
    for (int c = 0; c < 3; ++c) {
        const Derived d = derived(measured("apple", c));
        const double q = std::sqrt(3 * (1 - d.alpha_prime));
        EXPECT_NEAR(StandardDipole(measured("apple", c)).total(),
                    d.alpha_prime / 2 * (1 + std::exp(-4.0 / 3 * d.a_j * q)) * std::exp(-q), 1e-12);
    }
}

TEST(Dipoles, WhereSigmaTimesDistanceIsBeyondEightyThereIsNothing) {
    const Coefficients k = measured("marble", 2);
    const double s = derived(k).sigma_tr;
    EXPECT_EQ(StandardDipole(k).at(80.01 / s), 0);
    EXPECT_GT(StandardDipole(k).at(79.9 / s), 0);
    EXPECT_EQ(BetterDipole(k).at(90 / s), 0);
}

TEST(Bssrdf, IsReciprocal) {
    Random random(3);
    const StandardDipole dipole(measured("skin1", 0));
    for (int i = 0; i < 1000; ++i) {
        const Vec3 n_i = random.direction(), n_o = random.direction();
        const double cos_i = dot(random.direction_above(n_i), n_i);
        const double cos_o = dot(random.direction_above(n_o), n_o);
        const Vec3 x_i = 3 * random.direction(), x_o = 3 * random.direction();
        const double there = bssrdf(dipole.at(length(x_o - x_i)), cos_i, cos_o, 1.3);
        const double back = bssrdf(dipole.at(length(x_i - x_o)), cos_o, cos_i, 1.3);
        EXPECT_GT(there, 0);
        EXPECT_NEAR(there / back, 1, 1e-12);
    }
    EXPECT_EQ(bssrdf(1, -0.1, 0.5, 1.3), 0);
    EXPECT_EQ(bssrdf(1, 0.5, -0.1, 1.3), 0);
}

// Flux of L_o = T(cos_o) exit_factor M_o through the hemisphere, M_o = 1. (T's moment by
// quadrature, F_dt by its fit.)
TEST(ExitFactor, LetsAllLightOutAndAsPrintedNot) {
    for (const double eta : {1.0, 1.1, 1.3, 1.33, 1.5, 2.5}) {
        const double flux = integral(0, 1, [&](double root) {
            const double mu = root * root;
            return 2 * root * 2 * pi * mu * transmittance(mu, eta);
        });
        EXPECT_NEAR(flux * exit_factor(ExitNormalisation::transmittance, eta), 1, 1e-3) << eta;
    }
    const auto lost = [](double eta) {
        return 1 - exit_factor(ExitNormalisation::jensen2001, eta) /
                       exit_factor(ExitNormalisation::transmittance, eta);
    };
    EXPECT_NEAR(lost(1.3), 0.06, 0.005);
    EXPECT_NEAR(lost(1.5), 0.09, 0.005);
    EXPECT_NEAR(exit_factor(ExitNormalisation::reflectance, 1.3) /
                    exit_factor(ExitNormalisation::transmittance, 1.3),
                2.1, 0.02);
}

TEST(NormalisedDiffusion, SamplesInvertTheDistribution) {
    for (const double d : {0.01, 1.0, 40.0}) {
        const NormalisedDiffusion profile(1, d);
        for (const double u : {0.0, 1e-12, 1e-6, 0.1, 0.3, 0.5, 0.9, 0.999, 1 - 1e-6, 1 - 1e-9}) {
            EXPECT_NEAR(profile.within(profile.sample(u)), u, 1e-12) << d << ' ' << u;
            EXPECT_GE(profile.sample(u), 0);
        }
        EXPECT_EQ(profile.sample(1), infinity);
    }
}

TEST(NormalisedDiffusion, IntegratesToItsAlbedo) {
    for (const double albedo : {0.1, 0.5, 0.9}) {
        const NormalisedDiffusion profile(albedo, 0.7);
        const auto at = [&](double r) { return profile.at(r); };
        EXPECT_NEAR(disc_integral(0.7, 80, at) / albedo, 1, 1e-9);
        EXPECT_NEAR(disc_integral(0.7, 0.5, at) / profile.within(0.5), 1, 1e-9);
        EXPECT_EQ(profile.total(), albedo);
        EXPECT_EQ(profile.within(infinity), albedo);
        EXPECT_EQ(profile.at(0), infinity);
    }
}

// Of a whole medium: its total is the dipole's, and it is about half as wide. It was fitted to path
// tracing, whose light leaves near where it entered; the dipole's sources lie a free path deep.
TEST(NormalisedDiffusion, OfAMediumIsHalfAsWideAsItsDipole) {
    for (const char* name : {"marble", "whole-milk", "skin1", "skim-milk"})
        for (int c = 0; c < 2; ++c) {
            const Coefficients k = measured(name, c);
            const StandardDipole dipole(k);
            const NormalisedDiffusion profile(k);
            EXPECT_EQ(profile.total(), dipole.total());
            double half = 0;  // radius of half of the dipole's light, in free paths
            const double path = derived(k).free_path;
            while (dipole.within(half * path) < dipole.total() / 2) half += 0.01;
            const double ratio = profile.sample(0.5) / (half * path);
            EXPECT_GT(ratio, 0.44) << name << ' ' << c;
            EXPECT_LT(ratio, 0.6) << name << ' ' << c;
        }
}

}  // namespace
}  // namespace relit::test
