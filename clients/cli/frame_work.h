// Frames made: here, by all processors, or by a server, as a batch.
#pragma once

#include <span>
#include <string>

#include "clients/cli/frame_folder.h"
#include "clients/cli/frames.h"
#include "clients/cli/progress.h"

namespace relit::cli {

/// Renders frames side by side, and gives each to `folder` when it is done. One that cannot be
/// rendered is told there, and the others go on.
/// @param threads  0: one per processor
/// @throws Failure of FrameFolder::keep(), when the frames being rendered are done
void render_frames_here(std::span<const Frame> frames, FrameImages& images, int threads,
                        FrameFolder& folder);

/// The same by a server's batches. A batch is noted in the folder before it is sent, with its
/// Idempotency-Key: the next program goes on with it, and nothing is rendered twice. Afterwards it
/// is removed from the server.
/// @throws Failure unreachable, refused with the server's own sentence
void render_frames_there(const std::string& url, std::vector<Frame> frames, FrameImages& images,
                         FrameFolder& folder, Progress& progress);

}  // namespace relit::cli
