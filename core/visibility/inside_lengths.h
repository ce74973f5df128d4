// r of many rays towards one light: inside_length() for a whole tile of texels, in packets. For
// render/. Sources: integrated model, section 2; the march itself is in kernels/packet.h.
#pragma once

#include <memory>
#include <span>

#include "core/base/parallel.h"
#include "core/base/simd.h"
#include "core/field/solid.h"
#include "core/visibility/kernels/march.h"
#include "core/visibility/ray.h"

namespace relit {

/// Where rays go.
struct RayTarget {
    Vec3 at;                   ///< position in scene units, or unit direction
    bool at_infinity = false;  ///< `at` is a direction
};

inline Ray ray_to(const RayTarget& target, Vec3 from) {
    return target.at_infinity ? ray_along(from, target.at) : ray_to_point(from, target.at);
}

/// A solid as packets of rays see it: copies of its surface by rows and by columns, and bounds of
/// blocks of it. Made once per solid.
class PacketSolid {
public:
    PacketSolid(const Solid& solid, const Executor& executor, Simd simd = best_simd());
    ~PacketSolid();
    PacketSolid(const PacketSolid&) = delete;
    PacketSolid& operator=(const PacketSolid&) = delete;

    /// r of every ray as inside_length() defines it, into `r`.
    ///
    /// As exact as floats are (d within 1e-5), but for ways in and out between two rows of the grid
    /// far from the start, of which a few are missed on rough maps. A ray's r is the same to
    /// the last bit whatever other rays are asked for, in any order, with any Simd. Fastest for
    /// rays that start in a tile of 16 x 16 texels. Allocates nothing; safe from any thread.
    /// @pre from.size() == r.size()
    void inside_lengths(const RayTarget& target, std::span<const Vec3> from,
                        std::span<double> r) const noexcept;

    /// Size in memory, without the solid's.
    [[nodiscard]] std::uint64_t bytes() const;

private:
    struct Copy;  // of the surface, one way round
    const Solid& solid_;
    std::unique_ptr<const Copy> by_rows_, by_columns_;
    kernels::Scenery scenery_;
    kernels::March* march_;
};

}  // namespace relit
