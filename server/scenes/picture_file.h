// Scene -> the picture's file: rendered, then written. For everything that answers or stores
// pictures.
#pragma once

#include <functional>
#include <string>

#include "core/render/render.h"
#include "server/schema/description.h"

namespace relit::server {

struct PictureFile {
    Picture picture;
    std::string bytes;
};

/// @param scene        what load_scene() made of `description`
/// @param scene_text   `description` as scene_json() writes it, kept in files that can hold it
/// @param rendered     called between rendering and writing
/// @throws Error cancelled
[[nodiscard]] PictureFile picture_file(const Scene& scene, const SceneDescription& description,
                                       const std::string& scene_text, const RenderControl& control,
                                       const std::function<void()>& rendered = {});

}  // namespace relit::server
