// Scene -> the picture's file: rendered and written, some rows at a time where it is large. For
// everything that answers or stores pictures.
#pragma once

#include <chrono>
#include <string>

#include "core/render/render.h"
#include "server/schema/description.h"

namespace relit::server {

struct PictureFile {
    PictureFacts picture;
    std::string bytes;
    std::chrono::nanoseconds render_time{0}, encode_time{0};  ///< what took how long
};

/// @param scene        what load_scene() made of `description`
/// @param scene_text   `description` as scene_json() writes it, kept in files that can hold it
/// @throws Error cancelled
[[nodiscard]] PictureFile picture_file(const Scene& scene, const SceneDescription& description,
                                       const std::string& scene_text, const RenderControl& control);

}  // namespace relit::server
