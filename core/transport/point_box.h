// The box around a group of points that sums are made for together, as walks of the octree see it. For
// tree_sum.cpp and directional_tree.cpp.
#pragma once

#include <algorithm>

#include "core/transport/kernels/sums.h"
#include "core/transport/sample_tree.h"

namespace relit {

/// Around the points; positions in lists count from its centre.
struct PointBox {
    float low[3], high[3], centre[3];

    explicit PointBox(const kernels::PointGroup& points) {
        const float* const axes[] = {points.x, points.y, points.z};
        for (int axis = 0; axis < 3; ++axis) {
            const auto [l, h] = std::minmax_element(axes[axis], axes[axis] + kernels::group_points);
            low[axis] = *l;
            high[axis] = *h;
            centre[axis] = (*l + *h) / 2;
        }
    }

    /// Squared distances from `place` to its nearest and its farthest point.
    void distances(const float* place, float& nearest, float& farthest) const {
        nearest = farthest = 0;
        for (int axis = 0; axis < 3; ++axis) {
            const float below = low[axis] - place[axis], above = place[axis] - high[axis];
            const float outside = std::max({below, above, 0.0f});
            const float across = std::max(high[axis] - place[axis], place[axis] - low[axis]);
            nearest += outside * outside;
            farthest += across * across;
        }
    }

    [[nodiscard]] bool meets(const SampleTree::Node& node) const {
        for (int axis = 0; axis < 3; ++axis)
            if (node.high[axis] < low[axis] || high[axis] < node.low[axis]) return false;
        return true;
    }

    [[nodiscard]] float squared_distance(const SampleTree::Node& node) const {
        return squared_distance(node, 3);
    }
    /// As seen from above.
    [[nodiscard]] float squared_distance_in_plane(const SampleTree::Node& node) const {
        return squared_distance(node, 2);
    }

private:
    [[nodiscard]] float squared_distance(const SampleTree::Node& node, int axes) const {
        float sum = 0;
        for (int axis = 0; axis < axes; ++axis) {
            const float outside =
                std::max({low[axis] - node.high[axis], node.low[axis] - high[axis], 0.0f});
            sum += outside * outside;
        }
        return sum;
    }
};

}  // namespace relit
