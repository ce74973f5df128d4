#include "server/scenes/picture_file.h"

#include "core/io/encode.h"
#include "server/scenes/scene_loading.h"

namespace relit::server {

PictureFile picture_file(const Scene& scene, const SceneDescription& description,
                         const std::string& scene_text, const RenderControl& control,
                         const std::function<void()>& rendered) {
    PictureFile file;
    file.picture = render(scene, picture_output(description.output), control);
    if (rendered) rendered();
    file.bytes = encode(file.picture.pixels, encode_options(description.output, scene_text),
                        {control.executor, control.stop});
    return file;
}

}  // namespace relit::server
