// GET and POST /v1/render: a scene in, its picture out.
#pragma once

#include "server/http/message.h"
#include "server/services.h"

namespace relit::server {

/// POST: the scene as JSON, or multipart/form-data with a part `scene` and the files that it names
/// as parts. GET: `scene` is base64url-encoded JSON; If-None-Match is honoured without rendering.
/// The header Relit-Session makes the request part of a session (RenderSlots).
/// @throws Error malformed_request (Relit-Session); as parse_scene(), load_scene() and
///         RenderSlots::wait_for_slot()
[[nodiscard]] Reply render_picture(const Request& request, Services& services);

}  // namespace relit::server
