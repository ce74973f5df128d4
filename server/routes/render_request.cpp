#include "server/routes/render_request.h"

#include <spdlog/fmt/fmt.h>

#include <map>
#include <memory>
#include <set>
#include <vector>

#include "server/error_codes.h"
#include "server/http/multipart.h"
#include "server/routes/query.h"
#include "server/schema/base64.h"
#include "server/schema/field_error.h"
#include "server/schema/scene_json.h"
#include "server/schema/settings.h"
#include "server/storage/sha256.h"

namespace relit::server {
namespace {

const Part* find_part(const Request& request, std::string_view name) {
    for (const Part& part : request.parts)
        if (part.name == name) return &part;
    return nullptr;
}

std::string format_of_path(const std::string& path) {
    const std::string ending = path.substr(path.rfind('.') + 1);
    return ending == "jpg" ? "jpeg" : ending;
}

std::string scene_of_query(const Request& request) {
    allow_parameters(request, {"scene"});
    const auto encoded = request.query_value("scene");
    if (!encoded) throw Error(error_code::missing_field, "the parameter 'scene' is missing");
    auto scene = decode_base64url(*encoded);
    if (!scene)
        throw Error(error_code::malformed_request, "the parameter 'scene' is not base64url");
    return std::move(*scene);
}

void check_parts(const Request& request) {
    std::set<std::string_view> names;
    for (const Part& part : request.parts)
        if (!names.insert(part.name).second)
            throw Error(error_code::duplicate_field,
                        fmt::format("the form has two parts '{}'", part.name));
}

// "/v1/images/{id}/relit.webp?light=0.3,0.8,0.4": what the path says and the parameters over it.
std::string scene_of_path(const Request& request, const std::string& id) {
    const std::string format = format_of_path(request.path);
    std::vector<Setting> settings;
    for (const auto& [name, value] : request.query) {
        if (name == "height" || name.starts_with("height."))
            refuse_value("is the image that the path names", "/height");
        if (name == "output.format") refuse_value("is what the path ends in", "/output/format");
        settings.push_back({name, value});
    }
    settings.push_back({"height.image", id});
    settings.push_back({"output.format", format});
    return with_settings("{}", settings);
}

std::string scene_of(const Request& request) {
    const auto id = request.path_params.find("id");
    if (id != request.path_params.end()) return scene_of_path(request, id->second);
    if (request.is_get()) return scene_of_query(request);
    allow_parameters(request, {});
    if (!is_multipart(request.header("Content-Type").value_or(""))) return request.body;
    check_parts(request);
    const Part* part = find_part(request, "scene");
    if (!part) throw Error(error_code::missing_field, "the form has no part 'scene'");
    return part->content;
}

// Nothing is silently ignored: neither is a file that the scene does not name.
void check_all_parts_named(const Request& request, const std::set<std::string>& named) {
    for (const Part& part : request.parts)
        if (part.name != "scene" && !named.contains(part.name))
            throw Error(error_code::unknown_field,
                        fmt::format("the scene names no part '{}'", part.name));
}

// The bytes of an image that came along.
std::string brought_bytes(const ImageSource& source, const Request& request) {
    if (source.kind == ImageSource::Kind::part) {
        const Part* part = find_part(request, source.text);
        if (!part) refuse_value("names no part of this request", source.pointer);
        return part->content;
    }
    auto bytes = decode_base64(source.text);
    if (!bytes) refuse_value("is not base64 (RFC 4648, without line breaks)", source.pointer);
    return std::move(*bytes);
}

}  // namespace

RenderRequest parse_render_request(const Request& request, const Limits& limits) {
    RenderRequest result;
    result.scene = parse_scene(scene_of(request), limits.max_lights, limits.json);
    std::set<std::string> named_parts;
    for_each_image(result.scene, [&](ImageSource& source) {
        if (source.kind == ImageSource::Kind::image) return;
        if (source.kind == ImageSource::Kind::part) named_parts.insert(source.text);
        std::string bytes = brought_bytes(source, request);
        source.kind = ImageSource::Kind::image;
        source.text = sha256_hex(bytes);
        result.brought[source.text] = std::move(bytes);
    });
    check_all_parts_named(request, named_parts);
    result.scene_text = scene_json(result.scene);
    return result;
}

FindImage find_in(const RenderRequest& request, const ImageStore& images) {
    auto found = std::make_shared<std::map<std::string, SharedBytes>>();
    for_each_image(request.scene, [&](const ImageSource& source) {
        const auto brought = request.brought.find(source.text);
        if (brought != request.brought.end()) {
            (*found)[source.text] = {nullptr, brought->second};
            return;
        }
        try {
            (*found)[source.text] = images.get(source.text);
        } catch (const Error& e) {
            throw Error(e.code, e.what(), e.code == error_code::not_found ? source.pointer : "",
                        e.limit);
        }
    });
    return [found](const ImageSource& source) { return found->at(source.text); };
}

}  // namespace relit::server
