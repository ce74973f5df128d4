// relit sweep, relit batch: many pictures into a folder, and only those that are missing.
#include <spdlog/fmt/fmt.h>

#include "clients/cli/commands.h"
#include "clients/cli/failure.h"
#include "clients/cli/frame_folder.h"
#include "clients/cli/frame_work.h"
#include "clients/cli/frames.h"

namespace relit::cli {
namespace {

void make_frames(FrameJob job, const Options& options, Console console) {
    const auto frames = frames_of_shard(std::move(job.frames), options.shard);
    console.progress.begin("looking for frames");
    FrameFolder folder(options.output, options.shard, console);
    folder.check_targets(frames, job.files);
    const std::vector<Frame> missing = folder.missing(frames);
    if (missing.size() < frames.size())
        console.progress.say(fmt::format("relit: {} of {} frames are there already",
                                         frames.size() - missing.size(), frames.size()));
    if (missing.empty()) return;
    FrameImages images(std::move(job.images));
    folder.expect(missing.size());
    const std::string& url = options.scene.server;
    if (url.empty()) render_frames_here(missing, images, options.scene.threads, folder);
    else render_frames_there(url, missing, images, folder, console.progress);
    if (folder.failed() > 0)
        throw Failure(Exit::refused,
                      fmt::format("{} of {} frames failed", folder.failed(), frames.size()));
}

}  // namespace

void sweep_command(const Options& options, Console console) {
    console.progress.begin("reading");
    make_frames(read_sweep(options), options, console);
}

void batch_command(const Options& options, Console console) {
    console.progress.begin("reading");
    make_frames(read_manifest(options), options, console);
}

}  // namespace relit::cli
