// Command line -> scene: presets, scene file and flags laid over each other, images read and named
// by their ids, exactly as a server sees a request that brings its images along.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "clients/cli/input.h"
#include "clients/cli/options.h"
#include "core/base/error.h"
#include "server/schema/description.h"

namespace relit::cli {

struct SceneJob {
    server::SceneDescription scene;       ///< all its images are ImageSource::Kind::image
    std::string text;                     ///< the scene in its one form, as scene_json() writes it
    std::map<std::string, Input> images;  ///< id -> what was read; not those a server has to have
    std::vector<std::filesystem::path> files;  ///< all that were read, the scene file too
    std::map<std::string, std::string> ids;    ///< path -> id, of the files that scenes name
};

/// Reads everything that the options name.
///
/// @param target  where the picture goes: its ending is the format unless something else says it;
///                empty: nowhere
/// @throws Failure usage (values of flags that are not understood, formats that contradict each
///         other, two presets), what read_input() throws; Error of parse_scene() and
///         with_settings()
[[nodiscard]] SceneJob read_scene_job(const SceneOptions& options, const std::string& target);

/// Its last steps, of a scene that comes as text: the scene goes into `job`, its images join those
/// that are there.
/// @param folder       of the files that the scene names
/// @param with_server  whether there may be images that are stored there
/// @param format_setting  what a refusal of the format tells to use: "--format", "output.format"
/// @throws as read_scene_job()
void finish_scene_job(std::string text, const std::string& target,
                      const std::filesystem::path& folder, bool with_server,
                      std::string_view format_setting, SceneJob& job);

/// The name of the image that a pointer into the scene blames; empty when it blames none.
[[nodiscard]] std::string image_name(const server::SceneDescription& scene,
                                     const std::map<std::string, Input>& images,
                                     const std::string& pointer);

}  // namespace relit::cli
