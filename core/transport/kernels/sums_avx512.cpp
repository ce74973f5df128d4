#include "core/base/wide/wide_avx512.h"
//
#include "core/transport/kernels/group_sum.h"

namespace relit::kernels {

void sum_group_avx512(const RadialTable& table, int channels, const PointGroup& points,
                      const float* sources, int count, const float* distant, int distant_count,
                      float* sums) {
    sum_group(table, channels, points, sources, count, distant, distant_count, sums);
}

}  // namespace relit::kernels
