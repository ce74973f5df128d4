#include "core/visibility/sample_count.h"

#include <gtest/gtest.h>

#include "tests/support/maps.h"

namespace relit::test {
namespace {

// The thesis's pseudo-code, with its own inside test on a map of columns' bilinear heights.
int pseudo_code(const HeightField& field, double relief, Vec3 p, Vec3 L, int S) {
    const int W = field.width(), H = field.height();
    const auto h = [&](int i, int j) {
        return relief *
               field.heights.at(std::min(std::max(i, 0), W - 1), std::min(std::max(j, 0), H - 1));
    };
    int s = 1;
    for (int i = 0; i <= S; ++i) {
        const Vec3 q{p.x + i * (L.x - p.x) / S, p.y + i * (L.y - p.y) / S,
                     p.z + i * (L.z - p.z) / S};
        const double c = q.x * W - 0.5, r = H - 0.5 - q.y * W;
        const int ci = int(std::floor(c)), ri = int(std::floor(r));
        const double a = c - ci, b = r - ri;
        const double z = (1 - b) * ((1 - a) * h(ci, ri) + a * h(ci + 1, ri)) +
                         b * ((1 - a) * h(ci, ri + 1) + a * h(ci + 1, ri + 1));
        const bool on_map = q.x >= 0 && q.x <= 1 && q.y >= 0 && q.y <= double(H) / W;
        if (q.z < 0 || (on_map && q.z < z)) s += 1;
    }
    return s;
}

TEST(SampleCount, IsThePseudoCodesSampleForSample) {
    const HeightField field = hills(40, 30);
    const Solid solid = make_solid(field, 1, {}, 0.008);
    Random random(3);
    for (int trial = 0; trial < 500; ++trial) {
        const Vec3 p =
            surface_point(solid, int(random() * 40), int(random() * 30)) - Vec3{0, 0, 0.0081};
        const Vec3 L{random() * 1.4 - 0.2, random(), random() * 2 - 0.5};
        const int S = 1 + int(random() * 120);
        EXPECT_EQ(sample_count(solid, p, L, S), pseudo_code(field, 1, p, L, S))
            << "trial " << trial;
    }
}

TEST(SampleCount, IsAtLeastTwoBecauseTheStartLiesInside) {
    const Solid solid = make_solid(hills(16, 16), 0.5, {}, 0.008);
    const Vec3 p = surface_point(solid, 8, 8) - Vec3{0, 0, 0.008};
    EXPECT_EQ(sample_count(solid, p, p + Vec3{0, 0, 5}, 10), 2);
}

}  // namespace
}  // namespace relit::test
