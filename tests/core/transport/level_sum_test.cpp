#include "core/transport/level_sum.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/base/error.h"
#include "tests/support/transport.h"

namespace relit::test {
namespace {

Image level_sums(const TransportSurface& surface, const RadialKernel& kernel, const Image& flux,
                 LevelSum::Settings settings, Simd simd = best_simd()) {
    return LevelSum(surface, kernel, settings, executor(), {}, simd).sum(flux, executor(), {});
}

// Without what a texel's own area adds, which is none of this sum's business.
Image direct_sums_of_cells(const TransportSurface& surface, const RadialKernel& kernel,
                           const Image& flux) {
    Image sums = direct_sums(surface, flux, kernel);
    for (int j = 0; j < flux.height; ++j)
        for (int i = 0; i < flux.width; ++i) {
            const float area = surface.area.at(i, j);
            for (int c = 0; c < flux.channels && area > 0; ++c)
                sums.at(i, j, c) -= float(kernel.at_own_place(c, area)) * flux.at(i, j, c);
        }
    return sums;
}

TEST(LevelSum, ComesNearerToTheDoubleSumWithItsRatio) {
    const TransportSurface surface = surface_of(hills(72, 60), 0.15);
    const RadialKernel kernel = kernel_for(surface, dipoles("marble", 30));
    const Image flux = uneven_flux(surface);
    const Image exact = direct_sums_of_cells(surface, kernel, flux);
    const struct {
        double ratio, rms, max;
    } bounds[] = {{3, 0.004, 0.02}, {4, 0.0015, 0.008}, {6, 0.0004, 0.002}, {8, 0.0002, 0.001}};
    for (const auto& bound : bounds) {
        const RelativeError error = relative_error(
            level_sums(surface, kernel, flux, {.ratio = bound.ratio}).values, exact.values);
        EXPECT_LE(error.rms, bound.rms) << bound.ratio;
        EXPECT_LE(error.max, bound.max) << bound.ratio;
    }
}

TEST(LevelSum, GathersTexelsMuchFinerThanTheKernel) {
    const TransportSurface surface = surface_of(hills(72, 72), 0.1);
    const RadialKernel kernel = kernel_for(surface, dipoles("marble", 3));
    ASSERT_GT(kernel.core() / kernel.spacing(), 8);
    const Image flux = uneven_flux(surface);
    const Image exact = direct_sums_of_cells(surface, kernel, flux);
    for (const int first_level : {1, 2}) {
        const RelativeError error = relative_error(
            level_sums(surface, kernel, flux, {4, first_level}).values, exact.values);
        EXPECT_LE(error.rms, 0.004) << first_level;
    }
}

TEST(LevelSum, TakesMapsOfAnySizeAndShape) {
    for (const int width : {1, 2, 3, 17, 40})
        for (const int height : {1, 2, 5, 33}) {
            const TransportSurface surface = surface_of(
                width, height, [&](int i, int j) { return 0.02 * std::sin(i + 2.0 * j) / width; });
            const RadialKernel kernel = kernel_for(surface, dipoles("skin2", 3 * width));
            const Image flux = uneven_flux(surface);
            const RelativeError error =
                relative_error(level_sums(surface, kernel, flux, {4}).values,
                               direct_sums_of_cells(surface, kernel, flux).values);
            EXPECT_LE(error.rms, 0.003) << width << " x " << height;
        }
}

TEST(LevelSum, LeavesOutWhatIsMasked) {
    TransportSurface surface = surface_of(hills(70, 60), 0.1);
    for (int j = 0; j < 60; ++j)
        for (int i = 0; i < 70; ++i)
            if (std::hypot(i - 30, j - 20) < 15 || i > 60) {
                surface.area.at(i, j) = 0;
                surface.z.at(i, j) = 9;  // of no meaning
            }
    const RadialKernel kernel = kernel_for(surface, dipoles("marble", 40));
    EXPECT_LE(surface.relief(), 0.1);
    Image flux = uneven_flux(surface);
    const Image exact = direct_sums_of_cells(surface, kernel, flux);
    const RelativeError error =
        relative_error(level_sums(surface, kernel, flux, {4}).values, exact.values);
    EXPECT_LE(error.rms, 0.003);
    for (int j = 0; j < 60; ++j)
        for (int i = 0; i < 70; ++i)
            if (surface.area.at(i, j) == 0) flux.at(i, j, 0) = NAN;  // is not read
    const Image with_nan = level_sums(surface, kernel, flux, {4});
    EXPECT_EQ(with_nan.at(2, 2), level_sums(surface, kernel, uneven_flux(surface), {4}).at(2, 2));
    EXPECT_EQ(with_nan.at(30, 20), 0);
}

TEST(LevelSum, TellsCliffsFromSlopes) {
    const auto cliffs_of = [](const TransportSurface& surface) {
        const RadialKernel kernel = kernel_for(surface, dipoles("marble", 40));
        return LevelSum(surface, kernel, {4}, executor(), {}, best_simd()).cliffs();
    };
    EXPECT_EQ(cliffs_of(surface_of(hills(64, 64), 0.1)), 0);
    EXPECT_GT(cliffs_of(surface_of(64, 64, [](int i, int) { return i < 30 ? 0.0 : 0.4; })), 0.01);
}

// A block that stands on the ground.
TEST(LevelSum, TakenApartAtCliffsIsTheDoubleSumBesideThemToo) {
    const TransportSurface surface = surface_of(80, 64, [](int i, int j) {
        return i > 20 && i < 50 && j > 15 && j < 40 ? 0.3 + 0.001 * i : 0.05 * std::sin(0.1 * j);
    });
    const RadialKernel kernel = kernel_for(surface, dipoles("marble", 40));
    const Image flux = uneven_flux(surface);
    const Image exact = direct_sums_of_cells(surface, kernel, flux);
    const auto error = [&](int sheets) {
        const LevelSum::Settings settings{.ratio = 4, .sheets = sheets};
        return relative_error(level_sums(surface, kernel, flux, settings).values, exact.values);
    };
    EXPECT_GT(error(1).rms, 0.02);
    EXPECT_LE(error(2).rms, 0.003);
    EXPECT_LE(error(2).max, 0.02);
    EXPECT_LE(error(3).rms, 0.003);
    const Image portable = level_sums(surface, kernel, flux, {4, 0, 2}, Simd::portable);
    for (const Simd simd : available_simd())
        EXPECT_EQ(level_sums(surface, kernel, flux, {4, 0, 2}, simd).values, portable.values);
}

TEST(LevelSum, IsTheSameOnEveryInstructionSetAndForAnyNumberOfThreads) {
    const TransportSurface surface = surface_of(hills(61, 50), 0.1);
    const Image flux = uneven_flux(surface), grey = uneven_flux(surface, 1);
    const RadialKernel kernel = kernel_for(surface, dipoles("marble", 40));
    const RadialKernel of_one = kernel_for(surface, {highlight_profile(20)});
    const Image portable = level_sums(surface, kernel, flux, {4}, Simd::portable);
    const Image grey_portable = level_sums(surface, of_one, grey, {4}, Simd::portable);
    for (const Simd simd : available_simd()) {
        EXPECT_EQ(level_sums(surface, kernel, flux, {4}, simd).values, portable.values)
            << name_of(simd);
        EXPECT_EQ(level_sums(surface, of_one, grey, {4}, simd).values, grey_portable.values)
            << name_of(simd);
    }
    for (const int threads : {1, 3}) {
        const Executor other(threads);
        const LevelSum sum(surface, kernel, {4}, other, {}, best_simd());
        EXPECT_EQ(sum.sum(flux, other, {}).values, portable.values) << threads;
    }
}

// Its memory is used again.
TEST(LevelSum, GivesTheSameForTheSameFluxWhateverCameBetween) {
    const TransportSurface surface = surface_of(hills(61, 50), 0.1);
    const Image flux = uneven_flux(surface), black(61, 50, 3);
    const RadialKernel kernel = kernel_for(surface, dipoles("marble", 40));
    const LevelSum sum(surface, kernel, {4}, executor(), {}, best_simd());
    const Image before = sum.sum(flux, executor(), {});
    for (const float value : sum.sum(black, executor(), {}).values) EXPECT_EQ(value, 0);
    EXPECT_EQ(sum.sum(flux, executor(), {}).values, before.values);
}

TEST(LevelSum, IsGivenUpWhenItsRenderIsCancelled) {
    const TransportSurface surface = surface_of(hills(61, 50), 0.1);
    const RadialKernel kernel = kernel_for(surface, dipoles("marble", 40));
    std::stop_source source;
    source.request_stop();
    EXPECT_THROW(LevelSum(surface, kernel, {4}, executor(), source.get_token(), best_simd()),
                 Error);
    const LevelSum sum(surface, kernel, {4}, executor(), {}, best_simd());
    EXPECT_THROW((void)sum.sum(uneven_flux(surface), executor(), source.get_token()), Error);
    EXPECT_GT(sum.sum(uneven_flux(surface), executor(), {}).at(30, 30), 0);
}

}  // namespace
}  // namespace relit::test
