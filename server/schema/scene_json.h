// Scene JSON <-> SceneDescription, strict both ways. For routes and command lines, which see text
// and structs and no JSON library. What a field is called, what it may hold and what it means
// stands once, in fields.h.
#pragma once

#include <string>
#include <string_view>

#include "server/limits.h"
#include "server/schema/description.h"

namespace relit::server {

/// Reads a scene: laid over its preset, defaults filled in, every value checked that can be checked
/// without its images.
///
/// @throws Error malformed_json (not JSON, over a limit), duplicate_field, unknown_field,
///         missing_field, invalid_value (type, range, fields that contradict each other); `pointer`
///         names the field
[[nodiscard]] SceneDescription parse_scene(std::string_view json, int max_lights,
                                           const JsonLimits& limits = {});

/// The whole scene, every field written, in one form: two scenes that mean the same by their
/// fields' values are the same text.
/// @pre images are stored ones (Kind::image) wherever the text is to name a picture for good
[[nodiscard]] std::string scene_json(const SceneDescription& scene);

}  // namespace relit::server
