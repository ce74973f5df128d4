#include "server/routes/images.h"

#include <algorithm>

#include "server/error_codes.h"
#include "server/http/multipart.h"
#include "server/schema/image_json.h"

namespace relit::server {
namespace {

// An id names its bytes for good: whoever has them need not ask again.
constexpr std::string_view immutable = "public, max-age=31536000, immutable";

// The body itself, or the first file of a form.
std::string_view uploaded_bytes(const Request& request) {
    const auto file = std::find_if(request.parts.begin(), request.parts.end(),
                                   [](const Part& part) { return !part.filename.empty(); });
    const bool is_form = is_multipart(request.header("Content-Type").value_or(""));
    if (is_form && file == request.parts.end())
        throw Error(error_code::malformed_request, "The form has no file in it.");
    const std::string_view bytes = is_form ? file->content : request.body;
    if (bytes.empty()) throw Error(error_code::malformed_request, "There is no image in the body.");
    return bytes;
}

// Bytes that are stored have been decoded once already.
ImageStore::Put store(std::string_view bytes, const Request& request, Services& services) {
    auto id = ImageStore::id_of(bytes);
    if (services.images.contains(id)) return {std::move(id), false};
    ImageInfo info;
    {
        const auto slot = services.decodes.wait_for_slot(request.deadline, request.client_gone);
        info = decode(bytes, decode_limits(services.limits)).info;
    }
    return services.images.put(bytes, info);
}

Reply image_reply(const StoredImage& image, int status) {
    Reply reply{.status = status, .content_type = "application/json", .body = image_json(image)};
    reply.headers.emplace("Cache-Control", "no-cache");
    return reply;
}

}  // namespace

Reply put_image(const Request& request, Services& services) {
    const auto put = store(uploaded_bytes(request), request, services);
    Reply reply = image_reply(services.images.info(put.id), put.created ? 201 : 200);
    reply.headers.emplace("Location", "/v1/images/" + put.id);
    return reply;
}

Reply get_image(const Request& request, Services& services) {
    return image_reply(services.images.info(request.path_params.at("id")), 200);
}

Reply get_image_content(const Request& request, Services& services) {
    const std::string& id = request.path_params.at("id");
    const auto image = services.images.info(id);
    const std::string etag = '"' + id + '"';
    if (has_etag(request, etag)) return not_modified(etag, immutable);
    Reply reply{.content_type = std::string(media_type_of(image.info.format)),
                .shared = services.images.get(id)};
    reply.headers = {{"ETag", etag}, {"Cache-Control", std::string(immutable)}};
    return reply;
}

Reply delete_image(const Request& request, Services& services) {
    services.images.remove(request.path_params.at("id"));
    return {.status = 204};
}

}  // namespace relit::server
