// Sums for a group of points, written once over the wide types of base/wide; each sums_*.cpp compiles it
// for its instruction set. A point's numbers come from its own lane alone: the same bytes for any set.
#pragma once

#include "core/transport/kernels/sums.h"

namespace relit::kernels {
namespace {

constexpr int bits_below_segment = 14;  // RadialKernel::segment_shift

// Where segments begin of r^2.
RELIT_INLINE Ints places_of(const RadialTable& table, Floats r_squared) {
    const Ints index = shifted_right(bits_of(r_squared), bits_below_segment);
    return shifted_left<3>(clamped(index - broadcast(table.first), 0, table.last));
}

template <int channels>
RELIT_INLINE void sum_part(const RadialTable& table, const PointGroup& points, int first,
                           const float* sources, int count, const float* distant, int distant_count,
                           float* sums) {
    const Floats x = load(points.x + first), y = load(points.y + first), z = load(points.z + first);
    const auto r_squared = [&](const float* from) RELIT_INLINE_LAMBDA {
        const Floats dx = x - broadcast(from[0]), dy = y - broadcast(from[1]);
        const Floats dz = z - broadcast(from[2]);
        return dx * dx + dy * dy + dz * dz;
    };
    Floats sum[channels];
    for (int c = 0; c < channels; ++c) sum[c] = load(sums + c * group_points + first);
    for (int k = 0; k < count; ++k, sources += source_floats) {
        const Floats u = r_squared(sources);
        const Ints at = places_of(table, u);
        for (int c = 0; c < channels; ++c) {
            const Floats value =
                gather(table.segments + c, at) + gather(table.segments + 4 + c, at) * u;
            sum[c] = sum[c] + value * broadcast(sources[3 + c]);
        }
    }
    for (int k = 0; k < distant_count; ++k, distant += distant_floats) {
        const Floats t = r_squared(distant) - broadcast(distant[3]);
        for (int c = 0; c < channels; ++c) {
            const float* of = distant + 4 + 4 * c;
            const Floats cubic = broadcast(of[2]) + t * broadcast(of[3]);
            sum[c] = sum[c] + (broadcast(of[0]) + t * (broadcast(of[1]) + t * cubic));
        }
    }
    for (int c = 0; c < channels; ++c) store(sums + c * group_points + first, sum[c]);
}

RELIT_INLINE void sum_group(const RadialTable& table, int channels, const PointGroup& points,
                            const float* sources, int count, const float* distant,
                            int distant_count, float* sums) {
    for (int first = 0; first < group_points; first += lanes)
        if (channels == 1)
            sum_part<1>(table, points, first, sources, count, distant, distant_count, sums);
        else sum_part<3>(table, points, first, sources, count, distant, distant_count, sums);
}

}  // namespace
}  // namespace relit::kernels
