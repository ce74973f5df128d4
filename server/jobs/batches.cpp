#include "server/jobs/batches.h"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include "core/base/parallel.h"
#include "server/error_codes.h"
#include "server/http/problem.h"
#include "server/random_hex.h"
#include "server/scenes/picture_file.h"
#include "server/scenes/scene_loading.h"
#include "server/schema/scene_json.h"

namespace relit::server {
namespace {

constexpr auto requests_are_over = std::chrono::milliseconds(250);  // a drag goes on after pauses

Error no_such_batch() { return {error_code::not_found, "There is no batch with this id."}; }

int workers_of(const BatchNeeds& needs) {
    const int wanted = needs.limits.max_batch_renders;
    return wanted > 0 ? wanted : needs.threads;
}

// While requests are rendered; at least one, so that batches go on.
int busy_workers_of(const BatchNeeds& needs) {
    return std::max(1, workers_of(needs) * needs.limits.batch_share / 100);
}

std::string problem_text(const Error& error) { return problem_reply(error).body; }

RenderedFrame render_frame(const std::string& text, const std::stop_token& stop,
                           const Executor& executor, const BatchNeeds& needs) {
    const SceneDescription description = parse_scene(text, needs.limits.max_lights);
    const auto find = [&](const ImageSource& source) { return needs.images.get(source.text); };
    const auto decode = [&](std::string_view bytes) { return needs.decoder.decode(bytes, {stop}); };
    const Scene scene = load_scene(description, find, decode, needs.limits, executor, needs.cache);
    PictureFile file = picture_file(
        scene, description, text,
        {.executor = executor, .stop = stop, .simd = needs.simd, .cache = &needs.cache});
    needs.metrics.rendered_pixels +=
        std::uint64_t(file.picture.width) * std::uint64_t(file.picture.height);
    return {std::move(file.bytes), std::string(media_type_of(description.output.format))};
}

// Frames side by side, each on its part of the threads: nothing waits for the slowest row of a frame.
RenderFrame frame_renderer(const BatchNeeds& needs) {
    const auto executor = std::make_shared<const Executor>(
        std::max(1, needs.threads / std::max(1, workers_of(needs))));
    return [executor, &needs](const std::string& scene, const std::stop_token& stop) {
        return render_frame(scene, stop, *executor, needs);
    };
}

}  // namespace

Batches::Batches(const std::filesystem::path& folder, const BatchNeeds& needs)
    : needs_(needs),
      store_(folder / "batches.db",
             {.max_unfinished_batches = needs.limits.max_unfinished_batches,
              .worker_lost_problem =
                  problem_text({error_code::worker_lost,
                                "the program ended three times while it rendered the frame"})}),
      results_(folder),
      streams_(needs.limits.streams_at_once()),
      runner_(
          store_, results_,
          {.workers = workers_of(needs),
           .busy_workers = busy_workers_of(needs),
           .renderer = [this] { return frame_renderer(needs_); },
           .is_busy = [this] { return needs_.renders.idle_for() < requests_are_over; },
           .counted =
               [this](bool done, std::string_view limit) {
                   ++needs_.metrics.batch_frames[done ? 0 : 1];
                   if (!limit.empty()) ++needs_.metrics.limit_refusals.of(limit);
               },
           .changed = [this](const std::string& batch, bool finished) { changed(batch, finished); },
           .problem = problem_text,
           .frame_timeout = needs.limits.batch_frame_timeout,
           .expiry = needs.limits.batch_expiry,
           .max_result_bytes = needs.limits.max_result_bytes}) {}

Batches::~Batches() = default;

void Batches::start() {
    hold_images_of_unfinished("");
    runner_.start();
}

// Of one batch, or of all. An image that is gone is found out by its frames.
void Batches::hold_images_of_unfinished(const std::string& only) try {
    for (const auto& [batch, ids] : store_.unfinished()) {
        if (!only.empty() && batch != only) continue;
        HeldImages held;
        for (const std::string& id : ids) try {
                held[id] = needs_.images.get(id);
            } catch (const Error&) {
                continue;
            }
        const std::scoped_lock lock(mutex_);
        images_[batch] = std::move(held);
    }
} catch (const Error&) {  // logged: the database is out of reach for now
}

void Batches::changed(const std::string& batch, bool finished) {
    if (finished) {
        const std::scoped_lock lock(mutex_);
        images_.erase(batch);
    }
    news_.announce(batch);
}

Batches::KeyInUse::KeyInUse(Batches& batches, std::string key)
    : batches_(batches), key_(std::move(key)) {
    if (key_.empty()) return;
    const std::scoped_lock lock(batches_.mutex_);
    if (!batches_.keys_in_use_.insert(key_).second)
        throw Error(error_code::conflict,
                    "A request with this Idempotency-Key is being worked on; try again.");
}

Batches::KeyInUse::~KeyInUse() {
    const std::scoped_lock lock(batches_.mutex_);
    batches_.keys_in_use_.erase(key_);
}

// The images are held before a worker can finish the batch and let go of them.
JobStore::Submitted Batches::submit(const NewBatch& batch, HeldImages images) {
    {
        const std::scoped_lock lock(mutex_);
        images_[batch.id] = std::move(images);
    }
    const auto let_go = [&] {
        const std::scoped_lock lock(mutex_);
        images_.erase(batch.id);
    };
    try {
        auto submitted = store_.submit(batch);
        if (submitted.repeated) let_go();
        runner_.wake();
        return submitted;
    } catch (...) {
        let_go();
        throw;
    }
}

void Batches::remove(const std::string& id) {
    if (!store_.remove(id)) throw no_such_batch();
    runner_.abandon(id);
    results_.remove(id);
    changed(id, true);
}

void Batches::retry(const std::string& id) {
    if (!store_.retry_failed(id)) throw no_such_batch();
    hold_images_of_unfinished(id);
    runner_.wake();
    const auto batch = store_.find(id);  // it may have ended before its images were held
    changed(id, !batch || batch->finished);
}

BatchFacts Batches::find(const std::string& id) {
    auto batch = store_.find(id);
    if (!batch) throw no_such_batch();
    return std::move(*batch);
}

SharedBytes Batches::picture(const std::string& batch, const std::string& file) try {
    return results_.get(batch, file);
} catch (const Error& error) {
    if (error.code == error_code::not_found && store_.find(batch))
        spdlog::error("batches: the picture {} of {} was removed by somebody else", file, batch);
    throw;
}

std::string Batches::new_id() { return random_hex(4); }

}  // namespace relit::server
