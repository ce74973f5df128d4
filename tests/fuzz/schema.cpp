// Scenes and batches as JSON.
#include <set>
#include <string>

#include "server/schema/batch_request.h"
#include "server/schema/scene_json.h"
#include "tests/fuzz/claims.h"
#include "tests/fuzz/targets.h"

namespace relit::fuzz {
namespace {

constexpr int max_lights = 4;
// Small enough for inputs of a few kilobytes to reach them.
constexpr server::JsonLimits limits{.max_depth = 16, .max_values = 500};

void claim_is_read_as_written(const std::string& text) {
    claim(server::scene_json(server::parse_scene(text, max_lights)) == text,
          "a scene in its one form is read as it is written: " + text);
}

}  // namespace

void scene(std::string_view input) {
    server::SceneDescription scene;
    if (accepts([&] { scene = server::parse_scene(input, max_lights, limits); }))
        claim_is_read_as_written(server::scene_json(scene));
}

void batch(std::string_view input) {
    constexpr int max_frames = 20;
    server::BatchRequest batch;
    int checked = 0;
    const auto read = [&] {
        batch = server::parse_batch(input, {max_lights, max_frames, limits},
                                    [&](const server::SceneDescription&) { ++checked; });
    };
    if (!accepts(read)) return;
    claim(!batch.frames.empty() && batch.frames.size() <= max_frames, "a batch keeps its limit");
    claim(checked >= int(batch.frames.size()), "every frame is checked");
    std::set<std::string> names;
    for (const server::BatchFrame& frame : batch.frames) {
        claim_is_read_as_written(frame.scene);
        claim(names.insert(frame.name).second, "names of frames are different");
        claim(!frame.name.empty() && frame.name.front() != '.' &&
                  frame.name.find_first_of(std::string("/\\:\0", 4)) == std::string::npos &&
                  frame.name != server::problems_file_name,
              "a frame's name is safe on every file system");
    }
}

}  // namespace relit::fuzz
