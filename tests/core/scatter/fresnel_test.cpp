#include "core/scatter/fresnel.h"

#include <gtest/gtest.h>

#include "tests/core/scatter/support.h"

namespace relit::test {
namespace {

using namespace scatter;

TEST(Fresnel, AtNormalIncidenceIsTheSquareOfTheIndicesDifferenceOverTheirSum) {
    for (const double eta : {0.5, 0.75, 1.2, 1.3, 1.5, 3.0}) {
        const double share = (eta - 1) / (eta + 1);
        EXPECT_NEAR(fresnel(1, eta), share * share, 1e-15) << eta;
        EXPECT_NEAR(schlick(1, eta), share * share, 1e-15) << eta;
    }
}

TEST(Fresnel, GrazingLightIsReflectedAndSoIsLightBeyondTheCriticalAngle) {
    for (const double eta : {0.7, 1.3, 2.0}) {
        EXPECT_EQ(fresnel(0, eta), 1) << eta;
        EXPECT_EQ(schlick(0, eta), 1) << eta;
        EXPECT_EQ(transmittance(-0.5, eta), 0) << eta;
    }
    const double critical = std::sqrt(1 - 1 / (1.5 * 1.5));
    EXPECT_EQ(fresnel(critical - 1e-9, 1 / 1.5), 1);
    EXPECT_LT(fresnel(critical + 1e-3, 1 / 1.5), 0.9);
}

TEST(Fresnel, IsTheSameFromBothSidesOfTheSurface) {
    for (const double eta : {1.1, 1.3, 1.5, 2.5})
        for (double c = 0.02; c <= 1; c += 0.02)
            EXPECT_NEAR(fresnel(refracted_cosine(c, eta), 1 / eta), fresnel(c, eta), 1e-12)
                << eta << ' ' << c;
}

TEST(Fresnel, IndicesThatAreEqualMakeNoBoundary) {
    for (const double eta : {1.0, 1.00005, 0.99995}) {
        for (const double c : {0.0, 0.3, 1.0}) EXPECT_EQ(fresnel(c, eta), 0);
        EXPECT_EQ(transmittance(0.3, eta), 1);
        EXPECT_EQ(moments(eta).c1, 0);
        EXPECT_EQ(moments(eta).c2, 0);
        EXPECT_EQ(diffuse_transmittance(eta), 1);
        EXPECT_EQ(standard_boundary(eta), 1);
        EXPECT_EQ(moment_boundary(eta), 1);
    }
}

TEST(Refracted, IsOfLengthOneInThePlaneOfIncidenceAndObeysSnell) {
    Random random(1);
    for (int i = 0; i < 1000; ++i) {
        const Vec3 n = random.direction(), w = random.direction_above(n);
        const double eta = random.between(1, 2.5);
        const Vec3 in = refracted(w, n, eta);
        EXPECT_NEAR(length(in), 1, 1e-12);
        EXPECT_LT(dot(in, n), 0);
        EXPECT_NEAR(-dot(in, n), refracted_cosine(dot(w, n), eta), 1e-12);
        EXPECT_NEAR(length(cross(in, n)) * eta, length(cross(w, n)), 1e-12);
        EXPECT_NEAR(dot(in, cross(w, n)), 0, 1e-12);
        EXPECT_LE(dot(in, w - dot(w, n) * n), 0);
    }
}

// The quadrature itself, against many small steps of the plain integrand.
TEST(Moments, QuadratureIsTheIntegral) {
    constexpr int steps = 200'000;
    for (const double n : {0.5, 0.77, 0.98, 1.0005, 1.02, 1.1, 1.3, 1.5, 3.0}) {
        double c1 = 0, c2 = 0;
        for (int i = 0; i < steps; ++i) {
            const double mu = (i + 0.5) / steps, f = fresnel(mu, 1 / n);
            c1 += f * mu / steps;
            c2 += f * mu * mu / steps;
        }
        EXPECT_NEAR(exact_moments(n).c1 / c1, 1, 2e-6) << n;
        EXPECT_NEAR(exact_moments(n).c2 / c2, 1, 4e-6) << n;
    }
    EXPECT_NEAR(2 * exact_moments(1.5).c1, 0.59635, 5e-6);
}

TEST(Moments, FitsAreAsGoodAsSaidAndLeftWhereTheyAreNot) {
    for (double n = 1.2; n <= 2; n += 0.01)
        for (const double side : {n, 1 / n}) {
            const Moments fit = fitted_moments(side), exact = exact_moments(side);
            EXPECT_NEAR(fit.c1 / exact.c1, 1, 0.005) << side;
            EXPECT_NEAR(fit.c2 / exact.c2, 1, n < 1.3 ? 0.02 : 0.01) << side;
            EXPECT_EQ(moments(side).c2, fit.c2) << side;
        }
    EXPECT_NEAR(fitted_moments(1.05).c2 / exact_moments(1.05).c2, 0.88, 0.01);
    for (const double n : {0.3, 0.9, 1.01, 1.05, 1.1, 1.19, 2.1, 4.0})
        EXPECT_EQ(moments(n).c1, exact_moments(n).c1) << n;
}

TEST(Boundary, ConstantsAreThoseOfTheSpecification) {
    EXPECT_NEAR(standard_boundary(1.3), 2.602, 5e-4);
    EXPECT_NEAR(standard_boundary(1.33), 2.790, 5e-4);
    EXPECT_NEAR(standard_boundary(1.5), 3.960, 6e-4);
    EXPECT_NEAR(moment_boundary(1.3), 2.339, 5e-4);
    EXPECT_NEAR(moment_boundary(1.33), 2.515, 5e-4);
    EXPECT_NEAR(moment_boundary(1.5), 3.625, 5e-4);
    EXPECT_NEAR(diffuse_transmittance(1.3), 0.939, 5e-4);
    EXPECT_NEAR(diffuse_transmittance(1.5), 0.908, 5e-4);
}

// Both fits and the quadrature are the same quantity; beyond their range fits pass 1.
TEST(Boundary, DiffuseReflectanceStaysBelowOne) {
    for (double n = 1.2; n <= 2; n += 0.05)
        EXPECT_NEAR(diffuse_reflectance(n) / (2 * exact_moments(n).c1), 1, 0.005) << n;
    for (double n = 1.001; n < 10; n *= 1.01) {
        EXPECT_LT(diffuse_reflectance(n), 1) << n;
        EXPECT_GT(diffuse_reflectance(n), 0) << n;
        EXPECT_GE(standard_boundary(n), 1) << n;
        EXPECT_GE(moment_boundary(n), 1) << n;
        EXPECT_GT(diffuse_transmittance(n), 0) << n;
        EXPECT_LE(diffuse_transmittance(n), 1) << n;
    }
}

}  // namespace
}  // namespace relit::test
