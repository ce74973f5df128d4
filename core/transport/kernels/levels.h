// The inner loops of sums level by level, once per instruction set. For level_sum.cpp, which makes the
// grids and tables; nothing else calls them.
//
// Plain data only, no inline functions: what a header defines would be compiled once for each set.
#pragma once

namespace relit::kernels {

inline constexpr int max_channels = 3;
/// Pieces of a table; the last one is 0.
inline constexpr int level_pieces = 32;
/// Floats beyond a row's end that the loops may touch.
inline constexpr int level_overrun = 16;

/// The kernel between nodes that lie (dx, dy) apart, of squared distance s in the plane: a function of
/// w = dz^2 + start in pieces that the leading bits of w select, per channel a + b w + c w^2.
struct LevelOffset {
    int dx = 0, dy = 0;
    float start = 0;
    int shift = 0, first = 0;       ///< piece = (bits of w >> shift) - first, the last one at most
    const float* pieces = nullptr;  ///< [channel][a, b, c][level_pieces]
};

/// Rows of one level. What a node holds stands in planes per channel: of sources the flux and its
/// moments about the node's height (the first, half the second), of sums the value and its derivatives
/// with respect to height (the first, the second).
struct LevelRows {
    const float* z = nullptr;         ///< of the row that is summed for
    const float* source_z = nullptr;  ///< of the sources' nodes at the same places
    long pitch = 0;                   ///< floats from row to row, in all planes
    int columns = 0;
    const float* sources[3][max_channels]{};
    float* sums[3][max_channels]{};
};

/// Adds to one row's sums what the nodes at all offsets give it. @pre rows that offsets lead to exist
/// @param expanded  sources have moments and sums derivatives
using LevelSum = void(const LevelRows& rows, const LevelOffset* offsets, int count, int channels,
                      bool expanded);

/// Sources of `count` coarse nodes of a row from those of 8 fine ones each, by cubics through nodes a
/// quarter of a coarse step to either side. Pointers stand at what belongs to the first coarse node.
struct Restriction {
    int count = 0;
    float reach = 0;  ///< heights differ by no more than that; beyond, expansions are not followed
    const float* coarse_z = nullptr;
    const float* fine_z[8]{};
    const float* from[3][8]{};  ///< moments, of one channel; only the first one of samples
    float* to[3]{};
    bool has_moments = false;
};
using Restrict = void(const Restriction& r);

/// Sums of `count` fine nodes of a row, set to what those of 4 coarse ones each say.
struct Prolongation {
    int count = 0;
    float reach = 0;
    bool is_upper =
        false;  ///< a fine node lies beyond its second coarse one, else before its third
    const float* fine_z = nullptr;
    const float* coarse_z[4]{};
    const float* from[3][4]{};
    float* to[3]{};
    bool has_derivatives = false;  ///< else only values are asked for
};
using Prolong = void(const Prolongation& p);

/// Every second number, from the first and from the second one.
using Split = void(const float* from, int count, float* even, float* odd);
using Join = void(const float* even, const float* odd, int count, float* to);

LevelSum sum_level_portable, sum_level_avx2, sum_level_avx512;
Restrict restrict_portable, restrict_avx2, restrict_avx512;
Prolong prolong_portable, prolong_avx2, prolong_avx512;
Split split_portable, split_avx2, split_avx512;
Join join_portable, join_avx2, join_avx512;

}  // namespace relit::kernels
