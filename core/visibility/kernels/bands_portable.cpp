#include "core/base/wide/shorts_vector.h"
//
#include "core/visibility/kernels/band_march.h"

namespace relit::kernels {

void bands_portable(const BandScenery& scenery, const BandPacket& packet, float* out) {
    project_bands(scenery, packet, out);
}

void light_block_portable(const short* block, int pairs, const short* weights, int* out) {
    sum_products(block, pairs, weights, out);
}

}  // namespace relit::kernels
