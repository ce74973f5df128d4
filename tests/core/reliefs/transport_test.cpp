// Light summed below real reliefs, as final pictures have it, against the double sum.
#include "core/transport/transport.h"

#include <gtest/gtest.h>

#include "tests/support/relief_files.h"
#include "tests/support/transport.h"

namespace relit::test {
namespace {

Image final_sums(const TransportSurface& surface, const Image& flux, const RadialKernel& kernel) {
    return transported(surface, flux, kernel, TransportAccuracy::final, executor());
}

TEST(TransportOfReliefs, OfThreeSmallOnesIsTheDoubleSumWithinHalfAPerCent) {
    for (const int k : {0, 2, 4}) {  // bunny, Plato, Mount St. Helens
        const ReliefFile& file = relief_files[k];
        RELIT_SKIP_WITHOUT_DATA(file.heights);
        const HeightField field = smaller_field(load_relief(file), 96, 96, executor(), {});
        const TransportSurface surface = surface_of(field, 0.15);
        const Image flux = uneven_flux(surface);
        for (const char* medium : {"marble", "skin1"}) {
            const RadialKernel kernel = kernel_for(surface, dipoles(medium, 20));
            const RelativeError error = relative_error(final_sums(surface, flux, kernel).values,
                                                       direct_sums(surface, flux, kernel).values);
            EXPECT_LE(error.rms, 0.005) << file.name << ", " << medium;
        }
    }
}

TEST(TransportOfReliefs, OfTwoLargeOnesIsTheDoubleSumWithinHalfAPerCentAtAThousandTexels) {
    const struct {
        ReliefFile file;
        double relief;
    } cases[] = {
        {{"bunny", "heights/bunny_1024_height.png", "heights/bunny_1024_alpha.png", nullptr}, 0.15},
        {{"coin", "coin/coin_oath_1024_height_est.png", nullptr, nullptr}, 0.05},
    };
    for (const auto& [file, relief] : cases) {
        RELIT_SKIP_WITHOUT_DATA(file.heights);
        const TransportSurface surface = surface_of(load_relief(file), relief);
        ASSERT_EQ(surface.width(), 1024);
        ASSERT_EQ(surface.height(), 1024);
        const RadialKernel kernel = kernel_for(surface, dipoles("marble", 80));
        const Image flux = uneven_flux(surface), sums = final_sums(surface, flux, kernel);
        EXPECT_LE(error_at_random_texels(surface, flux, kernel, sums, 1000).rms, 0.005)
            << file.name;
    }
}

}  // namespace
}  // namespace relit::test
