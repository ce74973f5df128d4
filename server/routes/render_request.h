// What a render request asks for, however it came: the scene with every image named by its id, the
// bytes of those that came along, and the name of the picture.
#pragma once

#include <map>
#include <string>

#include "server/http/message.h"
#include "server/limits.h"
#include "server/scenes/scene_loading.h"
#include "server/schema/description.h"
#include "server/storage/image_store.h"

namespace relit::server {

struct RenderRequest {
    SceneDescription scene;                      ///< all its images are ImageSource::Kind::image
    std::map<std::string, std::string> brought;  ///< id -> bytes of images that came with the request
    std::string scene_text;  ///< the scene in its one form, as scene_json() writes it
};

/// POST: the scene as JSON, or multipart/form-data with a part `scene` and the files that it names
/// as parts. GET: the parameter `scene`, base64url-encoded JSON; or, where the path names an image
/// ("/v1/images/{id}/relit.png"), the scene's fields as flat parameters (settings.h), the height
/// map and the format being the path's.
///
/// @throws Error malformed_request, malformed_json and the others of parse_scene(); `pointer` names
///               the field
[[nodiscard]] RenderRequest parse_render_request(const Request& request, const Limits& limits);

/// Where load_scene() finds the images of a request: among those that came along, then in `images`.
/// What it has found counts as in use until the last copy of the function is gone.
/// @throws Error not_found at the field that names the image, storage_failed
/// All images of the request are looked for at once, so that none of them can be evicted while the
/// request waits for its turn.
[[nodiscard]] FindImage find_in(const RenderRequest& request, const ImageStore& images);

}  // namespace relit::server
