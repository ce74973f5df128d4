// What POST /v1/batches asks for, frame by frame. Source: api.md, "Batches".
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "server/limits.h"
#include "server/schema/description.h"

namespace relit::server {

struct BatchFrame {
    std::string name;   ///< of its file: unique, safe on every file system
    std::string scene;  ///< in its one form, as scene_json() writes it
};

struct BatchRequest {
    int priority = 0;  ///< from -100 to 100
    std::vector<BatchFrame> frames;
};

struct BatchLimits {
    int max_lights = 1;
    int max_frames = 1;
    JsonLimits json{};
};

/// A file of an archive that no frame may be called as: the problems of the frames that failed.
inline constexpr std::string_view problems_file_name = "problems.json";

/// Reads a batch: {"scene", "frames"}, merge patches over the scene; {"scene", "sweep"}; or
/// {"scenes"}. Each with a `priority`, each frame or scene with a `name`. Every scene is checked as
/// parse_scene() checks it.
///
/// @param check  told every scene, to refuse what it finds; pointers in what it throws are the
///               scene's own
/// @throws Error as parse_scene(), and what `check` throws. `pointer` names the field as it was
///         sent: /frames/3/light/position, or /scene/relief where the frame has it from the scene
[[nodiscard]] BatchRequest parse_batch(std::string_view json, const BatchLimits& limits,
                                       const std::function<void(const SceneDescription&)>& check);

/// What the `easing` of a sweep may be.
[[nodiscard]] std::vector<std::string> easing_words();

}  // namespace relit::server
