#include "core/transport/sample_tree.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "core/base/error.h"

namespace relit {
namespace {

// Every third bit of the result is one of `value`'s lowest 20.
std::uint64_t spread(std::uint64_t value) {
    value &= 0xfffff;
    value = (value | value << 32) & 0x1f00000000ffffu;
    value = (value | value << 16) & 0x1f0000ff0000ffu;
    value = (value | value << 8) & 0x100f00f00f00f00fu;
    value = (value | value << 4) & 0x10c30c30c30c30c3u;
    return (value | value << 2) & 0x1249249249249249u;
}

struct Bounds {
    float low = INFINITY, high = -INFINITY;
    explicit Bounds(std::span<const float> values) {
        for (const float v : values) {
            low = std::min(low, v);
            high = std::max(high, v);
        }
    }
};

// Of a coordinate within the root: which of its 2^20 slices.
std::uint64_t slice_of(float value, float low, float size) {
    constexpr double slices = 1 << SampleTree::max_depth;
    const double place = (double(value) - low) / size * slices;
    return std::uint64_t(std::clamp(place, 0.0, slices - 1));
}

void check(const std::stop_token& stop) {
    if (stop.stop_requested()) throw Error(error_code::cancelled, "the render was cancelled");
}

}  // namespace

SampleTree::SampleTree(const SurfaceSamples& samples, const std::stop_token& stop) {
    const std::size_t count = samples.size();
    if (count == 0) return;
    const Bounds x(samples.x), y(samples.y), z(samples.z);
    size_ = std::max({x.high - x.low, y.high - y.low, z.high - z.low, 1e-6f});
    const auto start = [&](const Bounds& b) { return b.low + (b.high - b.low - size_) / 2; };
    const float low[3] = {start(x), start(y), start(z)};
    std::vector<std::pair<std::uint64_t, std::uint32_t>> coded(count);
    for (std::size_t k = 0; k < count; ++k)
        coded[k] = {spread(slice_of(samples.x[k], low[0], size_)) |
                        spread(slice_of(samples.y[k], low[1], size_)) << 1 |
                        spread(slice_of(samples.z[k], low[2], size_)) << 2,
                    std::uint32_t(k)};
    check(stop);
    std::sort(coded.begin(), coded.end());
    check(stop);
    std::vector<std::uint64_t> codes(count);
    order_.resize(count);
    samples_ = {std::vector<float>(count), std::vector<float>(count), std::vector<float>(count),
                std::vector<float>(count)};
    for (std::size_t k = 0; k < count; ++k) {
        codes[k] = coded[k].first;
        const std::uint32_t from = order_[k] = coded[k].second;
        samples_.x[k] = samples.x[from];
        samples_.y[k] = samples.y[from];
        samples_.z[k] = samples.z[from];
        samples_.area[k] = samples.area[from];
    }
    add_node(0, std::uint32_t(count), 0, low, codes);
}

void SampleTree::add_node(std::uint32_t first, std::uint32_t count, int depth, const float* low,
                          std::span<const std::uint64_t> codes) {
    const std::size_t index = nodes_.size();
    Node node{.first = first, .count = count};
    node.is_leaf = count <= leaf_size || depth == max_depth;
    const float size = std::ldexp(size_, -depth);
    double area = 0, sum[3]{};
    for (std::uint32_t k = first; k < first + count; ++k) {
        const double a = samples_.area[k];
        area += a;
        sum[0] += a * samples_.x[k];
        sum[1] += a * samples_.y[k];
        sum[2] += a * samples_.z[k];
    }
    node.area = float(area);
    for (int axis = 0; axis < 3; ++axis) {
        node.low[axis] = low[axis];
        node.high[axis] = low[axis] + size;
        node.centre[axis] = area > 0 ? float(sum[axis] / area) : low[axis] + size / 2;
    }
    nodes_.push_back(node);
    const int shift = 3 * (max_depth - 1 - depth);
    for (std::uint32_t begin = first; !node.is_leaf && begin < first + count;) {
        const std::uint64_t octant = codes[begin] >> shift;
        const auto end =
            std::partition_point(codes.begin() + begin, codes.begin() + first + count,
                                 [&](std::uint64_t code) { return code >> shift == octant; });
        const float half = size / 2;
        const float corner[3] = {low[0] + (octant & 1 ? half : 0), low[1] + (octant & 2 ? half : 0),
                                 low[2] + (octant & 4 ? half : 0)};
        const auto next = std::uint32_t(end - codes.begin());
        add_node(begin, next - begin, depth + 1, corner, codes);
        begin = next;
    }
    nodes_[index].end = std::uint32_t(nodes_.size());
}

std::uint64_t SampleTree::bytes() const {
    return nodes_.size() * sizeof(Node) +
           order_.size() * (sizeof(std::uint32_t) + 4 * sizeof(float));
}

TreeFlux tree_flux(const SampleTree& tree, std::span<const float> flux, int channels) {
    const SurfaceSamples& samples = tree.samples();
    const std::span<const SampleTree::Node> nodes = tree.nodes();
    TreeFlux made{.channels = channels};
    made.of_samples.resize(samples.size() * channels);
    for (std::size_t k = 0; k < samples.size(); ++k)
        for (int c = 0; c < channels; ++c)
            made.of_samples[k * channels + c] = flux[std::size_t(tree.order()[k]) * channels + c];
    made.of_nodes.resize(nodes.size() * channels);
    made.places.resize(nodes.size() * 3);
    // Sums of whole subtrees, children before their parents.
    struct Sums {
        double flux[RadialKernel::max_channels]{}, weight = 0, place[3]{};
    };
    std::vector<Sums> sums(nodes.size());
    for (std::size_t k = nodes.size(); k-- > 0;) {
        const SampleTree::Node& node = nodes[k];
        Sums& sum = sums[k];
        for (std::uint32_t s = node.first; node.is_leaf && s < node.first + node.count; ++s) {
            double weight = 0;
            for (int c = 0; c < channels; ++c) {
                const double f = made.of_samples[std::size_t(s) * channels + c];
                sum.flux[c] += f;
                weight += f;
            }
            sum.weight += weight;
            sum.place[0] += weight * samples.x[s];
            sum.place[1] += weight * samples.y[s];
            sum.place[2] += weight * samples.z[s];
        }
        for (std::uint32_t child = std::uint32_t(k) + 1; !node.is_leaf && child < node.end;
             child = nodes[child].end) {
            for (int c = 0; c < channels; ++c) sum.flux[c] += sums[child].flux[c];
            sum.weight += sums[child].weight;
            for (int axis = 0; axis < 3; ++axis) sum.place[axis] += sums[child].place[axis];
        }
        for (int c = 0; c < channels; ++c) made.of_nodes[k * channels + c] = float(sum.flux[c]);
        for (int axis = 0; axis < 3; ++axis)
            made.places[k * 3 + axis] =
                sum.weight > 0 ? float(sum.place[axis] / sum.weight) : node.centre[axis];
    }
    return made;
}

}  // namespace relit
