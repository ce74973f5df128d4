// The inner loops of sums over surfaces, once per instruction set. For sample_tree.cpp, which makes the
// lists; nothing else calls them.
//
// Plain data only, no inline functions: what a header defines would be compiled once for each set.
#pragma once

namespace relit::kernels {

/// A RadialKernel's segments.
struct RadialTable {
    const float* segments = nullptr;
    int first = 0, last = 0;
};

/// Points that are summed for together.
inline constexpr int group_points = 64;

struct PointGroup {
    alignas(64) float x[group_points], y[group_points], z[group_points];
};

/// Floats of a source: x y z, then its flux per channel.
inline constexpr int source_floats = 6;
/// Floats of a distant source: x y z, then for each of three channels the coefficients of a cubic in
/// r^2 - u, u being the next float.
inline constexpr int distant_floats = 16;

/// Adds to `sums` [channel][point] what the sources give at each point, in the order of the lists.
using GroupSum = void(const RadialTable& table, int channels, const PointGroup& points,
                      const float* sources, int count, const float* distant, int distant_count,
                      float* sums);

GroupSum sum_group_portable;
GroupSum sum_group_avx2;
GroupSum sum_group_avx512;

}  // namespace relit::kernels
