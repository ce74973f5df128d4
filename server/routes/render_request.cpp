#include "server/routes/render_request.h"

#include <spdlog/fmt/fmt.h>

#include <set>

#include "core/render/render.h"
#include "server/error_codes.h"
#include "server/http/multipart.h"
#include "server/schema/base64.h"
#include "server/schema/field_error.h"
#include "server/schema/scene_json.h"
#include "server/storage/sha256.h"

namespace relit::server {
namespace {

const Part* find_part(const Request& request, std::string_view name) {
    for (const Part& part : request.parts)
        if (part.name == name) return &part;
    return nullptr;
}

void check_query(const Request& request, bool takes_scene) {
    for (const auto& [name, value] : request.query)
        if (!takes_scene || name != "scene")
            throw Error(error_code::unknown_field,
                        fmt::format("there is no parameter '{}' here", name));
    if (request.query.size() > 1)
        throw Error(error_code::duplicate_field, "the parameter 'scene' is there twice");
}

std::string scene_of_query(const Request& request) {
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

std::string scene_of(const Request& request) {
    check_query(request, request.is_get());
    if (request.is_get()) return scene_of_query(request);
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
    result.scene = parse_scene(scene_of(request), limits.max_lights);
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

std::string etag_of(const RenderRequest& request) {
    const std::string all =
        fmt::format("{}\n{}\n{}", request.scene_text, RELIT_VERSION, picture_revision);
    return '"' + sha256_hex(all).substr(0, 32) + '"';
}

}  // namespace relit::server
