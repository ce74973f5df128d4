// Light that enters a surface at one place and leaves it at others: for every texel of a height map the
// sum of a radial kernel over all of it. For the renderer, which says what flux enters (translucency)
// or is reflected (highlights carried below the surface). Source: specification "translucency",
// sections 2.1 to 2.3 and 5.3; Jensen and Buhler 2002; Brandt and Lubrecht 1990.
#pragma once

#include <cstdint>
#include <memory>
#include <stop_token>
#include <string_view>

#include "core/base/parallel.h"
#include "core/base/simd.h"
#include "core/transport/radial_kernel.h"
#include "core/transport/transport_surface.h"

namespace relit {

enum class TransportAccuracy {
    /// While something is dragged: 0.2 to 2.5 % off (RMS, relative), beside cliffs 10 % and more.
    preview,
    final,  ///< a relative RMS error of at most 0.5 % of the exact sum
    exact,  ///< the tree with an opening threshold of 0.02 whatever it costs
};

/// How a sum is made.
enum class TransportPath {
    convolution,  ///< one 2D convolution by FFT: distances along the plane
    levels,       ///< level by level on ever coarser grids: LevelSum
    tree,         ///< octree over the samples
};
[[nodiscard]] std::string_view name_of(TransportPath path);

/// Everything that sums for one surface and one kernel need but the flux: made once, used for every
/// light, from any thread.
class Transport {
public:
    /// @param surface  at least one texel; heights and areas finite (asserted)
    /// @param kernel   made for the surface's spacing and extent
    /// @throws Error cancelled
    Transport(std::shared_ptr<const TransportSurface> surface,
              std::shared_ptr<const RadialKernel> kernel, TransportAccuracy accuracy,
              const Executor& executor, const std::stop_token& stop = {}, Simd simd = best_simd());
    ~Transport();
    Transport(const Transport&) = delete;
    Transport& operator=(const Transport&) = delete;

    [[nodiscard]] TransportPath path() const;
    [[nodiscard]] std::uint64_t bytes() const;  ///< in memory, for caches; surface and kernel apart

    /// M(x) = sum over texels p of kernel(|x - p|) flux(p), for every texel x; the kernel's cell
    /// averages are RadialKernel's. A texel's own flux counts by its own area.
    ///
    /// @param flux  finite, of as many channels as the kernel and the surface's size: irradiance that
    ///              enters times area; not read where the surface's area is 0
    /// @return      the same size and channels, 0 where the area is 0. The same bytes for any number
    ///              of threads and any instruction set
    /// @throws Error cancelled
    [[nodiscard]] Image sum(const Image& flux, const Executor& executor,
                            const std::stop_token& stop = {}) const;

private:
    struct Parts;
    std::unique_ptr<const Parts> parts_;
};

/// Both in one, for a kernel or a surface that is used once.
[[nodiscard]] Image transported(const TransportSurface& surface, const Image& flux,
                                const RadialKernel& kernel, TransportAccuracy accuracy,
                                const Executor& executor, const std::stop_token& stop = {});

}  // namespace relit
