#include "core/light/path.h"

#include <cassert>
#include <cmath>

namespace relit {
namespace {

double eased(double t, Easing easing) {
    switch (easing) {
        case Easing::linear:
            break;
        case Easing::ease_in:
            return t * t;
        case Easing::ease_out:
            return t * (2 - t);
        case Easing::ease_in_out:
            return t * t * (3 - 2 * t);
    }
    return t;
}

double lerp(double from, double to, double share) { return from + share * (to - from); }

}  // namespace

double path_share(int frame, int count, PathEnds ends, Easing easing) {
    assert(count > 0 && frame >= 0 && frame < count);
    if (count == 1) return 0;
    const int steps = ends == PathEnds::open ? count - 1 : count;
    double t = double(frame) / steps;
    if (ends == PathEnds::returns) t = 1 - std::abs(1 - 2 * t);
    return eased(t, easing);
}

double within_a_turn(double degrees) {
    const double angle = std::fmod(degrees, 360);
    const double positive = angle < 0 ? angle + 360 : angle;
    return positive < 360 ? positive + 0.0 : 0;  // the sum may be rounded up to a whole turn
}

Angles between(Angles from, Angles to, double share) {
    return {within_a_turn(lerp(from.azimuth_deg, to.azimuth_deg, share)),
            lerp(from.elevation_deg, to.elevation_deg, share)};
}

Vec3 between(Vec3 from, Vec3 to, double share) { return from + share * (to - from); }

}  // namespace relit
