// Sums of a radial kernel over a cloud of surface samples, by an octree: what is far away counts as one
// sample. For height fields and whatever else has samples. Source: Jensen and Buhler 2002, section 4;
// specification "translucency", 2.2.
#pragma once

#include <cstdint>
#include <span>
#include <stop_token>
#include <vector>

#include "core/transport/radial_kernel.h"

namespace relit {

/// Samples of a surface: positions and the areas they stand for, in scene units, of one length.
struct SurfaceSamples {
    std::vector<float> x, y, z, area;
    [[nodiscard]] std::size_t size() const { return x.size(); }
};

/// The octree's topology and geometry: what does not depend on light.
class SampleTree {
public:
    static constexpr int leaf_size = 8, max_depth = 20;

    /// A cube with its samples, which lie in a row in the tree's order. Nodes lie in depth-first order:
    /// the first child of an inner node is the next one.
    struct Node {
        std::uint32_t first = 0, count = 0;  ///< samples
        std::uint32_t end = 0;               ///< the next node that is not below this one
        bool is_leaf = false;
        float area = 0;             ///< of all samples
        float low[3]{}, high[3]{};  ///< the cube
        float centre[3]{};          ///< of the samples, weighted by area
    };

    /// @throws Error cancelled
    explicit SampleTree(const SurfaceSamples& samples, const std::stop_token& stop = {});

    [[nodiscard]] std::span<const Node> nodes() const { return nodes_; }
    /// The samples in the tree's order, and where each was in the order they were given in.
    [[nodiscard]] const SurfaceSamples& samples() const { return samples_; }
    [[nodiscard]] std::span<const std::uint32_t> order() const { return order_; }
    [[nodiscard]] std::uint64_t bytes() const;

private:
    void add_node(std::uint32_t first, std::uint32_t count, int depth, const float* low,
                  std::span<const std::uint64_t> codes);

    std::vector<Node> nodes_;
    SurfaceSamples samples_;
    std::vector<std::uint32_t> order_;
    float size_ = 0;  // of the root
};

/// One light's flux in a tree: of every sample, and of every node with the place it counts at.
struct TreeFlux {
    int channels = 0;
    std::vector<float> of_samples;  ///< [sample in the tree's order][channel]
    std::vector<float> of_nodes;    ///< [node][channel]
    std::vector<float> places;      ///< [node][x y z]: mean weighted by flux, by area where it is 0
};

/// @param flux  [sample as given][channel], finite
[[nodiscard]] TreeFlux tree_flux(const SampleTree& tree, std::span<const float> flux, int channels);

}  // namespace relit
