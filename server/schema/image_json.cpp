#include "server/schema/image_json.h"

#include <nlohmann/json.hpp>

namespace relit::server {

std::string image_json(const StoredImage& image) {
    return nlohmann::ordered_json{{"id", image.id},
                                  {"width", image.info.width},
                                  {"height", image.info.height},
                                  {"channels", image.info.channels},
                                  {"type", name_of(image.info.type)},
                                  {"format", name_of(image.info.format)},
                                  {"bytes", image.size_bytes}}
        .dump();
}

}  // namespace relit::server
