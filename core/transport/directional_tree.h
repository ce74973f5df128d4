// The octree of the directional dipole's sums: nodes know how their surface lies and where their light
// goes. For directional_grid.cpp. Source: specification "translucency", sections 2.2 and 3 (b).
#pragma once

#include <cstdint>
#include <span>
#include <stop_token>
#include <vector>

#include "core/base/vec.h"
#include "core/transport/kernels/directional.h"
#include "core/transport/sample_tree.h"

namespace relit {

/// When a node counts as one sample for a group of points.
struct OpeningRule {
    float area = 0;  ///< its area is less than this times the squared distance to the group
    /// Half the angle of its cone of normals, as a cosine. Any will do where the area is less than area/16
    /// times that distance, and beyond the virtual source's height less than area/3: normals matter less.
    float cone_cosine = 0;
    float height = 0;  ///< square of that height
    float near = 0;    ///< squared distance in the plane within which all are samples
    float range = 0;   ///< beyond this distance nothing counts
};

class DirectionalTree {
public:
    /// @param normals  unit, of every sample
    /// @throws Error cancelled
    DirectionalTree(const SurfaceSamples& samples, std::span<const Vec3> normals,
                    const std::stop_token& stop = {});

    /// What light brings, at every sample and node as a list of sources has it; nodes' normals and
    /// directions are means weighted by flux.
    struct Light {
        std::vector<float> of_samples, of_nodes;  ///< kernels::directional_source_floats each
    };
    /// @param flux, inward  [sample as given][3]
    [[nodiscard]] Light light(std::span<const float> flux, std::span<const float> inward) const;

    /// Sets `sources` to what counts for all of `points`.
    void gather(const Light& light, const kernels::PointGroup& points, const OpeningRule& rule,
                std::vector<float>& sources) const;

    [[nodiscard]] std::uint64_t bytes() const;

private:
    SampleTree tree_;
    std::vector<Vec3> normals_;  // in the tree's order
    std::vector<float> cones_;   // of nodes: the least cosine between a normal and their mean
};

}  // namespace relit
