// r of many rays towards one light: inside_length() for a whole tile of texels, in packets. For
// render/. Sources: integrated model, section 2; the march itself is in kernels/steps.h.
#pragma once

#include <array>
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

/// Starts of rays, near texels of one square of the map.
struct RayTile {
    static constexpr int side = kernels::tile_side;  ///< of the square, texels
    static constexpr int max_rays = side * side;

    int column = 0,
        row = 0;    ///< the square's texel at the upper left, from whose centre they count
    int count = 0;  ///< max_rays: those of the whole square, row by row
    /// Texels to the right and down, z in scene units.
    alignas(64) std::array<float, max_rays> right, down, z;
};

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
    /// As exact as floats are (d within 1e-5). A ray's r is the same to the last bit whatever other
    /// rays are asked for, in any order, with any Simd. Fastest for rays that start in a tile of
    /// 16 x 16 texels. Allocates nothing; safe from any thread.
    /// @pre from.size() == r.size()
    void inside_lengths(const RayTarget& target, std::span<const Vec3> from,
                        std::span<double> r) const noexcept;

    /// Size in memory, without the solid's.
    [[nodiscard]] std::uint64_t bytes() const;

    /// The same for a tile, several times as fast.
    /// @param r  tile.count numbers in scene units; infinity where it is endless
    void inside_lengths(const RayTarget& target, const RayTile& tile,
                        std::span<float> r) const noexcept;

private:
    struct Copy;  // of the surface, one way round
    const Solid& solid_;
    std::unique_ptr<const Copy> by_rows_, by_columns_;
    kernels::Scenery scenery_;
    kernels::March* march_;
    kernels::TileMarch* march_tile_;

    void fill_left(const RayTarget& target, const RayTile& tile, std::span<float> r) const noexcept;
    [[nodiscard]] kernels::Scenery lit_by(const RayTarget& target) const;
};

}  // namespace relit
