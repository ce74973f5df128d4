// What the directional dipole says of light that enters a texel and leaves it there: S_d is steep where
// r = 0, so that it counts by its mean over a disk of the texel's area. For directional_grid.cpp.
#pragma once

#include <array>

#include "core/scatter/directional_dipole.h"

namespace relit {

/// Of one colour; tables by quadrature, to 1 % of the mean.
class DirectionalCell {
public:
    /// Mean of max(0, S_d) over a disk that lies flat, of any exit normal n near the disk's N:
    /// constant + normal N.n + along p.n, p the part of w_12 along the disk.
    struct Mean {
        double constant = 0, normal = 0, along = 0;
    };

    DirectionalCell() = default;
    /// @param least_area  smallest area that is asked for, > 0, in the dipole's unit
    DirectionalCell(const scatter::DirectionalDipole& dipole, double least_area);

    /// @param down     -w_12.N: the cosine of the refracted light, or a mean of several
    /// @param area     of the disk; beyond 256 times the least one all light stays on it
    /// @param stretch  of an ellipse in place of the disk, one axis over the other, >= 1: by the disks of its
    ///                 radii, as if light went all ways alike. Its area over that is at least the least one
    [[nodiscard]] Mean at(double down, double area, double stretch) const;

private:
    [[nodiscard]] Mean of_disk(double down, double area) const;

    static constexpr int areas = 17, per_doubling = 2, cosines = 9;
    double least_area_ = 0;
    std::array<std::array<Mean, areas>, cosines> means_{};
};

}  // namespace relit
