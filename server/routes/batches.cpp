#include "server/routes/batches.h"

#include <spdlog/fmt/fmt.h>

#include <utility>

#include "server/error_codes.h"
#include "server/http/multipart.h"
#include "server/logging/log.h"
#include "server/routes/json_reply.h"
#include "server/routes/query.h"
#include "server/scenes/scene_cost.h"
#include "server/scenes/scene_loading.h"
#include "server/schema/batch_json.h"
#include "server/schema/batch_request.h"
#include "server/schema/field_error.h"
#include "server/schema/problem_json.h"
#include "server/storage/sha256.h"
#include "server/text.h"

namespace relit::server {
namespace {

// A frame's picture never changes: one that is done is not rendered again.
constexpr std::string_view immutable = "public, max-age=31536000, immutable";

// Where an image is not there, its field is to blame.
template <class Find>
auto found(const ImageSource& source, const Find& find) {
    try {
        return find();
    } catch (const Error& e) {
        throw Error(e.code, e.what(), e.code == error_code::not_found ? source.pointer : "",
                    e.limit);
    }
}

// What can be told of a batch's scenes without rendering: whether their images are there, and whether
// the pictures fit them. The images stay held.
class SceneCheck {
public:
    explicit SceneCheck(const Services& services) : services_(services) {}

    void operator()(const SceneDescription& scene) {
        for_each_image(scene, [&](const ImageSource& source) { hold(source); });
        const auto [width, height] = size_of(scene.height);
        check_output(scene.output, width, height, services_.limits);
        check_cost(scene, width, height, services_.limits);
    }

    HeldImages images;

private:
    void hold(const ImageSource& source) {
        if (source.kind != ImageSource::Kind::image)
            refuse_value("must be a stored image of a batch: upload it first (POST /v1/images)",
                         source.pointer);
        if (images.contains(source.text)) return;
        images[source.text] = found(source, [&] { return services_.images.get(source.text); });
    }

    std::pair<int, int> size_of(const ImageSource& source) {
        auto& size = sizes_[source.text];
        if (size.first == 0) {
            const auto info =
                found(source, [&] { return services_.images.info(source.text).info; });
            size = {info.width, info.height};
        }
        return size;
    }

    const Services& services_;
    std::map<std::string, std::pair<int, int>> sizes_;
};

NewBatch new_batch(BatchRequest request, const HeldImages& images, const std::string& key,
                   const std::string& body_hash) {
    NewBatch batch{.id = Batches::new_id(),
                   .priority = request.priority,
                   .frames = {},
                   .images = {},
                   .key = key,
                   .body_hash = body_hash};
    for (BatchFrame& frame : request.frames)
        batch.frames.push_back({std::move(frame.name), std::move(frame.scene)});
    for (const auto& [id, bytes] : images) batch.images.insert(id);
    return batch;
}

Reply accepted(const JobStore::Submitted& batch) {
    Reply reply = json_reply(submitted_json(batch), 202);
    reply.headers.emplace("Location", "/v1/batches/" + batch.id);
    return reply;
}

// Lines about its frames name the batch; this one says where it came from.
void log_accepted(const JobStore::Submitted& batch, const Request& request) {
    const LogField fields[] = {{"batch", batch.id},
                               {"frames", std::int64_t(batch.total)},
                               {"id", request.id},
                               {"trace", request.trace.trace_id}};
    log_event(spdlog::level::info, "batches: accepted", fields);
}

// `next` of a page: the place of its last batch, which outlives the batch.
std::int64_t parse_place(const std::string& text, JobStore& store) {
    if (const auto batch = store.find(text)) return batch->place;
    const auto place = parse_number<std::int64_t>(text);
    if (!place || *place < 1)
        throw Error(error_code::invalid_value,
                    "the parameter 'after' must be the 'next' of a page of batches or the id of a "
                    "batch");
    return *place;
}

FrameFacts frame_of(const Request& request, Services& services) {
    const BatchFacts batch = services.batches.find(request.path_params.at("id"));
    const auto number = parse_number<int>(request.path_params.at("n"));
    const auto frame =
        number ? services.batches.store().frame(batch.id, *number) : std::optional<FrameFacts>{};
    if (!frame)
        throw Error(error_code::not_found,
                    fmt::format("There is no such frame: they are 0 to {}.", batch.total - 1));
    return *frame;
}

}  // namespace

Reply submit_batch(const Request& request, Services& services) {
    allow_parameters(request, {});
    if (is_multipart(request.header("Content-Type").value_or("")))
        throw Error(error_code::unsupported_media_type,
                    "a batch is JSON; images are uploaded first (POST /v1/images)");
    const std::string key = token_header(request, "Idempotency-Key");
    const Batches::KeyInUse in_use(services.batches, key);
    const std::string body_hash = sha256_hex(request.body);
    if (const auto known = services.batches.store().submitted(key, body_hash))
        return accepted(*known);
    SceneCheck check(services);
    BatchRequest batch = parse_batch(
        request.body,
        {services.limits.max_lights, services.limits.max_batch_frames, services.limits.json},
        [&](const SceneDescription& scene) { check(scene); });
    const NewBatch fresh = new_batch(std::move(batch), check.images, key, body_hash);
    const auto submitted = services.batches.submit(fresh, std::move(check.images));
    log_accepted(submitted, request);
    return accepted(submitted);
}

Reply list_batches(const Request& request, Services& services) {
    allow_parameters(request, {"limit", "after"});
    JobStore& store = services.batches.store();
    std::optional<std::int64_t> before;
    if (const auto text = request.query_value("after")) before = parse_place(*text, store);
    const std::size_t limit = page_size(request);
    auto batches = store.list(limit + 1, before);
    std::optional<std::string> next;
    if (batches.size() > limit) {
        batches.pop_back();
        next = std::to_string(batches.back().place);
    }
    return json_reply(batch_list_json(batches, next));
}

Reply get_batch(const Request& request, Services& services) {
    allow_parameters(request, {});
    const BatchFacts batch = services.batches.find(request.path_params.at("id"));
    std::vector<FrameFacts> failed;
    if (batch.failed > 0) failed = services.batches.store().failed_frames(batch.id);
    return json_reply(batch_json(batch, failed));
}

Reply delete_batch(const Request& request, Services& services) {
    allow_parameters(request, {});
    services.batches.remove(request.path_params.at("id"));
    return {.status = 204};
}

Reply retry_batch(const Request& request, Services& services) {
    services.batches.retry(request.path_params.at("id"));
    return get_batch(request, services);
}

Reply get_batch_frame(const Request& request, Services& services) {
    allow_parameters(request, {});
    const FrameFacts frame = frame_of(request, services);
    if (frame.state == FrameState::failed) {
        const auto status = problem_status(frame.problem);
        return {.status = status,
                .content_type = "application/problem+json",
                .body = frame.problem,
                .headers = {{"Cache-Control", "no-store"}}};
    }
    if (frame.state != FrameState::done)
        throw Error(error_code::conflict, "The frame is not finished yet.");
    const std::string etag = fmt::format("\"{}\"", ResultFiles::content_hash(frame.result.file));
    if (has_etag(request, etag)) return not_modified(etag, immutable);
    Reply reply{
        .content_type = frame.result.media_type,
        .shared = services.batches.picture(request.path_params.at("id"), frame.result.file)};
    reply.headers = {{"ETag", etag},
                     {"Cache-Control", std::string(immutable)},
                     {"Content-Disposition", "inline; filename=\"" + frame.name + "\""}};
    return reply;
}

}  // namespace relit::server
