// A scene that names a preset, and the preset under it, as one scene. For parse_scene().
#pragma once

#include "server/schema/strict_json.h"

namespace relit::server {

/// `scene` without its `preset`, over that preset. A light of another type, or `lights`, replaces
/// the preset's light whole; a field that is null goes back to its default, whether the preset had
/// set it or not. Such a field is there as a discarded value, which readers take for absent.
///
/// @throws Error invalid_value at /preset when there is no such preset
[[nodiscard]] Json over_preset(Json scene);

}  // namespace relit::server
