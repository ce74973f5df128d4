// How much of the flux that enters a surface at one point leaves it at another, as a function of their
// distance alone: the profile of a dipole, of normalised diffusion, e^{-sigma r} of a highlight. For
// everything that sums such a function over a surface, which reads it from a table.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "core/image/large_pages.h"

namespace relit {

/// A function of distance and its integral over a disk of the plane, of one channel.
struct RadialProfile {
    std::function<double(double)> at;      ///< of r > 0; finite
    std::function<double(double)> within;  ///< integral over the disk of that radius
    double total = 0;                      ///< within(infinity)
};

/// Of anything with at(r), within(a) and total(), as the profiles of core/scatter.
template <class Profile>
[[nodiscard]] RadialProfile radial_profile(const Profile& p) {
    return {[p](double r) { return p.at(r); }, [p](double a) { return p.within(a); }, p.total()};
}

/// Profiles of 1 to 3 channels as a table over r^2, averaged over the cells of a grid.
///
/// What is tabulated is not the profile itself but its mean over a square cell of the grid that the
/// samples of a surface stand for (4 x 4 midpoints), and at r = 0 over the disk of the cell's area, by
/// `within`: otherwise a grid as coarse as the profile is narrow creates or loses energy. Where cells
/// are much smaller than the profile is wide this changes nothing: 0.2 % of a sum with 4 cells to a
/// mean free path, which is the sum's own error. Averaging fades out from 4 to 8 cells, and where few
/// cells hold most of the whole, numbers within 4 cells are scaled so that the cells of a plane add up to it.
///
/// Linear in r^2 between 512 points an octave that the leading bits of r^2 as a float select: reading it
/// takes no root, division or exponential. Relative error of a table's number: 1e-5 down to e^{-6} of
/// the profile's own exponential. 0 from where less than 1e-6 of the total lies beyond.
class RadialKernel {
public:
    static constexpr int max_channels = 3;
    static constexpr int stride = 8;  ///< floats per segment: offsets, then slopes from 4 on
    static constexpr int segment_shift = 14;  ///< bits of a float's r^2 below a segment's index

    /// @param channels  1 or 3 profiles, in scene units
    /// @param spacing   side of the grid's cells, > 0
    /// @param extent    no two samples are farther apart; the table goes on to 2.5 times that
    RadialKernel(std::span<const RadialProfile> channels, double spacing, double extent);

    [[nodiscard]] int channels() const { return channels_; }
    [[nodiscard]] double spacing() const { return spacing_; }
    /// 0 from here on, in all channels.
    [[nodiscard]] double range() const { return range_; }
    /// Less than 1e-3 of the total lies beyond, in all channels.
    [[nodiscard]] double short_range() const { return short_range_; }
    /// Where the number of some channel has fallen to 2^{-3/2} of that at 0: of a dipole about a mean free
    /// path. How fine a grid has to be that holds the kernel.
    [[nodiscard]] double core() const { return core_; }
    /// Of channel `c`, as the table has it.
    [[nodiscard]] float at_squared(int c, float r_squared) const {
        const float* segment = segments_.data() + std::size_t(index_of(r_squared)) * stride;
        return segment[c] + segment[4 + c] * r_squared;
    }
    [[nodiscard]] double at(int c, double r) const { return at_squared(c, float(r * r)); }
    /// What is to be added for a sample at its own place: its area, which is the cell's only where the
    /// surface lies flat, counts as a disk. In units of at().
    [[nodiscard]] double at_own_place(int c, double area) const;

    /// @param r_squared  >= 0, finite
    [[nodiscard]] int index_of(float r_squared) const;
    /// Segments of `stride` floats: number = offset + slope * r^2.
    [[nodiscard]] std::span<const float> segments() const { return segments_; }
    [[nodiscard]] int first_segment() const { return first_; }
    [[nodiscard]] int last_segment() const { return last_; }
    [[nodiscard]] std::uint64_t bytes() const { return segments_.size() * sizeof(float); }

private:
    void fill(int c, const RadialProfile& profile);
    [[nodiscard]] double core_of(int c) const;

    int channels_ = 0;
    double spacing_ = 0, range_ = 0, core_ = 0;
    int first_ = 0;  // the bits of the first segment
    int last_ = 0;   // index of the last segment, which is 0
    double short_range_ = 0;
    Texels segments_;
    // Mean over the disk of a sample's area, by area: 0 to own_areas doublings of a flat cell's.
    static constexpr int own_areas = 16, own_steps = 8;
    std::array<std::vector<double>, max_channels> own_;
};

}  // namespace relit
