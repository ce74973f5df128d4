// Sums by an octree for points that lie near each other, in one walk of the tree for all of them. For
// transport.h; source: as sample_tree.h.
#pragma once

#include <span>
#include <vector>

#include "core/base/simd.h"
#include "core/transport/kernels/sums.h"
#include "core/transport/radial_kernel.h"
#include "core/transport/sample_tree.h"

namespace relit {

struct PointBox;

/// Sums over one tree and flux.
///
/// The rule that opens nodes is Jensen and Buhler's, for all points of a group at once: a node counts as
/// one sample where no point lies in its cube and its area / d^2 < threshold, d being the least distance
/// from its place to the box around the points. A group's sums are therefore a little closer to the
/// exact ones than its points' own would be. What counts from so far away that the kernel hardly bends
/// from point to point is a cubic in r^2: within 1e-4 of the table, and most of it.
class TreeSum {
public:
    /// All of them outlive this.
    TreeSum(const SampleTree& tree, const TreeFlux& flux, const RadialKernel& kernel,
            float threshold, Simd simd);

    /// Memory that one thread needs from group to group.
    struct Lists {
        std::vector<float> sources, distant;
    };

    /// @param points  all 64; what is of no interest is a copy of what is
    /// @param sums    [channel][point], set
    void operator()(const kernels::PointGroup& points, Lists& lists, std::span<float> sums) const;

private:
    void gather(const PointBox& box, Lists& lists) const;
    void add_source(const PointBox& box, const float* place, const float* flux, Lists& lists) const;
    void add_distant(const PointBox& box, const float* place, const float* flux, double low,
                     double high, Lists& lists) const;

    const SampleTree& tree_;
    const TreeFlux& flux_;
    const RadialKernel& kernel_;
    float threshold_;
    kernels::GroupSum* sum_group_;
};

}  // namespace relit
