#include "core/transport/convolution.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/base/error.h"
#include "tests/support/transport.h"

namespace relit::test {
namespace {

Image convolved_with(const RadialKernel& kernel, const Image& flux) {
    return convolved(KernelSpectrum(kernel, flux.width, flux.height, executor()), flux, executor());
}

TEST(Convolution, OfAPlaneIsTheDoubleSum) {
    for (const int width : {1, 2, 45, 64})
        for (const int height : {1, 3, 50})
            for (const double mm_per_width : {5.0, 40.0, 1000.0}) {
                const auto surface = surface_of(width, height, [](int, int) { return 0.3; });
                const RadialKernel kernel = kernel_for(surface, dipoles("skin1", mm_per_width));
                const Image flux = uneven_flux(surface);
                const RelativeError error = relative_error(
                    convolved_with(kernel, flux).values, direct_sums(surface, flux, kernel).values);
                EXPECT_LE(error.rms, 0.005) << width << " x " << height << ", " << mm_per_width;
            }
}

TEST(Convolution, CommutesWithTurnsAndMirrorImagesOfTheMap) {
    const auto surface = surface_of(40, 40, [](int, int) { return 0.0; });
    const RadialKernel kernel = kernel_for(surface, dipoles("marble", 40));
    const Image flux = uneven_flux(surface), sums = convolved_with(kernel, flux);
    for (Image (*const moved)(const Image&) : {turned, mirrored}) {
        const Image moved_before = convolved_with(kernel, moved(flux));
        EXPECT_LE(relative_error(moved_before.values, moved(sums).values).max, 1e-4);
    }
}

TEST(Convolution, CommutesWithTranslations) {
    const auto surface = surface_of(64, 64, [](int, int) { return 0.0; });
    const RadialKernel kernel = kernel_for(surface, dipoles("marble", 80));
    Image at_left(64, 64, 3), at_right(64, 64, 3);
    at_left.at(20, 30, 1) = at_right.at(31, 23, 1) = 1;
    const Image left = convolved_with(kernel, at_left), right = convolved_with(kernel, at_right);
    for (int j = 20; j < 40; ++j)
        for (int i = 10; i < 40; ++i)
            EXPECT_NEAR(right.at(i + 11, j - 7, 1), left.at(i, j, 1), 2e-5 * left.at(20, 30, 1));
}

TEST(Convolution, IsTheSameForAnyNumberOfThreads) {
    const auto surface = surface_of(61, 47, [](int, int) { return 0.0; });
    const RadialKernel kernel = kernel_for(surface, dipoles("marble", 80));
    const Image flux = uneven_flux(surface);
    const Image of_two = convolved_with(kernel, flux);
    for (const int threads : {1, 3}) {
        const Executor other(threads);
        const KernelSpectrum spectrum(kernel, 61, 47, other);
        EXPECT_EQ(convolved(spectrum, flux, other).values, of_two.values) << threads;
    }
}

TEST(Convolution, PadsToSizesOfSmallPrimes) {
    EXPECT_EQ(transform_size(1), 2);
    EXPECT_EQ(transform_size(7), 8);
    EXPECT_EQ(transform_size(2047), 2048);
    EXPECT_EQ(transform_size(1025), 1080);
    for (int n = 1; n < 3000; ++n) EXPECT_LE(transform_size(n), 1.2 * n + 2);
}

TEST(Convolution, IsGivenUpWhenItsRenderIsCancelled) {
    const auto surface = surface_of(32, 32, [](int, int) { return 0.0; });
    const RadialKernel kernel = kernel_for(surface, dipoles("marble", 80));
    std::stop_source source;
    source.request_stop();
    EXPECT_THROW(KernelSpectrum(kernel, 32, 32, executor(), source.get_token()), Error);
    const KernelSpectrum spectrum(kernel, 32, 32, executor());
    EXPECT_THROW((void)convolved(spectrum, uneven_flux(surface), executor(), source.get_token()),
                 Error);
}

}  // namespace
}  // namespace relit::test
