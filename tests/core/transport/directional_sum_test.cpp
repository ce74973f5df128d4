// The directional dipole summed over height fields: against double sums of core/scatter, as they are
// where texels are fine and over parts of cells where not, and against totals of half spaces.
#include "core/transport/directional_sum.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <utility>

#include "core/base/angle.h"
#include "core/base/error.h"
#include "core/scatter/fresnel.h"
#include "tests/support/maps.h"

namespace relit::test {
namespace {

using scatter::DirectionalDipole;
using Dipoles = std::array<DirectionalDipole, 3>;

struct Relief {
    TransportSurface surface;
    Image slopes, shading_slopes;

    [[nodiscard]] Vec3 normal(int i, int j) const {
        return normalized({-shading_slopes.at(i, j, 0), -shading_slopes.at(i, j, 1), 1});
    }
    [[nodiscard]] Vec3 position(int i, int j) const {
        const double texel = surface.spacing();
        return {(i + 0.5) * texel, (surface.height() - 0.5 - j) * texel, surface.z.at(i, j)};
    }
};

Relief relief_of(int width, int height, const std::function<double(double, double)>& z) {
    Relief r{{Image(width, height, 1), Image(width, height, 1)}, Image(width, height, 2), {}};
    const double texel = 1.0 / width;
    for (int j = 0; j < height; ++j)
        for (int i = 0; i < width; ++i) {
            const double x = (i + 0.5) * texel, y = (height - 0.5 - j) * texel;
            const double right = (z(x + texel, y) - z(x - texel, y)) / (2 * texel);
            const double up = (z(x, y + texel) - z(x, y - texel)) / (2 * texel);
            r.surface.z.at(i, j) = float(z(x, y));
            r.surface.area.at(i, j) = float(texel * texel * std::hypot(1, right, up));
            r.slopes.at(i, j, 0) = float(right);
            r.slopes.at(i, j, 1) = float(up);
        }
    r.shading_slopes = r.slopes;
    return r;
}

double plane(double, double) { return 0.3; }
double bumps(double x, double y) { return 0.3 + 0.08 * std::sin(9 * x) * std::cos(7 * y); }
double rough(double x, double y) {
    return bumps(x, y) + 0.01 * std::sin(90 * x) * std::sin(80 * y);
}

Dipoles dipoles_of(const char* medium, double mm_per_width) {
    Dipoles d;
    for (int c = 0; c < 3; ++c)
        d[c] = scatter::directional_dipole(
            channel(scatter::find_medium(medium)->medium, c, mm_per_width), {.robust = true});
    return d;
}

struct Light {
    Image flux, inward;
};

// Parallel lights without shadows; each colour has a little less than the one before.
Light lit(const Relief& relief, std::initializer_list<Vec3> lights, double eta) {
    const int width = relief.surface.width(), height = relief.surface.height();
    Light light{Image(width, height, 3), Image(width, height, 3)};
    for (int j = 0; j < height; ++j)
        for (int i = 0; i < width; ++i) {
            double sum = 0;
            Vec3 way;
            for (const Vec3& to_light : lights) {
                const double cosine = dot(to_light, relief.normal(i, j));
                const double enters = std::max(0.0, cosine) * scatter::transmittance(cosine, eta);
                sum += enters;
                way = way + enters * scatter::refracted(to_light, relief.normal(i, j), eta);
            }
            if (!(sum > 0)) continue;
            const double mean[] = {way.x / sum, way.y / sum, way.z / sum};
            for (int c = 0; c < 3; ++c) {
                light.flux.at(i, j, c) = float(sum * (1 - 0.2 * c)) * relief.surface.area.at(i, j);
                light.inward.at(i, j, c) = float(mean[c]);
            }
        }
    return light;
}

Image summed(const Relief& relief, const Light& light, const Dipoles& dipoles,
             TransportAccuracy accuracy = TransportAccuracy::final, int threads = 2,
             Simd simd = best_simd()) {
    const Executor with(threads);
    return DirectionalSum(relief.surface, relief.slopes, relief.shading_slopes, dipoles, accuracy,
                          with, {}, simd)
        .sum(light.flux, light.inward, with);
}

// Of one colour at a texel: max(0, S_d) is averaged over parts x parts midpoints of near cells.
double direct_sum(const Relief& relief, const Light& light, const DirectionalDipole& dipole, int c,
                  int p, int q, int parts) {
    const scatter::SurfacePoint exit{relief.position(p, q), relief.normal(p, q)};
    const double texel = relief.surface.spacing();
    double sum = 0;
    for (int j = 0; j < light.flux.height; ++j)
        for (int i = 0; i < light.flux.width; ++i) {
            const double flux = light.flux.at(i, j, c);
            if (flux == 0) continue;
            const Vec3 inward{light.inward.at(i, j, 0), light.inward.at(i, j, 1),
                              light.inward.at(i, j, 2)};
            const int n = std::hypot(i - p, j - q) < 6 ? parts : 1;
            double mean = 0;
            for (int k = 0; k < n * n; ++k) {
                const double right = texel * ((k % n + 0.5) / n - 0.5);
                const double up = texel * ((k / n + 0.5) / n - 0.5);
                const Vec3 part{right, up,
                                right * relief.slopes.at(i, j, 0) + up * relief.slopes.at(i, j, 1)};
                const scatter::SurfacePoint entry{relief.position(i, j) + part,
                                                  relief.normal(i, j)};
                mean += std::max(
                    0.0, diffused(dipole, ray_pair(entry, inward, exit, dipole.touching)).s_d);
            }
            sum += flux * mean / (n * n);
        }
    return sum;
}

// Relative RMS over every seventh texel, all colours.
double error(const Relief& relief, const Light& light, const Dipoles& dipoles, const Image& found,
             int parts) {
    double errors = 0, squares = 0;
    for (int k = 3; k < found.width * found.height; k += 7 * 7)
        for (int c = 0; c < 3; ++c) {
            const int i = k % found.width, j = k / found.width;
            const double exact = direct_sum(relief, light, dipoles[c], c, i, j, parts);
            errors += std::pow(found.at(i, j, c) - exact, 2);
            squares += exact * exact;
        }
    return std::sqrt(errors / squares);
}

TEST(DirectionalSum, IsThePlainDoubleSumWhereTexelsAreFarFinerThanAFreePath) {
    for (const char* medium : {"marble", "skin1"}) {
        const double eta = scatter::find_medium(medium)->medium.eta;
        const Dipoles dipoles = dipoles_of(medium, 1.2);
        for (const auto& [z, bound] : {std::pair(&bumps, 0.005), std::pair(&rough, 0.01)}) {
            const Relief relief = relief_of(56, 48, z);
            const Light light = lit(relief, {direction_from(315, 25)}, eta);
            EXPECT_LT(error(relief, light, dipoles, summed(relief, light, dipoles), 1), bound)
                << medium;
        }
    }
}

// Cells of a twentieth to twice a free path; the plain sum would be out by factors.
TEST(DirectionalSum, IsTheDoubleSumOverPartsOfCellsElsewhere) {
    for (const char* medium : {"marble", "skin1", "chocolate-milk-regular"}) {
        const double eta = scatter::find_medium(medium)->medium.eta;
        for (const double mm : {6.0, 25.0, 60.0}) {
            const Dipoles dipoles = dipoles_of(medium, mm);
            const Relief relief = relief_of(56, 48, bumps);
            const Light light = lit(relief, {direction_from(100, 30)}, eta);
            EXPECT_LT(error(relief, light, dipoles, summed(relief, light, dipoles), 16), 0.004)
                << medium << ' ' << mm;
        }
    }
}

// Cells 2.6 times as long as wide.
TEST(DirectionalSum, IsTheDoubleSumOnSteepSlopesOfCellsAsWideAsAFreePath) {
    const Relief relief = relief_of(64, 64, [](double x, double y) {
        return 0.3 + 0.12 * std::sin(20 * x) * std::cos(18 * y);
    });
    for (const double mm : {25.0, 60.0}) {
        const Dipoles dipoles = dipoles_of("skin1", mm);
        const Light light = lit(relief, {direction_from(315, 25)}, 1.3);
        EXPECT_LT(error(relief, light, dipoles, summed(relief, light, dipoles), 16), 0.008) << mm;
    }
}

// A relief thinner than a free path, where normals matter most.
TEST(DirectionalSum, IsCloserWhenAskedToBeExact) {
    const Dipoles dipoles = dipoles_of("skin1", 1.2);
    const Relief relief = relief_of(56, 48, rough);
    const Light light = lit(relief, {direction_from(315, 25)}, 1.3);
    const Image exact = summed(relief, light, dipoles, TransportAccuracy::exact);
    EXPECT_LT(error(relief, light, dipoles, exact, 1),
              0.5 * error(relief, light, dipoles, summed(relief, light, dipoles), 1));
}

TEST(DirectionalSum, TakesNormalsFromABumpMapAndPlacesFromTheSurface) {
    const Dipoles dipoles = dipoles_of("marble", 25);
    Relief relief = relief_of(56, 48, bumps);
    for (int j = 0; j < 48; ++j)
        for (int i = 0; i < 56; ++i)
            relief.shading_slopes.at(i, j) += 0.5f * float(std::sin(1.1 * i));
    const Light light = lit(relief, {direction_from(100, 30)}, 1.5);
    const Image sum = summed(relief, light, dipoles);
    EXPECT_LT(error(relief, light, dipoles, sum, 12), 0.01);
    relief.shading_slopes = relief.slopes;
    EXPECT_GT(error(relief, light, dipoles, sum, 12), 0.03);
}

// By rings about the middle of a square of side 1.
double total_over_square(const DirectionalDipole& dipole, Vec3 inward) {
    constexpr int angles = 96, rings = 6;
    double sum = 0;
    for (double from = 0, to = dipole.diffusion / 16; from < 0.71; from = to, to *= 1.4)
        for (int k = 0; k < angles * rings; ++k) {
            const double r = from + (to - from) * (k / angles + 0.5) / rings;
            const double angle = 2 * std::numbers::pi * (k % angles + 0.5) / angles;
            const double x = r * std::cos(angle), y = r * std::sin(angle);
            if (std::abs(x) > 0.5 || std::abs(y) > 0.5) continue;
            const scatter::RayPair pair{.squared_distance = r * r,
                                        .along = x * inward.x + y * inward.y,
                                        .facing = inward.z,
                                        .down = inward.z,
                                        .agreement = 1};
            sum += std::max(0.0, diffused(dipole, pair).s_d) * 2 * std::numbers::pi / angles * r *
                   (to - from) / rings;
        }
    return sum;
}

TEST(DirectionalSum, KeepsTheEnergyOfAPlaneForFineAndCoarseTexels) {
    for (const char* medium : {"marble", "skin1"}) {
        const scatter::Medium m = scatter::find_medium(medium)->medium;
        const double free_path = derived(channel(m, 1)).free_path;
        for (const double texel_in_free_paths : {0.25, 1.0, 3.0, 30.0, 1000.0})
            for (const double elevation : {90.0, 15.0}) {
                const Relief relief = relief_of(65, 65, plane);
                const Dipoles dipoles = dipoles_of(medium, 65 * texel_in_free_paths * free_path);
                const Vec3 to_light = direction_from(70, elevation);
                const Light light = lit(relief, {to_light}, m.eta);
                const double expected =
                    total_over_square(dipoles[1], scatter::refracted(to_light, {0, 0, 1}, m.eta));
                for (const auto accuracy : {TransportAccuracy::final, TransportAccuracy::preview})
                    EXPECT_NEAR(summed(relief, light, dipoles, accuracy).at(32, 32, 1) /
                                    (light.flux.at(32, 32, 1) * 65 * 65 * expected),
                                1, accuracy == TransportAccuracy::final ? 0.01 : 0.05)
                        << medium << ' ' << texel_in_free_paths << ' ' << elevation << ' '
                        << int(accuracy);
            }
    }
}

TEST(DirectionalSum, OfAWidePlaneIsTheHalfSpaceTotal) {
    const double eta = scatter::find_medium("chocolate-milk-regular")->medium.eta;
    const Relief relief = relief_of(48, 48, plane);
    const Dipoles dipoles = dipoles_of("chocolate-milk-regular", 4000);
    const Light light = lit(relief, {{0, 0, 1}}, eta);
    const Image sum = summed(relief, light, dipoles);
    for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(std::numbers::pi * scatter::diffuse_transmittance(eta) * sum.at(24, 24, c) /
                        (light.flux.at(24, 24, c) * 48 * 48),
                    half_space_total(dipoles[c]), 0.005);
}

TEST(DirectionalSum, ReachesFartherWhereTheLightGoes) {
    const Relief relief = relief_of(49, 49, plane);
    const Dipoles dipoles = dipoles_of("skin1", 10);
    Light spot = lit(relief, {direction_from(90, 20)}, 1.3);  // from the right
    for (int j = 0; j < 49; ++j)
        for (int i = 0; i < 49; ++i)
            for (int c = 0; c < 3; ++c)
                if (i != 24 || j != 24) spot.flux.at(i, j, c) = 0;
    const Image sum = summed(relief, spot, dipoles);
    for (const int away : {2, 4, 8})
        EXPECT_GT(sum.at(24 - away, 24), 1.05f * sum.at(24 + away, 24));
    EXPECT_NEAR(sum.at(24, 20) / sum.at(24, 28), 1, 1e-5);
}

TEST(DirectionalSum, OfSeveralLightsIsNearTheSumOfEach) {
    const double eta = scatter::find_medium("marble")->medium.eta;
    const Relief relief = relief_of(64, 64, bumps);
    const Dipoles dipoles = dipoles_of("marble", 40);
    const Vec3 a = direction_from(0, 60), b = direction_from(120, 40), c = direction_from(240, 25);
    Image expected(64, 64, 3);
    for (const Vec3& light : {a, b, c}) {
        const Image one = summed(relief, lit(relief, {light}, eta), dipoles);
        for (std::size_t k = 0; k < one.values.size(); ++k) expected.values[k] += one.values[k];
    }
    const Image all = summed(relief, lit(relief, {a, b, c}, eta), dipoles);
    double errors = 0, squares = 0;
    for (std::size_t k = 0; k < all.values.size(); ++k) {
        errors += std::pow(double(all.values[k]) - expected.values[k], 2);
        squares += std::pow(double(expected.values[k]), 2);
    }
    EXPECT_LT(std::sqrt(errors / squares), 0.005);
}

TEST(DirectionalSum, OfAPreviewIsNearTheFinalOne) {
    const double eta = scatter::find_medium("marble")->medium.eta;
    const Relief relief = relief_of(250, 190, bumps);
    const Dipoles dipoles = dipoles_of("marble", 60);
    const Light light = lit(relief, {direction_from(315, 20)}, eta);
    const Image sum = summed(relief, light, dipoles);
    const Image preview = summed(relief, light, dipoles, TransportAccuracy::preview);
    double errors = 0, squares = 0;
    for (std::size_t k = 0; k < sum.values.size(); ++k) {
        errors += std::pow(double(sum.values[k]) - preview.values[k], 2);
        squares += std::pow(double(sum.values[k]), 2);
    }
    EXPECT_LT(std::sqrt(errors / squares), 0.03);
}

// The octree opens other nodes for the next square of 8 x 8 texels.
TEST(DirectionalSum, StepsByLittleFromSquareToSquare) {
    const Relief relief = relief_of(96, 96, bumps);
    const Light light = lit(relief, {direction_from(315, 25)}, 1.5);
    const Image sum = summed(relief, light, dipoles_of("marble", 30));
    double steps = 0;
    int count = 0;
    for (int j = 0; j < 96; ++j)
        for (int i = 8; i < 90; i += 8, ++count) {
            const double a = sum.at(i - 2, j), b = sum.at(i - 1, j), c = sum.at(i, j);
            const double step = std::abs(c - b - (b - a + sum.at(i + 1, j) - c) / 2) / c;
            EXPECT_LT(step, 0.02) << i << ' ' << j;
            steps += step;
        }
    EXPECT_LT(steps / count, 0.002);
}

// A hole, and light everywhere but in one corner.
struct Holed {
    Relief relief = relief_of(150, 77, rough);
    Dipoles dipoles = dipoles_of("marble", 60);
    Light light;

    Holed() {
        for (int j = 20; j < 45; ++j)
            for (int i = 30; i < 70; ++i) relief.surface.area.at(i, j) = 0;
        light = lit(relief, {direction_from(200, 35)}, 1.5);
        for (int j = 0; j < 30; ++j)
            for (int i = 0; i < 30; ++i) light.flux.at(i, j) = 0;
    }
};

TEST(DirectionalSum, IsTheSameForAnyThreadsAndInstructionSet) {
    const Holed holed;
    for (const auto accuracy : {TransportAccuracy::final, TransportAccuracy::preview}) {
        const Image expected = summed(holed.relief, holed.light, holed.dipoles, accuracy, 1);
        for (const Simd simd : available_simd())
            EXPECT_EQ(summed(holed.relief, holed.light, holed.dipoles, accuracy, 3, simd).values,
                      expected.values)
                << name_of(simd) << ' ' << int(accuracy);
    }
}

TEST(DirectionalSum, LeavesOutWhatIsNotThere) {
    Holed holed;
    const Image before = summed(holed.relief, holed.light, holed.dipoles);
    for (int j = 20; j < 45; ++j)
        for (int i = 30; i < 70; ++i) {
            EXPECT_EQ(before.at(i, j), 0);
            holed.relief.surface.z.at(i, j) = 0.9f;  // neither as a place
            holed.light.flux.at(i, j, 1) = 7;        // nor as a light
        }
    EXPECT_EQ(summed(holed.relief, holed.light, holed.dipoles).values, before.values);
    for (const auto accuracy : {TransportAccuracy::final, TransportAccuracy::preview}) {
        const Image sum = summed(holed.relief, holed.light, holed.dipoles, accuracy);
        EXPECT_EQ(sum.at(50, 30, 2), 0);
        for (const float v : sum.values) EXPECT_TRUE(v >= 0 && std::isfinite(v));
    }
}

TEST(DirectionalSum, OfNoLightIsNothing) {
    const Relief relief = relief_of(40, 33, rough);
    const Dipoles dipoles = dipoles_of("skin1", 30);
    for (const auto accuracy : {TransportAccuracy::final, TransportAccuracy::preview})
        for (const double elevation : {-20.0, -90.0})
            for (const float v :
                 summed(relief, lit(relief_of(40, 33, plane), {direction_from(0, elevation)}, 1.3),
                        dipoles, accuracy)
                     .values)
                EXPECT_EQ(v, 0);
}

TEST(DirectionalSum, IsFiniteForTheSmallestMapsAndMediaAtTheEdgesOfTheirRanges) {
    for (const double sigma : {1e-6, 1e4})
        for (const double mm : {1e-3, 1e6})
            for (const int size : {1, 2, 40}) {
                Dipoles dipoles;
                for (int c = 0; c < 3; ++c)
                    dipoles[c] =
                        scatter::directional_dipole(scatter::channel({.sigma_a = {sigma, 0, 1e4},
                                                                      .sigma_s = {sigma, sigma, 0},
                                                                      .g = {0.99, -0.99, 0},
                                                                      .eta = 1},
                                                                     c, mm),
                                                    {.robust = true});
                const Relief relief = relief_of(size, 1 + size / 2, rough);
                const Light light = lit(relief, {direction_from(30, 5)}, 1);
                for (const auto accuracy : {TransportAccuracy::final, TransportAccuracy::preview})
                    for (const float v : summed(relief, light, dipoles, accuracy).values)
                        EXPECT_TRUE(std::isfinite(v) && v >= 0)
                            << sigma << ' ' << mm << ' ' << size;
            }
}

TEST(DirectionalSum, StopsWhenAsked) {
    std::stop_source stop;
    stop.request_stop();
    const Relief relief = relief_of(64, 64, bumps);
    const Dipoles dipoles = dipoles_of("marble", 60);
    EXPECT_THROW(DirectionalSum(relief.surface, relief.slopes, relief.shading_slopes, dipoles,
                                TransportAccuracy::final, executor(), stop.get_token()),
                 Error);
    const DirectionalSum sum(relief.surface, relief.slopes, relief.shading_slopes, dipoles,
                             TransportAccuracy::preview, executor());
    const Light light = lit(relief, {direction_from(30, 40)}, 1.5);
    EXPECT_THROW((void)sum.sum(light.flux, light.inward, executor(), stop.get_token()), Error);
}

}  // namespace
}  // namespace relit::test
