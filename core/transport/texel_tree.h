// The octree over the texels of a height map, and the sums at all of them. For transport.h.
#pragma once

#include <cstdint>
#include <stop_token>
#include <vector>

#include "core/base/parallel.h"
#include "core/base/simd.h"
#include "core/transport/radial_kernel.h"
#include "core/transport/sample_tree.h"
#include "core/transport/transport_surface.h"

namespace relit {

class TexelTree {
public:
    /// @throws Error cancelled
    TexelTree(const TransportSurface& surface, const std::stop_token& stop, Simd simd);

    /// As Transport::sum(), without what a texel's own area adds; texels are summed in squares of
    /// 8 x 8, by TreeSum.
    /// @param threshold  of TreeSum
    [[nodiscard]] Image sum(const RadialKernel& kernel, float threshold, const Image& flux,
                            const Executor& executor, const std::stop_token& stop) const;
    [[nodiscard]] std::uint64_t bytes() const;

private:
    Simd simd_;
    std::vector<std::uint32_t> texels_;  // of the samples as they were given to the tree
    std::vector<std::uint32_t> place_;   // of texels in the tree's order; no_place where nothing is
    SampleTree tree_;
};

}  // namespace relit
