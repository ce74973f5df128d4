#include "core/base/wide/wide_vector.h"
//
#include "core/transport/kernels/directional_pairs.h"

namespace relit::kernels {

void directional_group_avx2(const DirectionalColour* colours, const DirectionalBend& bend,
                            DirectionalTerms terms, float near, const DirectionalPoints& points,
                            const float* sources, int count, float* sums) {
    directional_group(colours, bend, terms, near, points, sources, count, sums);
}

void directional_row_avx2(const DirectionalColour* colours, DirectionalTerms terms,
                          const DirectionalPlanes& planes, std::ptrdiff_t first, int count,
                          const DirectionalTap* taps, int tap_count, float* sums,
                          std::ptrdiff_t stride) {
    directional_row(colours, terms, planes, first, count, taps, tap_count, sums, stride);
}

}  // namespace relit::kernels
