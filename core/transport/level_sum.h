// Sums of a radial kernel over a height map level by level: the kernel as a sum of ever smoother and
// wider ones, each on a grid as coarse as it is smooth. For transport.h; source: Brandt and Lubrecht
// 1990; Hardy and others 2015, "Multilevel summation method for electrostatic force evaluation".
#pragma once

#include <cmath>
#include <cstdint>
#include <memory>
#include <mutex>
#include <stop_token>
#include <vector>

#include "core/base/parallel.h"
#include "core/base/simd.h"
#include "core/transport/level_grid.h"
#include "core/transport/level_kernel.h"
#include "core/transport/radial_kernel.h"
#include "core/transport/transport_surface.h"

namespace relit {

/// Sums for one surface and kernel.
///
/// Level l has nodes every 2^l texels. Its kernel is g_l - g_{l+1}, where g_l(r) is the kernel from the
/// distance a_l = ratio 2^l on, and bends off smoothly towards 0; g of the first level is the kernel
/// itself, the last one's is not cut. Flux is carried from grid to grid by cubics in the plane and by its
/// moments in height, to second order; sums come back the same way. Error falls with the fourth power
/// of the ratio; time grows with its square. Heights that leave their node's by more than 0.4 a_l, at
/// cliffs, count as if they did not; a map can be taken apart at a height that most cliffs cross, into
/// sheets with grids of their own.
class LevelSum {
public:
    struct Settings {
        double ratio = 5;
        int first_level = 0;  ///< finer nodes are gathered: for texels much smaller than the kernel
        int sheets = 1;       ///< at most: the map taken apart at heights that most cliffs cross
    };

    /// @throws Error cancelled
    LevelSum(const TransportSurface& surface, const RadialKernel& kernel, Settings settings,
             const Executor& executor, const std::stop_token& stop, Simd simd);
    ~LevelSum();
    LevelSum(const LevelSum&) = delete;
    LevelSum& operator=(const LevelSum&) = delete;

    /// As Transport::sum(), without what a texel's own area adds.
    [[nodiscard]] Image sum(const Image& flux, const Executor& executor,
                            const std::stop_token& stop) const;
    /// What a sum needs besides its own result is kept for the next one, and counted.
    [[nodiscard]] std::uint64_t bytes() const;
    /// Share of what is carried from grid to grid whose heights differ by more than expansions reach,
    /// of the grids where it is largest: 0 but for cliffs.
    [[nodiscard]] double cliffs() const { return cliffs_; }

private:
    struct Planes;
    struct Workspace;
    class Halves;

    [[nodiscard]] double softening_of(int l) const { return std::ldexp(settings_.ratio, l); }
    [[nodiscard]] double reach_of(int l) const;
    void measure_cliffs(const Executor& executor, const std::stop_token& stop);
    void set_flux(const LevelGrid& texels, const Image& flux, Planes& planes,
                  const Executor& executor, const std::stop_token& stop) const;
    void take_sums(const LevelGrid& texels, const Planes& planes, Image& out,
                   const Executor& executor, const std::stop_token& stop) const;
    void halve_rows(const Planes& fine, const LevelGrid& from, Planes& coarse, const LevelGrid& to,
                    double reach, const Executor& executor, const std::stop_token& stop) const;
    void halve_columns(const Planes& fine, const LevelGrid& from, Planes& coarse,
                       const LevelGrid& to, double reach, const Executor& executor,
                       const std::stop_token& stop) const;
    void refine_columns(const Planes& coarse, const LevelGrid& from, Planes& fine,
                        const LevelGrid& to, double reach, const Executor& executor,
                        const std::stop_token& stop) const;
    void refine_rows(const Planes& coarse, const LevelGrid& from, Planes& fine, const LevelGrid& to,
                     double reach, const Executor& executor, const std::stop_token& stop) const;
    [[nodiscard]] std::unique_ptr<Workspace> take_workspace() const;
    void sum_level(int l, const Planes& sources, const LevelSheet& from, Planes& sums,
                   const LevelSheet& to, const Executor& executor,
                   const std::stop_token& stop) const;

    Settings settings_;
    Simd simd_;
    int channels_ = 0;
    int levels_ = 1;
    double cliffs_ = 0;
    double core_ = 0;  // of the kernel, texels
    double cut_ = 0;   // texels: the kernel's range, or the surface's extent
    std::vector<LevelSheet> sheets_;
    std::vector<LevelKernel> kernels_;  // by level
    mutable std::mutex mutex_;
    mutable std::unique_ptr<Workspace> spare_;  // of the last sum, for the next one
};

}  // namespace relit
