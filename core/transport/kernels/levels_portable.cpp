#include "core/base/wide/wide_vector.h"
//
#include "core/transport/kernels/level_sum.h"

namespace relit::kernels {

void sum_level_portable(const LevelRows& rows, const LevelOffset* offsets, int count, int channels,
                        bool expanded) {
    sum_level(rows, offsets, count, channels, expanded);
}

void restrict_portable(const Restriction& r) { restrict_any(r); }

void prolong_portable(const Prolongation& p) { prolong_any(p); }

void split_portable(const float* from, int count, float* even, float* odd) {
    split_any(from, count, even, odd);
}

void join_portable(const float* even, const float* odd, int count, float* to) {
    join_any(even, odd, count, to);
}

}  // namespace relit::kernels
