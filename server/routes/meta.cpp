#include "server/routes/meta.h"

#include <unistd.h>

#include <iterator>

#include "server/error_codes.h"
#include "server/process_metrics.h"

namespace relit::server {
namespace {

Reply status_reply(const char* json) {
    Reply reply{.content_type = "application/json", .body = json};
    reply.headers.emplace("Cache-Control", "no-store");
    return reply;
}

// Nothing of them where their database is out of reach: the rest is told all the same.
void add_batches(std::vector<PlainMetric>& list, Services& services) {
    list.push_back({"relit_streams", "Event streams and archives being sent.", false,
                    double(services.batches.streams().open())});
    try {
        const JobCounts counts = services.batches.store().counts();
        const PlainMetric metrics[] = {
            {"relit_batches", "Batches that are kept.", false, double(counts.batches)},
            {"relit_unfinished_batches", "Batches that wait or run.", false,
             double(counts.unfinished_batches)},
            {"relit_batch_frames_waiting", "Frames of batches that wait.", false,
             double(counts.waiting_frames)},
            {"relit_batch_frames_running", "Frames of batches that are rendered or stored.", false,
             double(counts.leased_frames)},
            {"relit_batch_queue_age_seconds", "Since the oldest unfinished batch was submitted.",
             false, counts.queue_age_s},
            {"relit_batch_result_bytes", "Size of the pictures of all batches.", false,
             double(counts.result_bytes)}};
        list.insert(list.end(), std::begin(metrics), std::end(metrics));
    } catch (const Error&) {  // logged
    }
}

// What others keep, asked for at this moment.
std::vector<PlainMetric> gauges(const Services& services) {
    const ImageStore& images = services.images;
    const RenderSlots &renders = services.renders, &decodes = services.decodes;
    return {
        {"relit_renders_running", "Renders that have a slot.", false, double(renders.running())},
        {"relit_renders_waiting", "Renders in the queue.", false, double(renders.waiting())},
        {"relit_renders_overloaded", "1 while the queue is kept short, for it has been full.",
         false, renders.overloaded() ? 1.0 : 0.0},
        {"relit_decodes_running", "Uploads being decoded.", false, double(decodes.running())},
        {"relit_decodes_waiting", "Uploads that wait to be decoded.", false,
         double(decodes.waiting())},
        {"relit_stored_bytes", "Size of all stored images.", false, double(images.stored_bytes())},
        {"relit_stored_images", "Images stored.", false, double(images.stored_images())},
        {"relit_evicted_images_total", "Images that went to make room for others.", true,
         double(images.evicted_images())},
        {"relit_cache_bytes",
         "Size of the decoded maps that are kept, and of what was made of them.", false,
         double(services.cache.bytes())},
        {"relit_cache_hits_total",
         "Things asked of the cache that were there, or being made already.", true,
         double(services.cache.hits())},
        {"relit_cache_misses_total", "Things asked of the cache that had to be made.", true,
         double(services.cache.misses())},
    };
}

}  // namespace

std::string_view version() { return RELIT_VERSION; }

Reply get_health(const Request&, Services&) { return status_reply(R"({"status":"ok"})"); }

Reply get_readiness(const Request&, Services& services) {
    if (services.draining) throw Error(error_code::shutting_down, "The server is stopping.");
    if (::access(services.data_dir.c_str(), W_OK | X_OK) != 0)
        throw Error(error_code::not_ready, "The data folder cannot be written.");
    return status_reply(R"({"status":"ready"})");
}

Reply get_metrics(const Request&, Services& services) {
    auto others = gauges(services);
    add_batches(others, services);
    const auto process = process_metrics();
    others.insert(others.end(), process.begin(), process.end());
    Reply reply{.content_type = std::string(metrics_media_type),
                .body = metrics_text(services.metrics, version(), others)};
    reply.headers.emplace("Cache-Control", "no-store");
    return reply;
}

Reply get_version(const Request&, Services&) {
    Reply reply{.content_type = "application/json",
                .body = R"({"name":"relit","version":")" + std::string(version()) + "\"}"};
    reply.headers.emplace("Cache-Control", "no-cache");
    return reply;
}

}  // namespace relit::server
