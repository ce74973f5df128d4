#include "core/base/wide/wide_avx512.h"
//
#include "core/visibility/kernels/march_rays.h"
#include "core/visibility/kernels/march_tile.h"

namespace relit::kernels {

void march_avx512(const Scenery& scenery, const double* from, int count, double* r) {
    march_list(scenery, from, count, r);
}

void march_tile_avx512(const Scenery& scenery, const Tile& tile, float* r) {
    march_tile(scenery, tile, r);
}

}  // namespace relit::kernels
