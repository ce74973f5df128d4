// The frames of a sweep or a batch as one animated WebP, when all of them are there.
#pragma once

#include <filesystem>
#include <span>

#include "clients/cli/commands.h"
#include "clients/cli/frames.h"

namespace relit::cli {

/// Refuses, before anything is read, what cannot become an animation.
/// @throws Failure usage, naming the flag
void check_animation(const AnimationFlags& flags, const std::string& shard);

/// The same of what it is made of and goes to, before the first frame is made.
/// @param folder  of the frames; there
/// @param files   the inputs
/// @throws Failure usage (OpenEXR frames, a target that is a frame or an input), what
///         check_target() throws
void check_animation_target(const Options& options, std::span<const Frame> frames,
                            std::span<const std::filesystem::path> files);

/// Reads the frames from the folder in their order, one at a time, and writes the animation.
/// @pre all are there
/// @throws Failure refused, naming the frame that cannot be read or is of another size;
///         unreachable
void write_animation(const Options& options, std::span<const Frame> frames, Console console);

}  // namespace relit::cli
