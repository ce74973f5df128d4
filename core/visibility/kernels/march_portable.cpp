#include "core/base/wide/wide_vector.h"
//
#include "core/visibility/kernels/march_rays.h"
#include "core/visibility/kernels/march_tile.h"

namespace relit::kernels {

void march_portable(const Scenery& scenery, const double* from, int count, double* r) {
    march_list(scenery, from, count, r);
}

void march_tile_portable(const Scenery& scenery, const Tile& tile, float* r) {
    march_tile(scenery, tile, r);
}

}  // namespace relit::kernels
