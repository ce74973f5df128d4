// Scenes in flat parameters, as URLs and command lines spell them: "material.specular.k" = "0.4".
// For GET /v1/images/{id}/relit.* and `relit --set`. Source: api.md, "Resources".
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace relit::server {

/// One field: its dotted path and its value as text.
struct Setting {
    std::string path;
    std::string value;
};

/// The JSON of a scene with settings laid over it. Nothing of the scene is checked beyond what
/// laying over needs: that is parse_scene()'s business.
///
/// A path's segments are fields' names, or indices of lists, which may grow by one. A value is
/// read as a number, as true, false or null, as JSON where it begins with [, { or ", as a list of
/// numbers where there are commas between, and otherwise as text; where a field is text
/// (image, data, part, type), always as text. Three paths are short for a light, which
/// replaces one of another type, and several, whole:
///   light = x,y,z                a point light at that position
///   sun   = azimuth,elevation    a directional light, in degrees
///   env   = id[,yaw[,pitch]]     an environment, turned by so many degrees
///
/// @param scene_json  an object
/// @return JSON; the settings count in any order
/// @throws Error malformed_json, duplicate_field (in `scene_json`, or a path that is there twice),
///         invalid_value (two short lights, a wrong count of numbers, a segment below what is no
///         object); `pointer` names the field
[[nodiscard]] std::string with_settings(std::string_view scene_json,
                                        const std::vector<Setting>& settings);

}  // namespace relit::server
