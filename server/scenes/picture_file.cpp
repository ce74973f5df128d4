#include "server/scenes/picture_file.h"

#include "core/io/encode.h"
#include "server/scenes/scene_loading.h"

namespace relit::server {

using Clock = std::chrono::steady_clock;

PictureFile picture_file(const Scene& scene, const SceneDescription& description,
                         const std::string& scene_text, const RenderControl& control) {
    const auto begin = Clock::now();
    const Rendering rendering(scene, picture_output(description.output), control);
    PictureFile file;
    file.picture = rendering.facts();
    file.render_time = Clock::now() - begin;
    const auto rows = [&](RowRange wanted) {
        const auto asked = Clock::now();
        Image some = rendering.rows(wanted);
        file.render_time += Clock::now() - asked;
        return some;
    };
    file.bytes =
        encode({file.picture.width, file.picture.height, file.picture.channels, rows},
               encode_options(description.output, scene_text), {control.executor, control.stop});
    file.encode_time = Clock::now() - begin - file.render_time;
    return file;
}

}  // namespace relit::server
