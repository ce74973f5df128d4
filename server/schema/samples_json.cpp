#include "server/schema/samples_json.h"

#include <nlohmann/json.hpp>

#include "core/io/decode.h"
#include "server/samples/samples.h"

namespace relit::server {

namespace {

std::string written_samples() {
    using Json = nlohmann::ordered_json;
    Json list = Json::array();
    for (const Sample& sample : samples()) {
        const ImageInfo info = decode(sample.bytes).info;
        list.push_back({{"id", sample.id},
                        {"name", sample.name},
                        {"title", sample.title},
                        {"kind", sample.kind},
                        {"width", info.width},
                        {"height", info.height},
                        {"format", name_of(info.format)},
                        {"credit", sample.credit},
                        {"licence", sample.licence},
                        {"source", sample.source},
                        {"scene", Json::parse(sample.scene)}});
    }
    return Json{{"samples", std::move(list)}}.dump();
}

}  // namespace

std::string samples_json() {
    static const std::string text = written_samples();  // decodes them all, once
    return text;
}

}  // namespace relit::server
