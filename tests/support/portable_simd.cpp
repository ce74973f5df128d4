// Linked into a program of tests, this makes all that takes the best instruction set portable.
#include <gtest/gtest.h>

#include "core/render/render.h"
#include "tests/support/maps.h"

namespace relit {

Simd best_simd() { return Simd::portable; }

namespace test {
namespace {

TEST(PortableProgram, RendersWithWhatEveryProcessorHas) {
    EXPECT_EQ(RenderControl{executor()}.simd, Simd::portable);
}

}  // namespace
}  // namespace test
}  // namespace relit
