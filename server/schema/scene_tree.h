// Scenes between JSON text and SceneDescription: as trees that are laid over one another. For
// scene_json.cpp and batch_json.cpp.
#pragma once

#include "server/schema/description.h"
#include "server/schema/strict_json.h"

namespace relit::server {

/// As parse_scene(), of what parse_json() or laid_over() returned.
[[nodiscard]] SceneDescription scene_from(const Json& tree, int max_lights);

}  // namespace relit::server
