#include "core/scatter/directional_dipole.h"

#include <gtest/gtest.h>

#include "core/scatter/dipole.h"
#include "core/scatter/fresnel.h"
#include "tests/core/scatter/support.h"

namespace relit::test {
namespace {

using namespace scatter;

Diffused between(const DirectionalDipole& dipole, const SurfacePoint& entry, Vec3 to_light,
                 const SurfacePoint& exit) {
    const Vec3 inward = refracted(to_light, entry.normal, dipole.eta);
    return diffused(dipole, ray_pair(entry, inward, exit, dipole.touching));
}

Vec3 from_the_right(double theta_deg) {
    return {std::sin(theta_deg * pi / 180), 0, std::cos(theta_deg * pi / 180)};
}

constexpr SurfacePoint origin{{0, 0, 0}, {0, 0, 1}};

// With x_v = x_i + 2 A d_e n* and w_v = w_12 - 2 (w_12 . n*) n* as vectors, as printed.
double s_d_by_vectors(const DirectionalDipole& m, const SurfacePoint& entry, Vec3 inward,
                      const SurfacePoint& exit) {
    const Vec3 x = exit.position - entry.position;
    const Vec3 star = normalized(entry.normal - (dot(entry.normal, x) / dot(x, x)) * x);
    const Vec3 x_v = entry.position + m.mirrored * star;
    const Vec3 w_v = inward - 2 * dot(inward, star) * star;
    const Vec3 from_v = exit.position - x_v;
    const double d_r =
        diffused(m, ray_pair(entry, inward, exit, m.touching)).d_r;  // by the reference numbers
    return ray_source(m, dot(x, inward), dot(inward, exit.normal), dot(x, exit.normal), d_r) -
           ray_source(m, dot(from_v, w_v), dot(w_v, exit.normal), dot(from_v, exit.normal),
                      length(from_v));
}

TEST(Diffused, ProductsOfThePairAreThoseOfTheVectors) {
    Random random(5);
    const DirectionalDipole dipole = directional_dipole(measured("skim-milk", 1));
    for (int i = 0; i < 1000; ++i) {
        const SurfacePoint entry{random.direction(), random.direction()};
        const SurfacePoint exit{random.direction(), random.direction()};
        const Vec3 inward = refracted(random.direction_above(entry.normal), entry.normal, 1.3);
        const double expected = s_d_by_vectors(dipole, entry, inward, exit);
        const Diffused value = diffused(dipole, ray_pair(entry, inward, exit, dipole.touching));
        EXPECT_NEAR(value.s_d, expected, 1e-9 * (std::abs(expected) + 1e-3)) << i;
    }
}

// phi = e^{-s d}/(4 pi D d) (1 + 3 D (1 + s d)/d^2 x.w), differentiated by steps.
TEST(RaySource, IsFluenceAndItsGradientThroughTheSurface) {
    Random random(7);
    for (const auto& [name, c] : {std::pair{"marble", 0}, {"skin1", 1}, {"ketchup", 2}}) {
        const Coefficients k = measured(name, c);
        const DirectionalDipole m = directional_dipole(k);
        const Derived d = derived(k);
        const auto phi = [&](Vec3 x, Vec3 w) {
            const double r = length(x), s = m.sigma_tr;
            return std::exp(-s * r) / (4 * pi * m.diffusion * r) *
                   (1 + 3 * m.diffusion * (1 + s * r) / (r * r) * dot(x, w));
        };
        for (int i = 0; i < 100; ++i) {
            const Vec3 x = random.between(0.5, 4) * d.free_path * random.direction();
            const Vec3 w = random.direction(), n = random.direction();
            const double h = 1e-3 * length(x);
            const double slope = (8 * (phi(x + h * n, w) - phi(x - h * n, w)) -
                                  (phi(x + 2 * h * n, w) - phi(x - 2 * h * n, w))) /
                                 (12 * h);
            const double fluence = m.c_phi * phi(x, w), flux = m.c_e * m.diffusion * slope;
            const double expected = (fluence - flux) / (4 * pi * d.c_phi_ext);
            const double size = (std::abs(fluence) + std::abs(flux)) / (4 * pi * d.c_phi_ext);
            EXPECT_NEAR(ray_source(m, dot(x, w), dot(w, n), dot(x, n), length(x)), expected,
                        1e-6 * size)
                << name << ' ' << i;
        }
    }
}

TEST(DirectionalDipole, HalfSpaceTotalsAreThoseOfTheSpecification) {
    struct Row {
        const char* name;
        int c;
        double directional, standard, better;
    };
    constexpr Row rows[] = {
        {"marble", 0, 1.020, .830, .835},
        {"marble", 2, .935, .753, .754},
        {"chocolate-milk-regular", 0, .903, .683, .683},
        {"chocolate-milk-regular", 2, .594, .410, .372},
        {"skim-milk", 1, 1.051, .813, .818},
        {"skin1", 1, .391, .227, .163},
    };
    for (const Row& row : rows) {
        SCOPED_TRACE(testing::Message() << row.name << ' ' << row.c);
        const Coefficients k = measured(row.name, row.c);
        EXPECT_NEAR(half_space_total(directional_dipole(k)) / row.directional, 1, 0.005);
        EXPECT_NEAR(StandardDipole(k).total(), row.standard, 6e-4);
        EXPECT_NEAR(BetterDipole(k).total(), row.better, 6e-4);
        const auto matched = directional_dipole(k, {.energy = DirectionalEnergy::matched});
        EXPECT_NEAR(half_space_total(matched), BetterDipole(k).total(), 1e-9);
    }
}

// Of light from theta, as half_space_total() is of light from above.
double oblique_total(const Coefficients& k, double theta_deg) {
    constexpr int azimuths = 64;
    const DirectionalDipole dipole = directional_dipole(k);
    const double path = derived(k).free_path;
    double sum = 0;
    for (int a = 0; a < azimuths; ++a) {
        const double phi = 2 * pi * (a + 0.5) / azimuths;
        sum += disc_integral(path, 40 / dipole.sigma_tr, [&](double r) {
            const SurfacePoint exit{{r * std::cos(phi), r * std::sin(phi), 0}, {0, 0, 1}};
            return std::max(0.0, between(dipole, origin, from_the_right(theta_deg), exit).s_d);
        });
    }
    return pi * diffuse_transmittance(k.eta) * sum / azimuths;
}

TEST(DirectionalDipole, ObliqueLightGivesLittleMoreInWhiteMediaAndMoreInOthers) {
    const auto rise = [](const char* name, int c) {
        const Coefficients k = measured(name, c);
        EXPECT_NEAR(oblique_total(k, 0) / half_space_total(directional_dipole(k)), 1, 1e-6);
        return oblique_total(k, 85) / oblique_total(k, 0);
    };
    EXPECT_NEAR(rise("marble", 0), 1.001, 5e-4);
    EXPECT_NEAR(rise("skim-milk", 1), 1.003, 5e-4);
    EXPECT_NEAR(rise("chocolate-milk-regular", 0), 1.02, 5e-3);
    EXPECT_GT(rise("skin1", 1), 1.1);
}

// The total by points on a grid of the plane, through bssrdf() itself.
TEST(DirectionalDipole, TotalIsTheSumOfTheBssrdfOverThePlane) {
    const Coefficients k = measured("skin1", 1);
    const DirectionalDipole dipole = directional_dipole(k);
    const double path = derived(k).free_path, step = path / 12;
    const Vec3 up{0, 0, 1};
    double sum = 0;
    for (int i = -200; i < 200; ++i)
        for (int j = -200; j < 200; ++j) {
            const SurfacePoint exit{{(i + 0.5) * step, (j + 0.5) * step, 0}, {0, 0, 1}};
            sum += bssrdf(dipole, origin, up, exit, up) * step * step;
        }
    const double t = transmittance(1, k.eta);
    EXPECT_NEAR(pi * diffuse_transmittance(k.eta) * sum / (t * t) / half_space_total(dipole), 1,
                0.005);
}

// A light on the right is refracted to the left, and so is what it leaves below.
TEST(DirectionalDipole, ReachesFurtherWhereTheRefractedRayPoints) {
    for (const auto& [name, c] : {std::pair{"marble", 0}, {"skin1", 1}, {"whole-milk", 2}}) {
        const Coefficients k = measured(name, c);
        const DirectionalDipole dipole = directional_dipole(k);
        const double path = derived(k).free_path;
        for (const double theta : {20.0, 45.0, 70.0, 85.0})
            for (double r = 0.2; r <= 3; r += 0.2) {
                const SurfacePoint left{{-r * path, 0, 0}, {0, 0, 1}};
                const SurfacePoint right{{r * path, 0, 0}, {0, 0, 1}};
                EXPECT_GT(between(dipole, origin, from_the_right(theta), left).s_d,
                          between(dipole, origin, from_the_right(theta), right).s_d)
                    << name << ' ' << theta << ' ' << r;
            }
    }
}

TEST(DirectionalDipole, DoesNotNoticeRotationsAndMirrors) {
    Random random(11);
    const DirectionalDipole dipole = directional_dipole(measured("marble", 1));
    for (int i = 0; i < 1000; ++i) {
        const SurfacePoint entry{random.direction(), random.direction()};
        const SurfacePoint exit{random.direction(), random.direction()};
        const Vec3 to_light = random.direction_above(entry.normal);
        const Turn turn = random_turn(random, i % 2 == 0);
        const SurfacePoint turned_entry{turn(entry.position), turn(entry.normal)};
        const SurfacePoint turned_exit{turn(exit.position), turn(exit.normal)};
        const double value = between(dipole, entry, to_light, exit).s_d;
        EXPECT_NEAR(between(dipole, turned_entry, turn(to_light), turned_exit).s_d, value,
                    1e-8 * (std::abs(value) + 1e-3))
            << i;
    }
}

TEST(DirectionalDipole, ScalesWithTheSquareOfTheUnit) {
    Random random(13);
    const Medium& medium = find_medium("chocolate-milk-regular")->medium;
    const DirectionalDipole one = directional_dipole(channel(medium, 1));
    const DirectionalDipole scaled = directional_dipole(channel(medium, 1, 80));
    for (int i = 0; i < 200; ++i) {
        const SurfacePoint entry{random.direction(), random.direction()};
        const SurfacePoint exit{random.direction(), random.direction()};
        const Vec3 to_light = random.direction_above(entry.normal);
        const double value = between(one, entry, to_light, exit).s_d;
        const double other = between(scaled, {(1.0 / 80) * entry.position, entry.normal}, to_light,
                                     {(1.0 / 80) * exit.position, exit.normal})
                                 .s_d;
        EXPECT_NEAR(other / 6400, value, 1e-9 * (std::abs(value) + 1e-3)) << i;
    }
}

// Points in each other's place, above and below one another, light along the surface and behind it.
TEST(DirectionalDipole, IsFiniteForEveryPair) {
    Random random(17);
    std::vector<DirectionalDipole> dipoles;
    for (const bool robust : {false, true})
        for (const Coefficients& k :
             {measured("marble", 0), measured("ketchup", 2), Coefficients{0, 1e4, 0.9, 1},
              Coefficients{1e4, 1e-6, 0, 2.5}, Coefficients{1e-6, 0, 0, 1.05}})
            dipoles.push_back(directional_dipole(k, {.robust = robust}));
    for (int i = 0; i < 1'000'000; ++i) {
        const DirectionalDipole& dipole = dipoles[i % dipoles.size()];
        SurfacePoint entry{random.direction(), random.direction()};
        SurfacePoint exit{random.direction(), random.direction()};
        const double reach = std::pow(10, random.between(-12, 3));
        switch (i / 16 % 8) {
            case 0:
                exit.position = entry.position;
                break;
            case 1:
                exit.position = entry.position + reach * entry.normal;
                break;
            case 2:
                exit.position = entry.position - reach * entry.normal;
                break;
            case 3:
                entry.normal = {1, 0, 0};
                exit.position = entry.position + Vec3{reach, 0, 0};
                break;
            default:
                exit.position = entry.position + reach * random.direction();
        }
        Vec3 to_light = random.direction(), to_viewer = random.direction();
        if (i % 5 == 0) to_light = normalized(cross(entry.normal, to_light) + 1e-9 * to_light);
        if (i % 7 == 0) exit.normal = normalized(cross(entry.normal, to_light));
        const double s_d = between(dipole, entry, to_light, exit).s_d;
        const double s = bssrdf(dipole, entry, to_light, exit, to_viewer);
        ASSERT_TRUE(std::isfinite(s_d)) << i;
        ASSERT_TRUE(std::isfinite(s) && s >= 0) << i;
        if (dot(to_light, entry.normal) <= 0 || dot(to_viewer, exit.normal) <= 0) {
            ASSERT_EQ(s, 0) << i;
        }
    }
}

TEST(DirectionalDipole, RobustChangesNothingOnFlatSurfacesAndBoundsRoughOnes) {
    for (const double eta : {1.16, 1.3, 1.5}) {
        Coefficients k = measured("skin1", 0);
        k.eta = eta;
        const DirectionalDipole plain = directional_dipole(k);
        const DirectionalDipole robust = directional_dipole(k, {.robust = true});
        for (const double theta : {0.0, 30.0, 60.0, 89.9})
            for (const double r : {0.0, 0.01, 0.3, 2.0}) {
                const SurfacePoint exit{{r, 0, 0}, {0, 0, 1}};
                EXPECT_EQ(between(robust, origin, from_the_right(theta), exit).s_d,
                          between(plain, origin, from_the_right(theta), exit).s_d)
                    << eta << ' ' << theta << ' ' << r;
            }
        // The exit's normal nearly along the ray: mu0 -> 0+.
        const Vec3 inward = refracted(from_the_right(60), {0, 0, 1}, eta);
        const Vec3 tangent = normalized(cross(inward, {0, 1, 0}));
        const SurfacePoint rough{{0, 0, 0}, normalized(tangent - 1e-4 * inward)};
        EXPECT_GT(std::abs(between(plain, origin, from_the_right(60), rough).s_d), 1e4);
        EXPECT_LT(std::abs(between(robust, origin, from_the_right(60), rough).s_d), 1e2);
    }
}

TEST(DirectionalDipole, SymmetrisedIsReciprocalAndAsPublishedIsNot) {
    Random random(19);
    const DirectionalDipole dipole = directional_dipole(measured("skim-milk", 0));
    double worst = 0;
    for (int i = 0; i < 200; ++i) {
        const SurfacePoint a{random.direction(), random.direction()};
        const SurfacePoint b{random.direction(), random.direction()};
        const Vec3 w_a = random.direction_above(a.normal), w_b = random.direction_above(b.normal);
        const double there = symmetric_bssrdf(dipole, a, w_a, b, w_b);
        EXPECT_NEAR(there, symmetric_bssrdf(dipole, b, w_b, a, w_a), 1e-12 * (1 + there));
        worst = std::max(worst, std::abs(bssrdf(dipole, a, w_a, b, w_b) - there) / (there + 1e-6));
    }
    EXPECT_GT(worst, 0.1);
}

}  // namespace
}  // namespace relit::test
