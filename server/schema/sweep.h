// Sweeps: many scenes from one, whose light goes along a path. For batch_json.cpp. Source: api.md,
// "Batches".
#pragma once

#include <string>

#include "core/light/path.h"
#include "server/schema/strict_json.h"

namespace relit::server {

/// What a sweep does to a scene's light.
struct Sweep {
    enum class Path {
        orbit,        ///< a sun around the map, at one elevation
        arc,          ///< a sun from one direction to another
        line,         ///< a point light from one position to another
        environment,  ///< an environment turned about the vertical
    };
    Path path = Path::orbit;
    int count = 1;
    int light = 0;  ///< of the scene's lights, from 0
    PathEnds ends = PathEnds::open;
    Easing easing = Easing::linear;
    double turns_deg = 360;  ///< orbit, environment
    Angles from_angles, to_angles;
    Vec3 from_position, to_position;
};

/// @param pointer  where it stands
/// @throws Error missing_field, unknown_field, invalid_value
[[nodiscard]] Sweep sweep_from(const Json& json, int max_count, const std::string& pointer);

/// The scene of one frame: `scene` laid over its preset, with the light on its place. A light of
/// another type becomes one of the path's type and keeps its colour and its intensity.
///
/// @param scene  an object
/// @throws Error invalid_value at /sweep/light (there is no such light), at /sweep/path (an
///         environment is to turn, and the light is none); as over_preset()
[[nodiscard]] Json swept(const Json& scene, const Sweep& sweep, int frame);

}  // namespace relit::server
