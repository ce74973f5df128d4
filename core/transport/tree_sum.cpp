#include "core/transport/tree_sum.h"

#include <algorithm>
#include <cmath>

#include "core/transport/point_box.h"

namespace relit {
namespace {

kernels::GroupSum* group_sum_of(Simd simd) {
    switch (simd) {
#if defined(__x86_64__)
        case Simd::avx512:
            return kernels::sum_group_avx512;
        case Simd::avx2:
            return kernels::sum_group_avx2;
#endif
        default:
            return kernels::sum_group_portable;
    }
}

// A cubic in u - middle through the values at the Chebyshev points of [middle - half, middle + half].
struct Cubic {
    double c[4];
    template <class Value>
    Cubic(double middle, double half, const Value& value) {
        constexpr double a = 0.92387953251128674, b = 0.38268343236508977;
        const double a_high = value(middle + half * a), a_low = value(middle - half * a);
        const double b_high = value(middle + half * b), b_low = value(middle - half * b);
        const double even_a = (a_high + a_low) / 2, even_b = (b_high + b_low) / 2;
        const double odd_a = (a_high - a_low) / (2 * a), odd_b = (b_high - b_low) / (2 * b);
        c[2] = (even_a - even_b) / (a * a - b * b);
        c[3] = (odd_a - odd_b) / (a * a - b * b);
        c[0] = even_b - c[2] * b * b;
        c[1] = odd_b - c[3] * b * b;
        for (int k = 1; k < 4; ++k) c[k] /= std::pow(half, k);
    }
};

}  // namespace

TreeSum::TreeSum(const SampleTree& tree, const TreeFlux& flux, const RadialKernel& kernel,
                 float threshold, Simd simd)
    : tree_(tree),
      flux_(flux),
      kernel_(kernel),
      threshold_(threshold),
      sum_group_(group_sum_of(simd)) {}

void TreeSum::operator()(const kernels::PointGroup& points, Lists& lists,
                         std::span<float> sums) const {
    const PointBox box(points);
    lists.sources.clear();
    lists.distant.clear();
    gather(box, lists);
    kernels::PointGroup local;
    for (int k = 0; k < kernels::group_points; ++k) {
        local.x[k] = points.x[k] - box.centre[0];
        local.y[k] = points.y[k] - box.centre[1];
        local.z[k] = points.z[k] - box.centre[2];
    }
    std::fill(sums.begin(), sums.end(), 0.0f);
    const kernels::RadialTable table{kernel_.segments().data(), kernel_.first_segment(),
                                     kernel_.last_segment()};
    sum_group_(table, kernel_.channels(), local, lists.sources.data(),
               int(lists.sources.size()) / kernels::source_floats, lists.distant.data(),
               int(lists.distant.size()) / kernels::distant_floats, sums.data());
}

void TreeSum::gather(const PointBox& box, Lists& lists) const {
    const std::span<const SampleTree::Node> nodes = tree_.nodes();
    const SurfaceSamples& samples = tree_.samples();
    const auto range_squared = float(kernel_.range() * kernel_.range());
    const int channels = flux_.channels;
    for (std::size_t k = 0; k < nodes.size();) {
        const SampleTree::Node& node = nodes[k];
        const float* place = &flux_.places[k * 3];
        float nearest, farthest;
        box.distances(place, nearest, farthest);
        if (box.squared_distance(node) > range_squared) {
            k = node.end;
        } else if (node.is_leaf) {
            for (std::uint32_t s = node.first; s < node.first + node.count; ++s) {
                const float at[3] = {samples.x[s], samples.y[s], samples.z[s]};
                add_source(box, at, &flux_.of_samples[std::size_t(s) * channels], lists);
            }
            k = node.end;
        } else if (node.area < threshold_ * nearest && !box.meets(node)) {
            const float* flux = &flux_.of_nodes[k * channels];
            if (farthest <= 1.2f * nearest) add_distant(box, place, flux, nearest, farthest, lists);
            else add_source(box, place, flux, lists);
            k = node.end;
        } else {
            ++k;
        }
    }
}

void TreeSum::add_source(const PointBox& box, const float* place, const float* flux,
                         Lists& lists) const {
    float source[kernels::source_floats]{};
    for (int axis = 0; axis < 3; ++axis) source[axis] = place[axis] - box.centre[axis];
    for (int c = 0; c < flux_.channels; ++c) source[3 + c] = flux[c];
    lists.sources.insert(lists.sources.end(), std::begin(source), std::end(source));
}

void TreeSum::add_distant(const PointBox& box, const float* place, const float* flux, double low,
                          double high, Lists& lists) const {
    float distant[kernels::distant_floats]{};
    const double middle = (low + high) / 2, half = std::max((high - low) / 2, 1e-6 * high);
    for (int axis = 0; axis < 3; ++axis) distant[axis] = place[axis] - box.centre[axis];
    distant[3] = float(middle);
    for (int c = 0; c < flux_.channels; ++c) {
        const Cubic cubic(middle, half,
                          [&](double u) { return double(kernel_.at_squared(c, float(u))); });
        for (int k = 0; k < 4; ++k) distant[4 + 4 * c + k] = float(cubic.c[k] * flux[c]);
    }
    lists.distant.insert(lists.distant.end(), std::begin(distant), std::end(distant));
}

}  // namespace relit
