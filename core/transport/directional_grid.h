// Sums of the directional dipole over a grid of surface samples: what is near by taps over parts of the
// neighbours' cells, what is far by an octree. For directional_sum.cpp, which makes grids.
#pragma once

#include <array>
#include <cstdint>
#include <stop_token>
#include <vector>

#include "core/base/parallel.h"
#include "core/base/simd.h"
#include "core/image/image.h"
#include "core/scatter/directional_dipole.h"
#include "core/transport/directional_cell.h"
#include "core/transport/directional_tree.h"

namespace relit {

/// A sample a texel; y up, x right.
struct DirectionalSurface {
    double spacing = 0;  ///< from texel to texel
    Image z;             ///< 1 channel
    Image area;          ///< 1 channel; 0 = nothing is there
    Image slopes;        ///< 2 channels: dz/dx and dz/dy within the cells
    Image normals;       ///< 3 channels, unit, z > 0: with a bump map, not those of the slopes
};

[[nodiscard]] inline std::uint64_t bytes_of(const DirectionalSurface& surface) {
    return (surface.z.values.size() + surface.area.values.size() + surface.slopes.values.size() +
            surface.normals.values.size()) *
           sizeof(float);
}

/// How exact sums are.
struct DirectionalRule {
    float area = 0;      ///< OpeningRule::area
    float cone_deg = 0;  ///< half the angle of a cone of normals that is opened
    /// Texels nearer than that many times their distance are summed by midpoints of `touching` x
    /// `touching` parts of their cells where they touch, of `near` x `near` parts where not.
    double near_texels = 0;
    int touching = 4, near = 1;
};

class DirectionalGrid {
public:
    /// @param dipoles  of red, green and blue, in scene units
    /// @throws Error cancelled
    DirectionalGrid(DirectionalSurface surface,
                    const std::array<scatter::DirectionalDipole, 3>& dipoles,
                    const DirectionalRule& rule, const Executor& executor,
                    const std::stop_token& stop, Simd simd);

    /// @param flux, inward  3 channels each, of the surface's size; finite. `inward` is read only where
    ///                      there is flux
    /// @return              numbers_of(terms) channels
    [[nodiscard]] Image sums(kernels::DirectionalTerms terms, const Image& flux,
                             const Image& inward, const Executor& executor,
                             const std::stop_token& stop) const;

    [[nodiscard]] const DirectionalSurface& surface() const { return surface_; }
    [[nodiscard]] std::uint64_t bytes() const;

private:
    struct Light;
    struct Scratch;
    [[nodiscard]] Light light(const Image& flux, const Image& inward) const;
    void set_taps(const DirectionalRule& rule);
    void set_planes();
    void add_group(int left, int top, const Light& light, Scratch& scratch, Image& out) const;
    void add_near(int row, const Light& light, Scratch& scratch, Image& out) const;
    void add_own(int row, const Image& flux, const Image& inward, Image& out) const;
    [[nodiscard]] std::ptrdiff_t place(int i, int j) const {
        return std::ptrdiff_t(j + margin_) * stride_ + i + margin_;
    }

    DirectionalSurface surface_;
    std::array<kernels::DirectionalColour, kernels::directional_colours> colours_;
    kernels::DirectionalBend bend_;
    std::vector<DirectionalCell> cells_;  // of the colours
    OpeningRule opening_;
    std::vector<kernels::DirectionalTap> taps_;
    int margin_ = 0;                     // texels around the planes
    std::ptrdiff_t stride_ = 0;          // of their rows
    std::size_t plane_ = 0;              // floats in one
    Texels planes_;                      // z, normals, slopes
    std::vector<std::uint32_t> texels_;  // of the samples
    DirectionalTree tree_;
    kernels::DirectionalGroupSum* sum_group_;
    kernels::DirectionalRowSum* sum_row_;
};

}  // namespace relit
