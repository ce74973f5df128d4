#include "core/transport/sample_tree.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "core/base/error.h"
#include "core/scatter/fresnel.h"
#include "core/transport/tree_sum.h"
#include "tests/support/transport.h"

namespace relit::test {
namespace {

// The octree's rule as it is written, for one point (Jensen and Buhler 2002).
double walked_sum(const SampleTree& tree, const TreeFlux& flux, const RadialProfile& profile, int c,
                  double threshold, const double* x) {
    const auto nodes = tree.nodes();
    const SurfaceSamples& s = tree.samples();
    const std::function<double(std::size_t)> eval = [&](std::size_t v) {
        const SampleTree::Node& node = nodes[v];
        double sum = 0, squared = 0;
        bool is_inside = true;
        for (int axis = 0; axis < 3; ++axis) {
            is_inside = is_inside && x[axis] >= node.low[axis] && x[axis] <= node.high[axis];
            squared += std::pow(flux.places[v * 3 + axis] - x[axis], 2);
        }
        if (!node.is_leaf && !is_inside && node.area < threshold * squared)
            return profile.at(std::sqrt(squared)) * flux.of_nodes[v * flux.channels + c];
        for (std::uint32_t k = node.first; node.is_leaf && k < node.first + node.count; ++k)
            sum += profile.at(std::hypot(s.x[k] - x[0], s.y[k] - x[1], s.z[k] - x[2])) *
                   flux.of_samples[k * flux.channels + c];
        for (std::size_t child = v + 1; !node.is_leaf && child < node.end; child = nodes[child].end)
            sum += eval(child);
        return sum;
    };
    return nodes.empty() ? 0 : eval(0);
}

// The specification's fields: n x n samples h = amp sin(kx x) cos(ky y) + slope x, in mm.
struct Field {
    const char* medium;
    int n;
    double dx, amp, kx, ky, slope, theta_deg, phi_deg;
    double rms_of_reference[6], max_of_reference[6];  // at the thresholds below, of its own tree
};
constexpr double thresholds[6] = {1, 0.5, 0.2, 0.1, 0.05, 0.02};
const Field fields[] = {
    {"marble",
     40,
     0.25,
     0.4,
     0.9,
     0.7,
     0.1,
     40,
     30,
     {0.0542312885, 0.0236906788, 0.0064967101, 0.0021267289, 0.0006224723, 0.0000861743},
     {0.0613330751, 0.0315732608, 0.0082461415, 0.0026501809, 0.0008891781, 0.0001476323}},
    {"skin1",
     36,
     0.3,
     0.3,
     0.6,
     1.0,
     -0.15,
     10,
     90,
     {0.0623499200, 0.0254843480, 0.0044319285, 0.0011472953, 0.0002263241, 0.0000105365},
     {0.0765265783, 0.0371138623, 0.0060557854, 0.0013874225, 0.0002861127, 0.0000232520}},
};

struct Cloud {
    SurfaceSamples samples;
    std::vector<float> flux;
};

Cloud cloud_of(const Field& f) {
    const scatter::Medium& medium = scatter::find_medium(f.medium)->medium;
    const double th = f.theta_deg * std::numbers::pi / 180, ph = f.phi_deg * std::numbers::pi / 180;
    const Vec3 to_light{std::sin(th) * std::cos(ph), std::sin(th) * std::sin(ph), std::cos(th)};
    Cloud cloud;
    for (int j = 0; j < f.n; ++j)
        for (int i = 0; i < f.n; ++i) {
            const double x = (i - (f.n - 1) / 2.0) * f.dx, y = (j - (f.n - 1) / 2.0) * f.dx;
            const double hx = f.amp * f.kx * std::cos(f.kx * x) * std::cos(f.ky * y) + f.slope;
            const double hy = -f.amp * f.ky * std::sin(f.kx * x) * std::sin(f.ky * y);
            const Vec3 n = normalized({-hx, -hy, 1});
            const double cos_i = std::max(0.0, dot(to_light, n)), area = f.dx * f.dx / n.z;
            cloud.samples.x.push_back(float(x));
            cloud.samples.y.push_back(float(y));
            cloud.samples.z.push_back(
                float(f.amp * std::sin(f.kx * x) * std::cos(f.ky * y) + f.slope * x));
            cloud.samples.area.push_back(float(area));
            cloud.flux.push_back(float(cos_i * (1 - scatter::fresnel(cos_i, medium.eta)) * area));
        }
    return cloud;
}

// Sums at all samples, in groups of 64 in the tree's order, by sample as given.
std::vector<float> grouped_sums(const SampleTree& tree, const TreeFlux& flux,
                                const RadialKernel& kernel, double threshold, Simd simd) {
    const TreeSum sum(tree, flux, kernel, float(threshold), simd);
    const SurfaceSamples& s = tree.samples();
    std::vector<float> sums(s.size());
    TreeSum::Lists lists;
    for (std::size_t first = 0; first < s.size(); first += kernels::group_points) {
        kernels::PointGroup points;
        for (std::size_t k = 0; k < kernels::group_points; ++k) {
            const std::size_t from = std::min(first + k, s.size() - 1);
            points.x[k] = s.x[from];
            points.y[k] = s.y[from];
            points.z[k] = s.z[from];
        }
        std::vector<float> of_group(kernel.channels() * kernels::group_points);
        sum(points, lists, of_group);
        for (std::size_t k = first; k < std::min(first + kernels::group_points, s.size()); ++k)
            sums[tree.order()[k]] = of_group[k - first];
    }
    return sums;
}

TEST(SampleTree, HoldsEverySampleOnceInItsLeafsCube) {
    const Cloud cloud = cloud_of(fields[0]);
    const SampleTree tree(cloud.samples);
    std::vector<int> seen(cloud.samples.size());
    std::uint32_t samples = 0;
    for (const SampleTree::Node& node : tree.nodes()) {
        if (!node.is_leaf) continue;
        EXPECT_LE(node.count, std::uint32_t(SampleTree::leaf_size));
        EXPECT_EQ(node.first, samples);
        samples += node.count;
        for (std::uint32_t k = node.first; k < node.first + node.count; ++k) {
            ++seen[tree.order()[k]];
            const float slack = 1e-5f;
            EXPECT_GE(tree.samples().x[k], node.low[0] - slack);
            EXPECT_LE(tree.samples().x[k], node.high[0] + slack);
            EXPECT_GE(tree.samples().z[k], node.low[2] - slack);
            EXPECT_LE(tree.samples().z[k], node.high[2] + slack);
        }
    }
    EXPECT_EQ(samples, cloud.samples.size());
    for (const int times : seen) EXPECT_EQ(times, 1);
}

TEST(SampleTree, OpenedEverywhereIsTheDoubleSum) {
    const Cloud cloud = cloud_of(fields[0]);
    const SampleTree tree(cloud.samples);
    const TreeFlux flux = tree_flux(tree, cloud.flux, 1);
    const auto profile = dipoles("marble", 1)[0];
    for (const std::size_t q : {3u, 500u, 1599u}) {
        const SurfaceSamples& s = cloud.samples;
        const double x[3] = {s.x[q], s.y[q], s.z[q]};
        double exact = 0;
        for (std::size_t k = 0; k < s.size(); ++k)
            exact +=
                profile.at(std::hypot(s.x[k] - x[0], s.y[k] - x[1], s.z[k] - x[2])) * cloud.flux[k];
        EXPECT_NEAR(walked_sum(tree, flux, profile, 0, 0, x) / exact, 1, 1e-12);
    }
}

// For each threshold no more than twice the error of the reference's tree, and falling with it.
TEST(SampleTree, IsAsExactAsTheReferencesTree) {
    for (const Field& f : fields) {
        const int c = &f == &fields[0] ? 0 : 1;
        const Cloud cloud = cloud_of(f);
        const SampleTree tree(cloud.samples);
        const TreeFlux flux = tree_flux(tree, cloud.flux, 1);
        const RadialProfile profile = dipoles(f.medium, 1)[c];
        const RadialKernel kernel({&profile, 1}, f.dx, 2 * f.n * f.dx);
        const std::vector<float> exact = grouped_sums(tree, flux, kernel, 0, best_simd());
        double before = 1;
        for (int e = 0; e < 6; ++e) {
            const RelativeError error =
                relative_error(grouped_sums(tree, flux, kernel, thresholds[e], best_simd()), exact);
            EXPECT_LE(error.rms, 2 * f.rms_of_reference[e] + 1e-5) << f.medium << thresholds[e];
            EXPECT_LE(error.max, 2 * f.max_of_reference[e] + 2e-5) << f.medium << thresholds[e];
            EXPECT_LT(error.rms, before);
            before = error.rms;
        }
    }
}

// A group's rule opens what each of its points would.
TEST(SampleTree, OfAGroupIsNoLessExactThanPointByPoint) {
    const Cloud cloud = cloud_of(fields[0]);
    const SampleTree tree(cloud.samples);
    const TreeFlux flux = tree_flux(tree, cloud.flux, 1);
    const RadialProfile profile = dipoles("marble", 1)[0];
    const RadialKernel kernel({&profile, 1}, 0.25, 30);
    const std::vector<float> exact = grouped_sums(tree, flux, kernel, 0, best_simd());
    std::vector<float> walked;
    const RadialProfile table{[&](double r) { return kernel.at(0, r); }, {}, 0};
    for (std::size_t k = 0; k < cloud.samples.size(); ++k) {
        const double x[3] = {cloud.samples.x[k], cloud.samples.y[k], cloud.samples.z[k]};
        walked.push_back(float(walked_sum(tree, flux, table, 0, 0.2, x)));
    }
    EXPECT_LE(relative_error(grouped_sums(tree, flux, kernel, 0.2, best_simd()), exact).rms,
              relative_error(walked, exact).rms);
}

TEST(SampleTree, SumsAreTheSameOnEveryInstructionSet) {
    const Cloud cloud = cloud_of(fields[0]);
    const SampleTree tree(cloud.samples);
    const TreeFlux flux = tree_flux(tree, cloud.flux, 1);
    const RadialProfile profile = dipoles("marble", 1)[0];
    const RadialKernel kernel({&profile, 1}, 0.25, 30);
    const auto portable = grouped_sums(tree, flux, kernel, 0.2, Simd::portable);
    for (const Simd simd : available_simd())
        EXPECT_EQ(grouped_sums(tree, flux, kernel, 0.2, simd), portable) << name_of(simd);
}

TEST(SampleTree, TakesSamplesInOnePlaceAndNone) {
    SurfaceSamples samples{std::vector<float>(50, 0.5f), std::vector<float>(50, 0.25f),
                           std::vector<float>(50, 0.1f), std::vector<float>(50, 0.01f)};
    const SampleTree tree(samples);
    const TreeFlux flux = tree_flux(tree, std::vector<float>(50, 2.0f), 1);
    EXPECT_FLOAT_EQ(flux.of_nodes[0], 100);
    EXPECT_FLOAT_EQ(flux.places[1], 0.25f);
    EXPECT_TRUE(SampleTree(SurfaceSamples{}).nodes().empty());
}

TEST(SampleTree, IsGivenUpWhenItsRenderIsCancelled) {
    std::stop_source source;
    source.request_stop();
    EXPECT_THROW(SampleTree(cloud_of(fields[0]).samples, source.get_token()), Error);
}

}  // namespace
}  // namespace relit::test
