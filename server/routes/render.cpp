#include "server/routes/render.h"

#include <spdlog/fmt/fmt.h>

#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

#include "server/error_codes.h"
#include "server/routes/query.h"
#include "server/routes/render_request.h"
#include "server/scenes/picture_etag.h"
#include "server/scenes/picture_file.h"
#include "server/scenes/scene_loading.h"

namespace relit::server {
namespace {

using Clock = std::chrono::steady_clock;

// Everything that a URL with ids in it names stays what it is.
constexpr const char* cache_for_good = "public, max-age=31536000, immutable";

// How long each stage took, for the request's spans and the metrics.
class Stages {
public:
    Stages(Spans& spans, Metrics& metrics) : spans_(spans), metrics_(metrics) {}

    void parsed() { spans_.push_back({"parse", next()}); }
    void done(RenderStage stage) { took(stage, next()); }
    // Of stages that took turns.
    void took(RenderStage stage, Clock::duration took) {
        (void)next();
        metrics_.observe(stage, took);
        spans_.push_back({render_stage_names[std::size_t(stage)], took});
    }

private:
    Clock::duration next() {
        const auto begin = std::exchange(begin_, Clock::now());
        return begin_ - begin;
    }

    Spans& spans_;
    Metrics& metrics_;
    Clock::time_point begin_ = Clock::now();
};

// The header Server-Timing, in milliseconds.
std::string timing_text(const Spans& spans) {
    std::string text;
    for (const Span& span : spans)
        text +=
            fmt::format("{}{};dur={:.2f}", text.empty() ? "" : ", ", span.stage, span.took.count());
    return text;
}

// Sets a stop source at a time, unless it goes first.
class Alarm {
public:
    Alarm(Clock::time_point at, std::stop_source& stop)
        : thread_([at, &stop](const std::stop_token& gone) {
              std::mutex mutex;
              std::unique_lock lock(mutex);
              std::condition_variable_any never;
              never.wait_until(lock, gone, at, [] { return false; });
              if (!gone.stop_requested()) stop.request_stop();
          }) {}

private:
    std::jthread thread_;
};

// Works until done, the client's leaving, a newer request of its session, or the deadline,
// whichever is first.
void in_time(const Request& request, const std::stop_token& superseded,
             const std::function<void(std::stop_token)>& work) {
    std::stop_source stop;
    const std::stop_callback leave(request.client_gone, [&] { stop.request_stop(); });
    const std::stop_callback give_way(superseded, [&] { stop.request_stop(); });
    const Alarm alarm(request.deadline, stop);
    try {
        work(stop.get_token());
    } catch (const Error& e) {
        if (e.code != error_code::cancelled || request.client_gone.stop_requested()) throw;
        if (superseded.stop_requested())
            throw Error(error_code::superseded,
                        "a newer request of the same Relit-Session stopped this one");
        throw Error(error_code::timed_out, "the picture was not ready in time (render-timeout)", {},
                    "render-timeout");
    }
}

// "final", or "preview" and what was coarser than in the final picture.
std::string accuracy_text(const Output& output, const PictureFacts& picture) {
    if (output.accuracy == Accuracy::final) return "final";
    std::string text = "preview";
    if (picture.coarse_map) text += fmt::format("; map={}x{}", picture.width, picture.height);
    if (picture.coarse_environment > 0)
        text += fmt::format("; environment={}", picture.coarse_environment);
    if (picture.coarse_transport) text += "; transport=coarse";
    return text;
}

// Counts how a render ends that was let into the queue.
template <class Render>
Reply counted(Metrics& metrics, const Render& render) {
    const auto result_of = [](std::string_view code) {
        return code == error_code::cancelled    ? RenderResult::cancelled
               : code == error_code::timed_out  ? RenderResult::timed_out
               : code == error_code::superseded ? RenderResult::superseded
                                                : RenderResult::failed;
    };
    try {
        Reply reply = render();
        metrics.count(RenderResult::done);
        return reply;
    } catch (const Error& e) {
        if (e.code != error_code::queue_full) metrics.count(result_of(e.code));
        throw;
    } catch (...) {
        metrics.count(RenderResult::failed);
        throw;
    }
}

// What a picture's name in caches is: its ETag, unless it is a preview.
struct Caching {
    std::string etag;
    bool cacheable = false;
    bool unchanged = false;  // the client has it, if there is such a picture
};

Reply picture_in_turn(const RenderRequest& job, const Caching& caching, const std::string& session,
                      const Request& request, Services& services, Stages& stages) {
    const FindImage find = find_in(job, services.images);  // in use until the picture is done
    const auto slot =
        services.renders.wait_for_slot(request.deadline, request.client_gone, session);
    stages.done(RenderStage::queue);
    Scene scene;
    PictureFile file;
    in_time(request, slot.stop_token(), [&](const std::stop_token& stop) {
        const auto decode = [&](std::string_view bytes) {
            return services.decoder.decode(bytes, {stop});
        };
        scene =
            load_scene(job.scene, find, decode, services.limits, services.executor, services.cache);
        stages.done(RenderStage::decode);
        if (caching.unchanged) return;
        file = picture_file(scene, job.scene, job.scene_text,
                            {.executor = services.executor,
                             .stop = stop,
                             .simd = services.simd,
                             .cache = &services.cache});
        stages.took(RenderStage::render, file.render_time);
        stages.took(RenderStage::encode, file.encode_time);
    });
    if (caching.unchanged) return not_modified(caching.etag, cache_for_good);
    const PictureFacts& picture = file.picture;
    Reply reply;
    reply.body = std::move(file.bytes);
    reply.content_type = media_type_of(job.scene.output.format);
    services.metrics.rendered_pixels +=
        std::uint64_t(picture.width) * std::uint64_t(picture.height);
    reply.headers["Server-Timing"] = timing_text(request.spans);
    reply.headers["Relit-Accuracy"] = accuracy_text(job.scene.output.picture, picture);
    reply.headers["Cache-Control"] = caching.cacheable ? cache_for_good : "no-store";
    if (caching.cacheable) reply.headers["ETag"] = caching.etag;
    if (const auto& range = scene.field->rescaled_from)
        reply.headers["Relit-Height-Range"] =
            fmt::format("{} {}", float(range->min), float(range->max));
    return reply;
}

}  // namespace

Reply render_picture(const Request& request, Services& services) {
    Stages stages(request.spans, services.metrics);
    const std::string session = token_header(request, "Relit-Session");
    const RenderRequest job = parse_render_request(request, services.limits);
    Caching caching;
    caching.etag = picture_etag(job.scene_text);
    caching.cacheable = job.scene.output.picture.accuracy == Accuracy::final;
    caching.unchanged = request.is_get() && caching.cacheable && has_etag(request, caching.etag);
    // "*" names whatever picture there is: that there is one is known when its images are loaded.
    const bool any = request.header("If-None-Match") == "*";
    if (caching.unchanged && !any) {
        services.renders.supersede(session);
        return not_modified(caching.etag, cache_for_good);
    }
    stages.parsed();
    return counted(services.metrics, [&] {
        return picture_in_turn(job, caching, session, request, services, stages);
    });
}

}  // namespace relit::server
