// Scenes laid over others: over a preset, or frames of a batch over the scene that they share. For
// scene_json.cpp and batch_json.cpp.
#pragma once

#include "server/schema/strict_json.h"

namespace relit::server {

/// `patch` over `scene` as a merge patch (RFC 7396). A light of another type, or `lights`, replaces
/// the scene's light whole; so does an image another image. A field that is null goes back to its
/// default, whether the scene had set it or not: it is there as a discarded value, which readers
/// take for absent.
/// @pre both are objects
[[nodiscard]] Json laid_over(Json scene, const Json& patch);

/// `scene` without its `preset`, laid over that preset.
/// @throws Error invalid_value at /preset when there is no such preset
[[nodiscard]] Json over_preset(Json scene);

}  // namespace relit::server
