// relit sweep, relit batch: many pictures into a folder, and only those that are missing.
#include <spdlog/fmt/fmt.h>

#include "clients/cli/animation.h"
#include "clients/cli/commands.h"
#include "clients/cli/failure.h"
#include "clients/cli/frame_folder.h"
#include "clients/cli/frame_work.h"
#include "clients/cli/frames.h"

namespace relit::cli {
namespace {

// What is missing, into the folder. @throws Failure refused when frames failed
void make_missing(std::span<const Frame> frames, FrameJob& job, const Options& options,
                  FrameFolder& folder, Progress& progress) {
    const std::vector<Frame> missing = folder.missing(frames);
    if (missing.size() < frames.size())
        progress.say(fmt::format("relit: {} of {} frames are there already",
                                 frames.size() - missing.size(), frames.size()));
    if (missing.empty()) return;
    FrameImages images(std::move(job.images));
    folder.expect(missing.size());
    const std::string& url = options.scene.server;
    if (url.empty()) render_frames_here(missing, images, options.scene.threads, folder);
    else render_frames_there(url, missing, images, folder, progress);
    if (folder.failed() == 0) return;
    const bool animated = !options.animation.target.empty();
    throw Failure(Exit::refused,
                  fmt::format("{} of {} frames failed", folder.failed(), frames.size()) +
                      (animated ? "; there is no animation without them" : ""));
}

void make_frames(FrameJob job, const Options& options, Console console) {
    const auto frames = frames_of_shard(std::move(job.frames), options.shard);
    console.progress.begin("looking for frames");
    FrameFolder folder(options.output, options.shard, console);
    folder.check_targets(frames, job.files);
    check_animation_target(options, frames, job.files);
    make_missing(frames, job, options, folder, console.progress);
    if (!options.animation.target.empty()) write_animation(options, frames, console);
}

}  // namespace

void sweep_command(const Options& options, Console console) {
    check_animation(options.animation, options.shard);
    console.progress.begin("reading");
    make_frames(read_sweep(options), options, console);
}

void batch_command(const Options& options, Console console) {
    check_animation(options.animation, options.shard);
    console.progress.begin("reading");
    make_frames(read_manifest(options), options, console);
}

}  // namespace relit::cli
