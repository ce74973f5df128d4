#include "core/transport/directional_tree.h"

#include <algorithm>
#include <cmath>

#include "core/transport/point_box.h"

namespace relit {
namespace {

constexpr int floats = kernels::directional_source_floats;

// Sums over samples, weighted by flux; made into the mean source.
struct SourceSums {
    double weight = 0, flux[3]{};
    double spread = 0;  // area seen from above
    Vec3 place, normal, inward;

    void add(const SourceSums& other) {
        weight += other.weight;
        spread += other.spread;
        for (int c = 0; c < 3; ++c) flux[c] += other.flux[c];
        place = place + other.place;
        normal = normal + other.normal;
        inward = inward + other.inward;
    }

    void store(float* source) const {
        const double share = weight > 0 ? 1 / weight : 0;
        const double size = length(normal);
        const Vec3 n = size > 1e-6 * weight ? (1 / size) * normal : Vec3{0, 0, 1};
        const Vec3 vectors[] = {share * place, n, share * inward};
        for (int k = 0; k < 3; ++k) {
            source[3 * k] = float(vectors[k].x);
            source[3 * k + 1] = float(vectors[k].y);
            source[3 * k + 2] = float(vectors[k].z);
        }
        for (int c = 0; c < 3; ++c) source[9 + c] = float(flux[c]);
        source[12] = float(spread);
    }
};

SourceSums sums_of(const float* source) {
    SourceSums s;
    for (int c = 0; c < 3; ++c) s.flux[c] = source[9 + c];
    s.weight = s.flux[0] + s.flux[1] + s.flux[2];
    s.spread = source[12];
    s.place = s.weight * Vec3{source[0], source[1], source[2]};
    s.normal = s.weight * Vec3{source[3], source[4], source[5]};
    s.inward = s.weight * Vec3{source[6], source[7], source[8]};
    return s;
}

bool is_dark(const float* source) { return source[9] == 0 && source[10] == 0 && source[11] == 0; }

}  // namespace

DirectionalTree::DirectionalTree(const SurfaceSamples& samples, std::span<const Vec3> normals,
                                 const std::stop_token& stop)
    : tree_(samples, stop) {
    normals_.reserve(normals.size());
    for (const std::uint32_t k : tree_.order()) normals_.push_back(normals[k]);
    for (const SampleTree::Node& node : tree_.nodes()) {
        const std::span<const Vec3> of_node = std::span(normals_).subspan(node.first, node.count);
        Vec3 mean;
        for (const Vec3& n : of_node) mean = mean + n;
        mean = normalized(mean);
        double least = 1;
        for (const Vec3& n : of_node) least = std::min(least, dot(mean, n));
        cones_.push_back(float(least));
    }
}

DirectionalTree::Light DirectionalTree::light(std::span<const float> flux,
                                              std::span<const float> inward) const {
    const std::span<const SampleTree::Node> nodes = tree_.nodes();
    const SurfaceSamples& s = tree_.samples();
    Light light;
    light.of_samples.resize(s.size() * floats);
    light.of_nodes.resize(nodes.size() * floats);
    for (std::size_t k = 0; k < s.size(); ++k) {
        const std::size_t from = tree_.order()[k] * std::size_t(3);
        const Vec3 n = normals_[k];
        const float source[] = {s.x[k],
                                s.y[k],
                                s.z[k],
                                float(n.x),
                                float(n.y),
                                float(n.z),
                                inward[from],
                                inward[from + 1],
                                inward[from + 2],
                                flux[from],
                                flux[from + 1],
                                flux[from + 2],
                                s.area[k] * float(n.z)};
        std::copy_n(source, floats, &light.of_samples[k * floats]);
    }
    // Children before their parents.
    std::vector<SourceSums> sums(nodes.size());
    for (std::size_t k = nodes.size(); k-- > 0;) {
        const SampleTree::Node& node = nodes[k];
        for (std::uint32_t p = node.first; node.is_leaf && p < node.first + node.count; ++p)
            sums[k].add(sums_of(&light.of_samples[p * std::size_t(floats)]));
        for (std::uint32_t child = std::uint32_t(k) + 1; !node.is_leaf && child < node.end;
             child = nodes[child].end)
            sums[k].add(sums[child]);
        sums[k].store(&light.of_nodes[k * floats]);
    }
    return light;
}

void DirectionalTree::gather(const Light& light, const kernels::PointGroup& points,
                             const OpeningRule& rule, std::vector<float>& sources) const {
    const PointBox box(points);
    const std::span<const SampleTree::Node> nodes = tree_.nodes();
    sources.clear();
    const auto add = [&](const float* source) {
        sources.insert(sources.end(), source, source + floats);
    };
    const auto counts_as_one = [&](std::size_t k, const float* source) {
        const SampleTree::Node& node = nodes[k];
        float nearest, farthest;
        box.distances(source, nearest, farthest);
        const float limit = rule.area * nearest;
        const float wide = 3 + 13 * rule.height / (nearest + rule.height);
        return node.area < limit && (cones_[k] >= rule.cone_cosine || wide * node.area < limit) &&
               !box.meets(node) && box.squared_distance_in_plane(node) > rule.near;
    };
    for (std::size_t k = 0; k < nodes.size();) {
        const SampleTree::Node& node = nodes[k];
        const float* source = &light.of_nodes[k * floats];
        if (is_dark(source) || box.squared_distance(node) > rule.range * rule.range) {
            k = node.end;
        } else if (counts_as_one(k, source)) {
            add(source);
            k = node.end;
        } else if (node.is_leaf) {
            for (std::size_t p = node.first; p < node.first + node.count; ++p)
                if (!is_dark(&light.of_samples[p * floats])) add(&light.of_samples[p * floats]);
            k = node.end;
        } else {
            ++k;
        }
    }
}

std::uint64_t DirectionalTree::bytes() const {
    return tree_.bytes() + normals_.size() * sizeof(Vec3) + cones_.size() * sizeof(float);
}

}  // namespace relit
