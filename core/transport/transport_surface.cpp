#include "core/transport/transport_surface.h"

#include <algorithm>
#include <cmath>

namespace relit {

double TransportSurface::relief() const {
    float low = INFINITY, high = -INFINITY;
    for (std::size_t k = 0; k < z.values.size(); ++k) {
        if (!(area.values[k] > 0)) continue;
        low = std::min(low, z.values[k]);
        high = std::max(high, z.values[k]);
    }
    return low < high ? double(high) - low : 0;
}

double TransportSurface::extent() const { return std::hypot(1.0, spacing() * height(), relief()); }

}  // namespace relit
