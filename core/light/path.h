// Ways that a light goes from picture to picture: where on its path it is in which frame, and where
// that is. For sweeps of a server and of a command line.
#pragma once

#include "core/base/vec.h"

namespace relit {

/// How the pace changes from one end of a path to the other.
enum class Easing {
    linear,
    ease_in,      ///< begins slowly: t^2
    ease_out,     ///< ends slowly
    ease_in_out,  ///< both: 3 t^2 - 2 t^3
};

/// What the ends of a path are to its frames.
enum class PathEnds {
    open,    ///< the first frame is at one end, the last at the other
    closed,  ///< the end is the beginning: the last frame is one step before it
    returns,  ///< to the end and back again, in even steps; the last frame is one before the beginning
};

/// How far along its path a light is, from 0 to 1.
///
/// @param frame  0 <= frame < count; a path of one frame is at its beginning
/// @pre  count > 0 (asserted)
[[nodiscard]] double path_share(int frame, int count, PathEnds ends, Easing easing);

/// A direction as DirectionalLight has it.
struct Angles {
    double azimuth_deg = 0;
    double elevation_deg = 0;
};

/// Both angles go evenly, whichever way round `to` says: from 350 to 10 is most of a turn back, from
/// 350 to 370 a small step on. @return the azimuth in [0, 360)
[[nodiscard]] Angles between(Angles from, Angles to, double share);

[[nodiscard]] Vec3 between(Vec3 from, Vec3 to, double share);

/// The angle within [0, 360) that is the same direction.
[[nodiscard]] double within_a_turn(double degrees);

}  // namespace relit
