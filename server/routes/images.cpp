#include "server/routes/images.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "server/error_codes.h"
#include "server/http/multipart.h"
#include "server/routes/json_reply.h"
#include "server/routes/query.h"
#include "server/schema/image_json.h"
#include "server/text.h"

namespace relit::server {
namespace {

using Clock = std::chrono::steady_clock;

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
    if (auto image = services.images.find(id)) return {std::move(id), false, std::move(*image)};
    ImageInfo info;
    {
        const auto slot = services.decodes.wait_for_slot(request.deadline, request.client_gone);
        request.spans.push_back({"queue", slot.waited()});
        const auto begin = Clock::now();
        info = services.decoder.check(bytes, {request.client_gone, request.deadline});
        request.spans.push_back({"decode", Clock::now() - begin});
    }
    const auto begin = Clock::now();
    auto put = services.images.put(bytes, info);
    request.spans.push_back({"store", Clock::now() - begin});
    return put;
}

// A place in the list as clients see it: "<nanoseconds since 1970>-<id>". It says all there is to
// say, so that it outlives its image.
std::string place_text(const ImagePlace& place) {
    return fmt::format("{}-{}", place.created.time_since_epoch().count(), place.id);
}

ImagePlace parse_place(const std::string& text, const ImageStore& images) {
    if (auto place = images.place(text)) return std::move(*place);
    const auto dash = text.rfind('-');
    const auto created = parse_number<std::int64_t>(std::string_view(text).substr(0, dash));
    if (dash == std::string::npos || !created || !ImageStore::is_id(text.substr(dash + 1)))
        throw Error(error_code::invalid_value,
                    "the parameter 'after' must be the 'next' of a page of images or the id of a "
                    "stored image");
    return {FileTime(std::chrono::nanoseconds(*created)), text.substr(dash + 1)};
}

}  // namespace

Reply put_image(const Request& request, Services& services) {
    allow_parameters(request, {});
    const auto put = store(uploaded_bytes(request), request, services);
    Reply reply = json_reply(image_json(put.image), put.created ? 201 : 200);
    reply.headers.emplace("Location", "/v1/images/" + put.id);
    return reply;
}

Reply list_images(const Request& request, Services& services) {
    allow_parameters(request, {"limit", "after"});
    std::optional<ImagePlace> after;
    if (const auto text = request.query_value("after")) after = parse_place(*text, services.images);
    const auto page = services.images.list(page_size(request), after);
    std::optional<std::string> next;
    if (page.next) next = place_text(*page.next);
    return json_reply(image_list_json(page.images, next), 200);
}

Reply get_image(const Request& request, Services& services) {
    allow_parameters(request, {});
    return json_reply(image_json(services.images.info(request.path_params.at("id"))), 200);
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
