#include "core/transport/transport.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/transport.h"

namespace relit::test {
namespace {

TEST(Transport, IsTheExactSumWithinHalfAPerCent) {
    const TransportSurface surface = surface_of(hills(96, 96), 0.15);
    const Image flux = uneven_flux(surface);
    const RadialKernel kernel = kernel_for(surface, dipoles("marble", 20));
    const Image found = transported(surface, flux, kernel, TransportAccuracy::final, executor());
    const RelativeError error =
        relative_error(found.values, direct_sums(surface, flux, kernel).values);
    EXPECT_LE(error.rms, 0.005);
    EXPECT_GT(error.max, 0);
}

}  // namespace
}  // namespace relit::test
