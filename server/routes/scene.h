// POST /v1/scene: a render without the rendering.
#pragma once

#include "server/http/message.h"
#include "server/services.h"

namespace relit::server {

/// The scene whole, every default filled in, and as `ETag` the one its picture would have (none for
/// a preview, as there). Images that came along are named by their ids. Loads every image, so that
/// it refuses whatever a render of the scene would refuse.
/// @throws Error as parse_render_request(), load_scene() and RenderSlots::wait_for_slot()
[[nodiscard]] Reply check_scene(const Request& request, Services& services);

}  // namespace relit::server
