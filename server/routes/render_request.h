// What a render request asks for, however it came: the scene with every image named by its id, the
// bytes of those that came along, and the name of the picture.
#pragma once

#include <map>
#include <string>

#include "server/http/message.h"
#include "server/limits.h"
#include "server/schema/description.h"

namespace relit::server {

struct RenderRequest {
    SceneDescription scene;                      ///< all its images are ImageSource::Kind::image
    std::map<std::string, std::string> brought;  ///< id -> bytes of images that came with the request
    std::string scene_text;  ///< the scene in its one form, as scene_json() writes it
};

/// @throws Error malformed_request, malformed_json and the others of parse_scene(); `pointer` names
///               the field
[[nodiscard]] RenderRequest parse_render_request(const Request& request, const Limits& limits);

/// A strong validator: a hash of everything that determines the picture's bytes.
[[nodiscard]] std::string etag_of(const RenderRequest& request);

}  // namespace relit::server
