#include "core/scatter/lobes.h"

#include <gtest/gtest.h>

#include "tests/core/scatter/support.h"

namespace relit::test {
namespace {

using namespace scatter;

const Lobe lobes[] = {
    {.kind = LobeKind::cosine, .exponent = 10},
    {.kind = LobeKind::ward, .n_t = 2, .n_b = 10},
    {.kind = LobeKind::ward_duer, .n_t = 2, .n_b = 10},
    {.kind = LobeKind::ashikhmin, .n_t = 10, .n_b = 2},
    {.kind = LobeKind::lafortune, .n_t = -0.2, .n_b = -0.5},
    {.kind = LobeKind::lafortune, .n_t = 0.5, .n_b = 0.2},
};

TEST(HighlightFrame, IsOrthonormalAndRightHandedForEveryNormal) {
    Random random(41);
    std::vector<Vec3> normals = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, -1}};
    for (const double off : {1e-5, 1e-6, 1e-7, 1e-12})
        for (const double side : {1.0, -1.0}) normals.push_back(normalized({side, off, -off}));
    for (int i = 0; i < 1000; ++i) normals.push_back(random.direction());
    for (const Vec3 n : normals) {
        const Frame f = highlight_frame(n);
        EXPECT_NEAR(length(f.t), 1, 1e-12);
        EXPECT_NEAR(length(f.b), 1, 1e-12);
        EXPECT_NEAR(dot(f.t, f.b), 0, 1e-12);
        EXPECT_NEAR(dot(f.t, f.n), 0, 1e-12);
        EXPECT_NEAR(dot(f.b, f.n), 0, 1e-12);
        EXPECT_NEAR(dot(cross(f.t, f.b), f.n), 1, 1e-12);
        for (const Lobe& lobe : lobes)
            EXPECT_TRUE(std::isfinite(
                value(lobe, f, random.direction_above(n), random.direction_above(n))));
    }
    EXPECT_EQ(highlight_frame({0, 0, 1}).t, (Vec3{0, 1, 0}));
    EXPECT_EQ(highlight_frame({0, 0, 1}).b, (Vec3{-1, 0, 0}));
}

TEST(Lobes, AreNothingFromOrToBelowTheSurface) {
    Random random(43);
    const Frame facing = highlight_frame({0, 0, 1});
    for (const Lobe& lobe : lobes)
        for (int i = 0; i < 200; ++i) {
            const Frame f = highlight_frame(random.direction());
            const Vec3 above = random.direction_above(f.n), below = -random.direction_above(f.n);
            EXPECT_EQ(value(lobe, f, above, below), 0);
            EXPECT_EQ(value(lobe, f, below, above), 0);
            EXPECT_EQ(value(lobe, facing, {1, 0, 0}, {0, 0, 1}), 0);
            EXPECT_EQ(value(lobe, facing, {0, 0, 1}, {0, -1, 0}), 0);
            EXPECT_EQ(value(lobe, f, above, -above), 0);
            EXPECT_GE(value(lobe, f, above, random.direction_above(f.n)), 0);
        }
}

TEST(Lobes, AreSymmetricInLightAndViewerInOneFrame) {
    Random random(47);
    for (const Lobe& lobe : lobes)
        for (int i = 0; i < 200; ++i) {
            const Frame f = highlight_frame(random.direction());
            const Vec3 a = random.direction_above(f.n), b = random.direction_above(f.n);
            const double there = value(lobe, f, a, b);
            EXPECT_NEAR(value(lobe, f, b, a), there, 1e-12 * (1 + there));
        }
}

// The axes turned by 90 degrees about n: t takes the place of b.
TEST(Lobes, SwappedExponentsAreTheFrameTurnedByAQuarter) {
    Random random(53);
    for (Lobe lobe : lobes)
        for (int i = 0; i < 200; ++i) {
            const Frame f = highlight_frame(random.direction());
            const Frame turned{f.b, -f.t, f.n};
            const Vec3 a = random.direction_above(f.n), b = random.direction_above(f.n);
            Lobe swapped = lobe;
            std::swap(swapped.n_t, swapped.n_b);
            const double there = value(lobe, turned, a, b);
            EXPECT_NEAR(value(swapped, f, a, b), there, 1e-12 * (1 + there));
        }
}

TEST(Lobes, CosineAndMirroringLafortunePeakWithOneAtTheMirroredDirection) {
    Random random(59);
    for (const Lobe& lobe : {Lobe{.kind = LobeKind::cosine, .exponent = 10},
                             Lobe{.kind = LobeKind::lafortune, .n_t = -1, .n_b = -1}})
        for (int i = 0; i < 200; ++i) {
            const Frame f = highlight_frame(random.direction());
            const Vec3 a = random.direction_above(f.n), b = random.direction_above(f.n);
            const Vec3 mirrored = 2 * dot(a, f.n) * f.n - a;
            EXPECT_NEAR(value(lobe, f, a, mirrored), 1, 1e-12);
            EXPECT_NEAR(value(lobe, f, a, b), std::pow(std::max(0.0, dot(mirrored, b)), 10), 1e-12);
        }
}

// An even exponent makes a positive number of a negative base: a glow away from the mirror.
TEST(Lobes, LafortuneHasNoLobeOfNegativeBases) {
    const Frame f = highlight_frame({0, 0, 1});
    const Lobe lobe{.kind = LobeKind::lafortune, .n_t = -1, .n_b = -1};
    const Vec3 flat = normalized({0, 1, 0.1});
    EXPECT_EQ(value(lobe, f, flat, flat), 0);
}

// Ward's with isotropic exponents, where h . t and h . b only count together.
TEST(Lobes, WardIsTheGaussianOfTheHalfWay) {
    const Frame f = highlight_frame({0, 0, 1});
    const Vec3 up{0, 0, 1};
    const Lobe ward{.kind = LobeKind::ward, .n_t = 8, .n_b = 8};
    EXPECT_NEAR(value(ward, f, up, up), 1 / (4 * pi * (2.0 / 8)), 1e-12);
    const Vec3 light = normalized({0.6, 0, 0.8}), h = normalized(light + up);
    const double exponent = -2 * 8 * (1 - h.z * h.z) / 2 / (1 + h.z);
    EXPECT_NEAR(value(ward, f, light, up), std::exp(exponent) / (4 * pi * 0.25 * std::sqrt(0.8)),
                1e-12);
    Lobe duer = ward;
    duer.kind = LobeKind::ward_duer;
    EXPECT_NEAR(value(duer, f, light, up) * std::sqrt(0.8), value(ward, f, light, up), 1e-12);
}

TEST(Lobes, FlooredCosinesBoundGrazingHighlightsAndChangeNoOthers) {
    const Frame f = highlight_frame({0, 0, 1});
    const Vec3 right = normalized({1, 0, 1e-7}), left = normalized({-1, 0, 1e-7});
    const Vec3 up = normalized({0.3, 0.2, 1});
    for (Lobe lobe : lobes) {
        const double plain = value(lobe, f, up, normalized({-0.5, 0, 1}));
        const double spike = value(lobe, f, right, left);
        lobe.least_cosine = 1e-3;
        EXPECT_EQ(value(lobe, f, up, normalized({-0.5, 0, 1})), plain);
        EXPECT_LE(value(lobe, f, right, left), spike);
        EXPECT_LT(value(lobe, f, right, left), 1e6);
    }
}

}  // namespace
}  // namespace relit::test
