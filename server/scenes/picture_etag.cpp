#include "server/scenes/picture_etag.h"

#include <spdlog/fmt/fmt.h>

#include "core/render/render.h"
#include "server/storage/sha256.h"

namespace relit::server {

std::string picture_etag(std::string_view scene_text) {
    const std::string all = fmt::format("{}\n{}\n{}", scene_text, RELIT_VERSION, picture_revision);
    return '"' + sha256_hex(all).substr(0, 32) + '"';
}

}  // namespace relit::server
