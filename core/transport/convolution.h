// Sums of a radial kernel over a height map as one 2D convolution: distances along the plane, which is
// exact for a plane and good where heights differ little. For transport.h; source: specification
// "translucency", 2.3. kissfft is behind it and included nowhere else.
#pragma once

#include <cstdint>
#include <stop_token>
#include <vector>

#include "core/base/parallel.h"
#include "core/image/image.h"
#include "core/image/large_pages.h"
#include "core/transport/radial_kernel.h"

namespace relit {

/// Smallest even number >= n that is a product of 2s, 3s and 5s, for fast transforms. @pre n >= 1
[[nodiscard]] int transform_size(int n);

/// A kernel's spectrum over a map padded with zeros: made once for a kernel and a size of map.
class KernelSpectrum {
public:
    /// Of the cells within kernel.short_range().
    /// @throws Error cancelled
    KernelSpectrum(const RadialKernel& kernel, int width, int height, const Executor& executor,
                   const std::stop_token& stop = {});

    [[nodiscard]] int channels() const { return channels_; }
    [[nodiscard]] int padded_width() const { return padded_width_; }
    [[nodiscard]] int padded_height() const { return padded_height_; }
    [[nodiscard]] std::uint64_t bytes() const { return values_.size() * sizeof(float); }
    /// Real, as the kernel is symmetric: [channel][column 0..padded_width / 2][row].
    [[nodiscard]] const float* of_channel(int c) const {
        return values_.data() + std::size_t(c) * (padded_width_ / 2 + 1) * padded_height_;
    }

private:
    int channels_ = 0, padded_width_ = 0, padded_height_ = 0;
    Texels values_;
};

/// M = kernel * flux, of as many channels: one forward and one inverse transform each.
/// @param flux  the spectrum's size of map
/// @throws Error cancelled
[[nodiscard]] Image convolved(const KernelSpectrum& spectrum, const Image& flux,
                              const Executor& executor, const std::stop_token& stop = {});

}  // namespace relit
