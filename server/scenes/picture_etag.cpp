#include "server/scenes/picture_etag.h"

#include <spdlog/fmt/fmt.h>

#include "core/render/render.h"
#include "server/storage/sha256.h"

namespace relit::server {

std::string picture_etag(std::string_view scene_text) {
    return strong_etag(fmt::format("{}\n{}\n{}", scene_text, RELIT_VERSION, picture_revision));
}

}  // namespace relit::server
