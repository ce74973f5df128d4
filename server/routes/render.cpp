#include "server/routes/render.h"

#include <spdlog/fmt/fmt.h>

#include <condition_variable>
#include <mutex>
#include <thread>

#include "core/render/render.h"
#include "server/error_codes.h"
#include "server/routes/render_request.h"
#include "server/scenes/scene_loading.h"

namespace relit::server {
namespace {

using Clock = std::chrono::steady_clock;

// Everything that a URL with ids in it names stays what it is.
constexpr const char* cache_for_good = "public, max-age=31536000, immutable";

// Milliseconds of each stage, for Server-Timing.
class Stages {
public:
    void done(std::string_view stage) {
        const auto now = Clock::now();
        const std::chrono::duration<double, std::milli> took = now - begin_;
        begin_ = now;
        text_ += fmt::format("{}{};dur={:.2f}", text_.empty() ? "" : ", ", stage, took.count());
    }
    [[nodiscard]] const std::string& text() const { return text_; }

private:
    Clock::time_point begin_ = Clock::now();
    std::string text_;
};

FindImage find_in(const RenderRequest& job, const Services& services) {
    return [&](const ImageSource& source) -> SharedBytes {
        const auto brought = job.brought.find(source.text);
        if (brought != job.brought.end()) return {nullptr, brought->second};
        try {
            return services.images.get(source.text);
        } catch (const Error& e) {
            if (e.code != error_code::not_found) throw;
            throw Error(error_code::not_found, "there is no image of this id: upload it (again)",
                        source.pointer);
        }
    };
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

// Renders until done, the client's leaving, or the deadline, whichever is first.
Picture render_in_time(const Scene& scene, const Output& output, const Request& request,
                       const Executor& executor) {
    std::stop_source stop;
    const std::stop_callback leave(request.client_gone, [&] { stop.request_stop(); });
    const Alarm alarm(request.deadline, stop);
    try {
        return render(scene, output, {executor, stop.get_token()});
    } catch (const Error& e) {
        if (e.code != error_code::cancelled || request.client_gone.stop_requested()) throw;
        throw Error(error_code::timed_out, "the picture was not ready in time (render-timeout)");
    }
}

// "final", or "preview" and what was coarser than in the final picture.
std::string accuracy_text(const Output& output, const Picture& picture) {
    if (output.accuracy == Accuracy::final) return "final";
    std::string text = "preview";
    if (picture.coarse_map)
        text += fmt::format("; map={}x{}", picture.pixels.width, picture.pixels.height);
    if (picture.coarse_environment)
        text += fmt::format("; environment={}", preview_environment.regions);
    return text;
}

}  // namespace

Reply render_picture(const Request& request, Services& services) {
    Stages stages;
    const RenderRequest job = parse_render_request(request, services.limits);
    const std::string etag = etag_of(job);
    const bool cacheable = job.scene.output.picture.accuracy == Accuracy::final;
    const bool unchanged = request.is_get() && cacheable && has_etag(request, etag);
    // "*" names whatever picture there is: that there is one is known when its images are loaded.
    const bool any = request.header("If-None-Match") == "*";
    if (unchanged && !any) return not_modified(etag, cache_for_good);
    stages.done("parse");

    const auto slot = services.renders.wait_for_slot(request.deadline, request.client_gone);
    stages.done("queue");
    const Scene scene =
        load_scene(job.scene, find_in(job, services), services.limits, services.executor);
    stages.done("decode");
    if (unchanged) return not_modified(etag, cache_for_good);
    const Output output = picture_output(job.scene.output);
    const Picture picture = render_in_time(scene, output, request, services.executor);
    stages.done("render");

    Reply reply;
    reply.content_type = media_type_of(job.scene.output.format);
    reply.body = encode(picture.pixels, encode_options(job.scene.output, job.scene_text));
    stages.done("encode");
    reply.headers["Server-Timing"] = stages.text();
    reply.headers["Relit-Accuracy"] = accuracy_text(output, picture);
    reply.headers["Cache-Control"] = cacheable ? cache_for_good : "no-store";
    if (cacheable) reply.headers["ETag"] = etag;
    if (const auto& range = scene.field.rescaled_from)
        reply.headers["Relit-Height-Range"] =
            fmt::format("{} {}", float(range->min), float(range->max));
    return reply;
}

}  // namespace relit::server
