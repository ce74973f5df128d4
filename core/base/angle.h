// Degrees, radians, and directions from angles as hillshading tools and environment viewers count
// them.
#pragma once

#include <cmath>
#include <numbers>

#include "core/base/vec.h"

namespace relit {

/// Of an angle of any number of turns.
inline double radians(double degrees) { return std::fmod(degrees, 360) * std::numbers::pi / 180; }

/// Unit vector towards a light.
///
/// @param azimuth_deg    clockwise from the top of the image
/// @param elevation_deg  above the image plane, negative = behind it
/// Source: integrated model, section 1 (Lights).
inline Vec3 direction_from(double azimuth_deg, double elevation_deg) {
    const double az = radians(azimuth_deg);
    const double el = radians(elevation_deg);
    return {std::sin(az) * std::cos(el), std::cos(az) * std::cos(el), std::sin(el)};
}

}  // namespace relit
