#include "core/transport/transport.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/base/error.h"
#include "tests/support/transport.h"

namespace relit::test {
namespace {

constexpr TransportAccuracy accuracies[] = {TransportAccuracy::preview, TransportAccuracy::final,
                                            TransportAccuracy::exact};

struct Found {
    Image sums;
    TransportPath path;
};

Found found(const TransportSurface& surface, const Image& flux, const RadialKernel& kernel,
            TransportAccuracy accuracy) {
    const Transport transport(std::make_shared<TransportSurface>(surface),
                              std::make_shared<RadialKernel>(kernel), accuracy, executor());
    return {transport.sum(flux, executor()), transport.path()};
}

// A dome on a plate: smooth, but for the edge around it.
TransportSurface dome(int size, double edge) {
    return surface_of(size, size, [&](int i, int j) {
        const double d = std::hypot(i + 0.5 - size / 2.0, j + 0.5 - size / 2.0) / size;
        return d < 0.3 ? edge + 0.3 * std::sqrt(0.09 - d * d) : 0.0;
    });
}

TransportSurface noise(int size, double relief) {
    Random random(9);
    return surface_of(size, size, [&](int, int) { return relief * random(); });
}

TEST(Transport, OfAFinalPictureIsTheDoubleSumWithinHalfAPerCent) {
    const struct {
        const char* name;
        TransportSurface surface;
        TransportPath path;
    } cases[] = {
        {"plane", surface_of(96, 96, [](int i, int) { return 3e-4 * i; }),
         TransportPath::convolution},
        {"hills", surface_of(hills(96, 96), 0.15), TransportPath::levels},
        {"other hills", surface_of(hills(96, 96, 2), 0.1), TransportPath::levels},
        {"dome with an edge", dome(96, 0.15), TransportPath::levels},
        {"noise", noise(96, 0.3), TransportPath::tree},
    };
    for (const auto& c : cases)
        for (const char* medium : {"marble", "skin1"}) {
            const RadialKernel kernel = kernel_for(c.surface, dipoles(medium, 20));
            const Image flux = uneven_flux(c.surface);
            const Found all = found(c.surface, flux, kernel, TransportAccuracy::final);
            const RelativeError error =
                error_at_random_texels(c.surface, flux, kernel, all.sums, 500);
            EXPECT_EQ(name_of(all.path), name_of(c.path)) << c.name << ", " << medium;
            EXPECT_LE(error.rms, 0.005) << c.name << ", " << medium;
        }
}

TEST(Transport, OfALargeFinalPictureIsTheDoubleSumWithinHalfAPerCent) {
    const TransportSurface surface = surface_of(hills(512, 384), 0.15);
    const RadialKernel kernel = kernel_for(surface, dipoles("marble", 80));
    const Image flux = uneven_flux(surface);
    const Found all = found(surface, flux, kernel, TransportAccuracy::final);
    EXPECT_EQ(all.path, TransportPath::levels);
    EXPECT_LE(error_at_random_texels(surface, flux, kernel, all.sums, 200).rms, 0.005);
}

// Turned or mirrored before is turned or mirrored after, whatever the path; grids lie otherwise then.
TEST(Transport, CommutesWithTurnsAndMirrorImages) {
    const struct {
        TransportSurface surface;
        TransportPath path;
    } cases[] = {
        {surface_of(70, 70, [](int i, int) { return 3e-4 * i; }), TransportPath::convolution},
        {surface_of(hills(70, 70), 0.15), TransportPath::levels},
        {dome(70, 0.15), TransportPath::levels},
        {noise(70, 0.3), TransportPath::tree},
    };
    for (const auto& c : cases) {
        const RadialKernel kernel = kernel_for(c.surface, dipoles("marble", 20));
        const Image flux = uneven_flux(c.surface);
        const Found plain = found(c.surface, flux, kernel, TransportAccuracy::final);
        EXPECT_EQ(name_of(plain.path), name_of(c.path));
        for (Image (*const moved)(const Image&) : {turned, mirrored}) {
            const TransportSurface surface{moved(c.surface.z), moved(c.surface.area)};
            const Image sums = found(surface, moved(flux), kernel, TransportAccuracy::final).sums;
            const RelativeError error = relative_error(sums.values, moved(plain.sums).values);
            EXPECT_LE(error.rms, c.path == TransportPath::convolution ? 1e-5 : 0.003)
                << name_of(c.path);
            EXPECT_GT(relative_error(sums.values, plain.sums.values).rms, 0.1);
        }
    }
}

TEST(Transport, OfAPreviewIsNearTheDoubleSum) {
    for (const TransportSurface& surface :
         {surface_of(hills(96, 96), 0.15), surface_of(hills(96, 96, 2), 0.05)}) {
        const RadialKernel kernel = kernel_for(surface, dipoles("marble", 20));
        const Image flux = uneven_flux(surface);
        const Found all = found(surface, flux, kernel, TransportAccuracy::preview);
        EXPECT_LE(error_at_random_texels(surface, flux, kernel, all.sums, 500).rms, 0.01);
    }
}

TEST(Transport, OfExactAccuracyIsTheTree) {
    const TransportSurface surface = surface_of(hills(64, 64), 0.01);
    const RadialKernel kernel = kernel_for(surface, dipoles("marble", 20));
    const Image flux = uneven_flux(surface);
    const Found all = found(surface, flux, kernel, TransportAccuracy::exact);
    EXPECT_EQ(all.path, TransportPath::tree);
    EXPECT_LE(error_at_random_texels(surface, flux, kernel, all.sums, 500).rms, 0.001);
}

// What is not absorbed leaves again: a plane much larger than light goes, evenly lit.
TEST(Transport, OfAnEvenlyLitPlaneGivesTheProfilesTotal) {
    const TransportSurface surface = surface_of(128, 128, [](int, int) { return 0.0; });
    for (const double mm_per_width : {400.0, 3000.0, 1e6}) {
        const auto profiles = dipoles("skin1", mm_per_width);
        const RadialKernel kernel = kernel_for(surface, profiles);
        Image flux(128, 128, 3, surface.area.at(0, 0));
        for (const TransportAccuracy accuracy : accuracies) {
            const Image sums = found(surface, flux, kernel, accuracy).sums;
            for (int c = 0; c < 3; ++c)
                EXPECT_NEAR(sums.at(64, 64, c) / profiles[c].total, 1, 0.01) << mm_per_width;
        }
    }
}

// Highlights below a plane: sigma^2 / (2 pi) times the sum of an even highlight is that highlight.
TEST(Transport, OfAnEvenHighlightOnAPlaneIsThatHighlight) {
    for (const double tilt : {0.0, 0.4, 1.5}) {
        const TransportSurface surface =
            surface_of(160, 160, [&](int i, int) { return tilt * i / 160.0; });
        for (const double sigma : {40.0, 200.0, 5000.0}) {
            const RadialKernel kernel = kernel_for(surface, {highlight_profile(sigma)});
            Image flux(160, 160, 1);
            for (std::size_t k = 0; k < flux.values.size(); ++k)
                flux.values[k] = 0.7f * surface.area.values[k];
            for (const TransportAccuracy accuracy : accuracies) {
                const Image sums = found(surface, flux, kernel, accuracy).sums;
                EXPECT_NEAR(sums.at(80, 80) * sigma * sigma / (2 * std::numbers::pi), 0.7,
                            accuracy == TransportAccuracy::preview ? 0.03 : 0.01)
                    << "tilt " << tilt << ", sigma " << sigma << ", " << int(accuracy);
            }
        }
    }
}

TEST(Transport, OfAHighlightThatGoesEverywhereIsConstant) {
    const TransportSurface surface = surface_of(hills(80, 60), 0.1);
    const RadialKernel kernel = kernel_for(surface, {highlight_profile(1e-6)});
    const Image flux = uneven_flux(surface, 1);
    double whole = 0;
    for (const float f : flux.values) whole += f;
    for (const TransportAccuracy accuracy : accuracies)
        for (const float sum : found(surface, flux, kernel, accuracy).sums.values)
            ASSERT_NEAR(sum / whole, 1, 0.005) << int(accuracy);
}

TEST(Transport, OfAHighlightLiesBetweenItsLeastAndItsMost) {
    const TransportSurface surface = surface_of(hills(80, 80), 0.15);
    const RadialKernel kernel = kernel_for(surface, {highlight_profile(30)});
    Image flux = uneven_flux(surface, 1), area(80, 80, 1);
    float least = INFINITY, most = 0;
    for (std::size_t k = 0; k < flux.values.size(); ++k) {
        const float f = flux.values[k] / surface.area.values[k];
        least = std::min(least, f);
        most = std::max(most, f);
        area.values[k] = surface.area.values[k];
    }
    for (const TransportAccuracy accuracy : accuracies) {
        const Image sums = found(surface, flux, kernel, accuracy).sums;
        const Image whole = found(surface, area, kernel, accuracy).sums;
        for (std::size_t k = 0; k < sums.values.size(); ++k) {
            EXPECT_LE(sums.values[k], 1.003f * most * whole.values[k]);
            EXPECT_GE(sums.values[k], 0.997f * least * whole.values[k]);
        }
    }
}

TEST(Transport, OfHighlightsIsTheSameByTreeAndConvolution) {
    const TransportSurface surface =
        surface_of(96, 96, [](int i, int j) { return 2e-4 * (i + std::sin(0.1 * j)); });
    const RadialKernel kernel = kernel_for(surface, {highlight_profile(25)});
    const Image flux = uneven_flux(surface, 1);
    const Found fast = found(surface, flux, kernel, TransportAccuracy::final);
    const Found slow = found(surface, flux, kernel, TransportAccuracy::exact);
    EXPECT_EQ(fast.path, TransportPath::convolution);
    EXPECT_LE(relative_error(fast.sums.values, slow.sums.values).max, 0.01);
}

TEST(Transport, IsLinearInFlux) {
    for (const TransportSurface& surface :
         {surface_of(hills(64, 48), 0.1), dome(64, 0.2), noise(50, 0.3)}) {
        const RadialKernel kernel = kernel_for(surface, dipoles("marble", 20));
        Image one = uneven_flux(surface), other = one;
        for (int j = 0; j < other.height; ++j)
            for (int i = 0; i < other.width; ++i) other.at(i, j, 1) *= float(0.2 + i / 64.0);
        Image both = one;
        for (std::size_t k = 0; k < both.values.size(); ++k) both.values[k] += 3 * other.values[k];
        const Image a = found(surface, one, kernel, TransportAccuracy::final).sums;
        const Image b = found(surface, other, kernel, TransportAccuracy::final).sums;
        const Image ab = found(surface, both, kernel, TransportAccuracy::final).sums;
        for (std::size_t k = 0; k < both.values.size(); ++k)
            EXPECT_NEAR(ab.values[k], a.values[k] + 3 * b.values[k], 5e-3 * ab.values[k]);
    }
}

TEST(Transport, OfNoFluxIsNothing) {
    const TransportSurface plane = surface_of(33, 20, [](int, int) { return 0.5; });
    for (const TransportSurface& surface :
         {plane, surface_of(hills(33, 20), 0.2), dome(33, 0.4), noise(33, 0.3)}) {
        const RadialKernel kernel = kernel_for(surface, dipoles("marble", 20));
        const Image flux(surface.width(), surface.height(), 3);
        for (const TransportAccuracy accuracy : accuracies)
            for (const float sum : found(surface, flux, kernel, accuracy).sums.values)
                ASSERT_EQ(sum, 0);
    }
}

TEST(Transport, TakesMapsOfOneTexelAndOneRow) {
    for (const auto& [width, height] : {std::pair(1, 1), std::pair(1, 30), std::pair(30, 1)})
        for (const double relief : {0.0, 0.3})
            for (const double mm_per_width : {1e-3, 1.0, 80.0, 1e6}) {
                const TransportSurface surface = surface_of(hills(width, height), relief);
                const RadialKernel kernel = kernel_for(surface, dipoles("marble", mm_per_width));
                const Image flux = uneven_flux(surface);
                const Image exact = direct_sums(surface, flux, kernel);
                for (const TransportAccuracy accuracy : accuracies)
                    EXPECT_LE(relative_error(found(surface, flux, kernel, accuracy).sums.values,
                                             exact.values)
                                  .rms,
                              0.02)
                        << width << " x " << height << ", " << mm_per_width << " mm";
            }
}

// From one millionth to ten thousand per mm.
TEST(Transport, IsFiniteForAbsurdMedia) {
    const TransportSurface surface = surface_of(hills(40, 40), 0.2);
    const Image flux = uneven_flux(surface);
    for (const double sigma_a : {0.0, 1e-6, 1e4})
        for (const double sigma_s : {1e-6, 1.0, 1e4})
            for (const double mm_per_width : {1e-2, 80.0, 1e5}) {
                const scatter::StandardDipole profile(
                    {sigma_a * mm_per_width, sigma_s * mm_per_width, 0, 1.4});
                const RadialKernel kernel =
                    kernel_for(surface, std::vector(3, radial_profile(profile)));
                for (const TransportAccuracy accuracy : accuracies)
                    for (const float sum : found(surface, flux, kernel, accuracy).sums.values)
                        ASSERT_TRUE(std::isfinite(sum) && sum >= 0 && sum < 10)
                            << sigma_a << " " << sigma_s << " " << mm_per_width;
            }
}

TEST(Transport, LeavesOutWhatIsMaskedOnEveryPath) {
    const auto with_hole = [](TransportSurface surface) {
        for (int j = 10; j < 25; ++j)
            for (int i = 5; i < 30; ++i) surface.area.at(i, j) = 0;
        return surface;
    };
    const TransportSurface plane = surface_of(48, 40, [](int, int) { return 0.5; });
    for (const TransportSurface& surface :
         {with_hole(plane), with_hole(surface_of(hills(48, 40), 0.2)), with_hole(dome(48, 0.4)),
          with_hole(noise(48, 0.3))}) {
        const RadialKernel kernel = kernel_for(surface, dipoles("marble", 20));
        const Image flux(48, surface.height(), 3, 1e-4f);
        const Image exact = direct_sums(surface, flux, kernel);
        const Found all = found(surface, flux, kernel, TransportAccuracy::final);
        EXPECT_LE(relative_error(all.sums.values, exact.values).rms, 0.005) << name_of(all.path);
        EXPECT_EQ(all.sums.at(10, 15, 2), 0) << name_of(all.path);
    }
    TransportSurface nothing = surface_of(20, 20, [](int, int) { return 0.5; });
    std::fill(nothing.area.values.begin(), nothing.area.values.end(), 0.0f);
    const RadialKernel kernel = kernel_for(nothing, dipoles("marble", 20));
    for (const TransportAccuracy accuracy : accuracies)
        for (const float sum : found(nothing, Image(20, 20, 3, 1.0f), kernel, accuracy).sums.values)
            ASSERT_EQ(sum, 0);
}

TEST(Transport, IsTheSameForAnyNumberOfThreads) {
    for (const TransportSurface& surface :
         {surface_of(hills(61, 47), 0.1), dome(61, 0.2), noise(45, 0.3)}) {
        const RadialKernel kernel = kernel_for(surface, dipoles("marble", 20));
        const Image flux = uneven_flux(surface);
        for (const TransportAccuracy accuracy : accuracies) {
            const Image of_two = transported(surface, flux, kernel, accuracy, executor());
            for (const int threads : {1, 3})
                EXPECT_EQ(transported(surface, flux, kernel, accuracy, Executor(threads)).values,
                          of_two.values);
        }
    }
}

TEST(Transport, IsGivenUpWhenItsRenderIsCancelled) {
    const TransportSurface surface = noise(61, 0.3);
    const RadialKernel kernel = kernel_for(surface, dipoles("marble", 20));
    std::stop_source source;
    source.request_stop();
    for (const TransportAccuracy accuracy : accuracies)
        EXPECT_THROW((void)transported(surface, uneven_flux(surface), kernel, accuracy, executor(),
                                       source.get_token()),
                     Error);
}

TEST(Transport, SaysWhatItTakesInMemory) {
    for (const TransportSurface& surface : {surface_of(hills(64, 64), 0.1), dome(64, 0.2)})
        for (const TransportAccuracy accuracy : accuracies) {
            const Transport transport(
                std::make_shared<TransportSurface>(surface),
                std::make_shared<RadialKernel>(kernel_for(surface, dipoles("marble", 20))),
                accuracy, executor());
            EXPECT_GT(transport.bytes(), 10'000u);
            EXPECT_LT(transport.bytes(), 20'000'000u);
        }
}

}  // namespace
}  // namespace relit::test
