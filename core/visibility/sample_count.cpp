#include "core/visibility/sample_count.h"

namespace relit {

int sample_count(const Solid& solid, Vec3 from, Vec3 to, int steps) noexcept {
    const Vec3 increment = (1.0 / steps) * (to - from);
    int s = 1;
    for (int i = 0; i <= steps; ++i)
        if (is_inside(solid, from + double(i) * increment)) ++s;
    return s;
}

}  // namespace relit
