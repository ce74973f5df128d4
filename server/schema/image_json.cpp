#include "server/schema/image_json.h"

#include <nlohmann/json.hpp>

#include "server/schema/time_text.h"

namespace relit::server {
namespace {

using Json = nlohmann::ordered_json;

Json json_of(const StoredImage& image) {
    return {{"id", image.id},
            {"width", image.info.width},
            {"height", image.info.height},
            {"channels", image.info.channels},
            {"type", name_of(image.info.type)},
            {"format", name_of(image.info.format)},
            {"bytes", image.size_bytes},
            {"created", image.created ? Json(time_text(*image.created)) : Json(nullptr)}};
}

}  // namespace

std::string image_json(const StoredImage& image) { return json_of(image).dump(); }

std::string image_list_json(const std::vector<StoredImage>& images,
                            const std::optional<std::string>& next) {
    Json list = Json::array();
    for (const StoredImage& image : images) list.push_back(json_of(image));
    return Json{{"images", std::move(list)}, {"next", next ? Json(*next) : Json(nullptr)}}.dump();
}

}  // namespace relit::server
