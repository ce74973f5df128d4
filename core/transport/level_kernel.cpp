#include "core/transport/level_kernel.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>

namespace relit {
namespace {

// r^2 for which the softened kernel has the kernel's value: C^2 at a^2, a^2/3 at 0.
double softened(double u, double a) {
    const double t = u / (a * a);
    if (t >= 1) return u;
    return a * a * (t + std::pow(1 - t, 3) / 3);
}

// a + b w + c w^2 through the values at the three Chebyshev points of [low, high].
template <class Value>
void fit(double low, double high, const Value& value, float* a, float* b, float* c) {
    const double middle = (low + high) / 2, away = (high - low) / 2 * 0.86602540378443865;
    const double below = value(middle - away), centre = value(middle), above = value(middle + away);
    const double curve = (above + below - 2 * centre) / (2 * away * away);
    const double slope = (above - below) / (2 * away);
    *c = float(curve);
    *b = float(slope - 2 * curve * middle);
    *a = float(centre - slope * middle + curve * middle * middle);
}

}  // namespace

// The kernel of one level between nodes at every offset, as pieces over their difference in height.
LevelKernel level_kernel(const RadialKernel& kernel, const LevelOfKernel& level) {
    LevelKernel made;
    const bool is_first = level.is_first, is_last = level.is_last;
    const int channels = kernel.channels();
    const double core = kernel.core() / kernel.spacing();
    const double spacing = kernel.spacing(), node = std::exp2(level.level);
    // The last one's nodes lie around the map as well.
    const double a = level.softening;
    const double cut =
        std::min(kernel.range() / spacing, is_last ? level.extent + 6 * node : 2 * a);
    const double start = is_first ? std::clamp(core * core / 2, 0.1, a * a / 4) : a * a / 4;
    const auto at = [&](int c, double u) {
        return double(kernel.at_squared(c, float(u * spacing * spacing)));
    };
    const auto value = [&](int c, double u) {
        const double own = is_first ? at(c, u) : at(c, softened(u, a));
        return is_last ? own : own - at(c, softened(u, 2 * a));
    };
    const int reach = int(cut / node);
    std::map<int, std::size_t> places;  // pieces by squared offset
    for (int dy = -reach; dy <= reach; ++dy)
        for (int dx = -reach; dx <= reach; ++dx) {
            const int squared = dx * dx + dy * dy;
            const double s = squared * node * node;
            if (s >= cut * cut) continue;
            kernels::LevelOffset offset{.dx = dx, .dy = dy, .start = float(s + start)};
            const double low = s + start;
            const double high = std::min(cut * cut, s + level.relief * level.relief) + start;
            const auto piece = [&](double w, int shift) {
                return std::bit_cast<int>(float(w)) >> shift;
            };
            while (piece(high, offset.shift) - piece(low, offset.shift) > kernels::level_pieces - 2)
                ++offset.shift;
            offset.first = piece(low, offset.shift);
            const auto [place, is_new] = places.try_emplace(squared, made.pieces.size());
            if (is_new) {
                made.pieces.resize(made.pieces.size() + std::size_t(channels) * 96, 0.0f);
                float* pieces = &made.pieces[place->second];
                for (int k = 0; k <= piece(high, offset.shift) - offset.first; ++k) {
                    const auto bound = [&](int p) {
                        return double(std::bit_cast<float>((offset.first + p) << offset.shift));
                    };
                    const double from = std::max(low, bound(k));
                    const double to = std::max(std::min(bound(k + 1), high), from * (1 + 1.0 / 64));
                    for (int c = 0; c < channels; ++c)
                        fit(
                            from, to, [&](double w) { return value(c, std::max(w - start, 0.0)); },
                            pieces + 96 * c + k, pieces + 96 * c + 32 + k,
                            pieces + 96 * c + 64 + k);
                }
            }
            made.offsets.push_back(offset);
        }
    for (kernels::LevelOffset& offset : made.offsets)
        offset.pieces = &made.pieces[places.at(offset.dx * offset.dx + offset.dy * offset.dy)];
    return made;
}

}  // namespace relit
