#include "core/visibility/kernels/wide_vector.h"
//
#include "core/visibility/kernels/packet.h"

namespace relit::kernels {

void march_portable(const Scenery& scenery, const double* from, int count, double* r) {
    march(scenery, from, count, r);
}

}  // namespace relit::kernels
