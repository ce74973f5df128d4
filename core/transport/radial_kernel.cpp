#include "core/transport/radial_kernel.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>

namespace relit {
namespace {

using std::numbers::pi;

constexpr int segments_per_octave = 1 << (23 - RadialKernel::segment_shift);
constexpr int exact_per_octave = 32;  // the rest is interpolated

int bits_of(float r_squared) {
    return std::bit_cast<int>(r_squared) >> RadialKernel::segment_shift;
}

float start_of(int bits) { return std::bit_cast<float>(bits << RadialKernel::segment_shift); }

constexpr double negligible = 1e-6;

// Where less than a share of the total lies beyond, at most `extent`.
double range_of(const RadialProfile& profile, double share, double extent) {
    const auto is_beyond = [&](double r) {
        return profile.within(r) >= profile.total * (1 - share);
    };
    if (!(profile.total < std::numeric_limits<double>::infinity()) || !is_beyond(extent))
        return extent;
    double low = 0, high = extent;
    for (int k = 0; k < 40; ++k) {
        const double middle = (low + high) / 2;
        (is_beyond(middle) ? high : low) = middle;
    }
    return high;
}

// The mean over a cell that lies at `r`, turned by an eighth of a right angle's half: neither along
// its axes nor its diagonals.
double mean_of_cell(const RadialProfile& profile, double r, double spacing) {
    const double cos = std::cos(pi / 8), sin = std::sin(pi / 8);
    double sum = 0;
    for (const double a : {-0.375, -0.125, 0.125, 0.375})
        for (const double b : {-0.375, -0.125, 0.125, 0.375})
            sum += profile.at(std::max(
                std::hypot(r + spacing * (a * cos - b * sin), spacing * (a * sin + b * cos)),
                spacing / 64));
    return sum / 16;
}

// A profile averaged over cells.
struct Averaged {
    const RadialProfile& profile;
    double spacing;
    double centre = 0;      // the mean over the disk of a cell's area
    double correction = 0;  // what midpoints lack at 0
    double sum_excess = 0;  // what is to be added near 0 for the cells to add up to the whole

    Averaged(const RadialProfile& p, double h, double range) : profile(p), spacing(h) {
        centre = profile.within(h / std::sqrt(pi)) / (h * h);
        correction = centre - mean_of_cell(profile, 0, h);
        // Where a few cells hold most of the whole, they need not add up to it.
        const double share = profile.within(4 * h) / profile.total;
        const double t = std::clamp((share - 0.3) / 0.2, 0.0, 1.0);
        if (t > 0) sum_excess = t * t * (3 - 2 * t) * missing(std::clamp(range / h, 16.0, 64.0));
    }

    // By what share numbers near 0 fall short, under a window of that many cells that ends smoothly.
    [[nodiscard]] double missing(double radius) const {
        const auto window = [&](double cells) {
            return std::pow(1 - cells * cells / (radius * radius), 2);
        };
        double sum = 0, near = 0, exact = 0;
        for (int dy = 0; dy < radius; ++dy)
            for (int dx = dy; dx * dx + dy * dy < radius * radius; ++dx) {
                const double cells = std::hypot(dx, dy);
                const int alike = dx == 0 ? 1 : dy == 0 || dy == dx ? 4 : 8;
                const double value = alike * window(cells) * (*this)(cells * spacing);
                sum += value;
                near += value * nearness(cells);
            }
        constexpr int steps = 1000;
        for (int k = 0; k < steps; ++k)
            exact += profile.within((k + 0.5) / steps * radius * spacing) *
                     (window(double(k) / steps * radius) - window((k + 1.0) / steps * radius));
        return (exact / (spacing * spacing) - sum) / near;
    }

    static double nearness(double cells) {
        return cells < 4 ? std::pow(1 - cells * cells / 16, 2) : 0;
    }

    double operator()(double r) const {
        const double cells = r / spacing;
        if (cells >= 8) return profile.at(r);
        double mean = mean_of_cell(profile, r, spacing);
        if (cells <= 1) mean += correction * std::pow(1 - cells * cells, 2);
        if (cells <= 4) return mean * (1 + sum_excess * nearness(cells));
        const double t = (cells - 4) / 4, fade = t * t * (3 - 2 * t);
        return mean + fade * (profile.at(r) - mean);
    }
};

// Cubic through four equidistant points at the place t between the middle ones.
double between(const double* p, double t) {
    const double a = p[0], b = p[1], c = p[2], d = p[3];
    return b * (1 - t * t) * (1 - t / 2) - a * t * (1 - t) * (2 - t) / 6 +
           c * t * (1 + t) * (2 - t) / 2 - d * t * (1 - t * t) / 6;
}

}  // namespace

RadialKernel::RadialKernel(std::span<const RadialProfile> channels, double spacing, double extent)
    : channels_(int(channels.size())), spacing_(spacing) {
    assert(channels_ == 1 || channels_ == 3);
    assert(spacing > 0 && extent >= 0);
    for (const RadialProfile& profile : channels)
        range_ = std::max(range_, range_of(profile, negligible, 2.5 * extent + spacing));
    range_ = std::max(range_, 2 * spacing);
    for (const RadialProfile& profile : channels)
        short_range_ = std::max(short_range_, range_of(profile, 1e-3, range_));
    short_range_ = std::max(short_range_, 2 * spacing);
    const double least = spacing / 8;
    first_ = bits_of(float(least * least)) / segments_per_octave * segments_per_octave;
    last_ = bits_of(float(range_ * range_)) + 1 - first_;
    segments_.assign(std::size_t(last_ + 1) * stride, 0.0f);
    for (int c = 0; c < channels_; ++c) fill(c, channels[c]);
    core_ = range_;
    for (int c = 0; c < channels_; ++c) core_ = std::min(core_, core_of(c));
}

double RadialKernel::core_of(int c) const {
    const float least = std::exp2(-1.5f) * at_squared(c, 0);
    int k = 0;
    while (k < last_ && at_squared(c, start_of(first_ + k)) > least) ++k;
    return std::sqrt(start_of(first_ + k));
}

void RadialKernel::fill(int c, const RadialProfile& profile) {
    const Averaged averaged(profile, spacing_, range_of(profile, negligible, range_));
    // Logarithms at points that are equidistant in the logarithm of r^2, the first one before the table.
    const double least = start_of(first_);
    const int points = 5 + int(exact_per_octave * std::log2(start_of(first_ + last_) / least));
    std::vector<double> exact;
    for (int k = -1; k < points; ++k) {
        const double value = averaged(std::sqrt(least * std::exp2(double(k) / exact_per_octave)));
        exact.push_back(std::log(std::max(value, 1e-300)));
    }
    const double own_range = range_of(profile, negligible, range_);
    const auto value_at = [&](double u) {
        const double place = exact_per_octave * std::log2(u / least);
        const int k = int(place);
        return std::exp(between(&exact[k], place - k));
    };
    double left = averaged(0), left_u = 0;
    for (int k = 0; k < last_; ++k) {
        const double right_u = start_of(first_ + k + 1);
        const double right = value_at(right_u);
        const double slope = (right - left) / (right_u - left_u);
        if (left_u <= own_range * own_range) {
            segments_[std::size_t(k) * stride + c] = float(left - slope * left_u);
            segments_[std::size_t(k) * stride + 4 + c] = float(slope);
        }
        left = right;
        left_u = right_u;
    }
    const double cell = spacing_ * spacing_;
    for (int k = 0; k <= own_areas * own_steps; ++k) {
        const double area = cell * std::exp2(double(k) / own_steps);
        own_[c].push_back(averaged(0) *
                          (profile.within(std::sqrt(area / pi)) / area / averaged.centre - 1));
    }
}

int RadialKernel::index_of(float r_squared) const {
    return std::clamp(bits_of(r_squared) - first_, 0, last_);
}

double RadialKernel::at_own_place(int c, double area) const {
    const double place = own_steps * std::log2(area / (spacing_ * spacing_));
    const double clamped = std::clamp(place, 0.0, double(own_areas * own_steps) - 1e-9);
    const int k = int(clamped);
    return own_[c][k] + (clamped - k) * (own_[c][k + 1] - own_[c][k]);
}

}  // namespace relit
