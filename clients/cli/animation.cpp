#include "clients/cli/animation.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <optional>

#include "clients/cli/failure.h"
#include "clients/cli/limits_here.h"
#include "core/base/error.h"
#include "core/io/decode.h"
#include "core/io/webp_animation.h"
#include "server/schema/scene_json.h"
#include "server/text.h"

namespace relit::cli {
namespace {

namespace fs = std::filesystem;

// The whole text as a number from `least` to `most`.
template <class Number>
std::optional<Number> number_in(const std::string& text, Number least, Number most) {
    const auto number = server::parse_number<Number>(text);
    return number && *number >= least && *number <= most ? number : std::nullopt;
}

AnimationOptions options_of(const AnimationFlags& flags) {
    const auto rate = number_in(flags.frames_per_second, 1.0, 90.0);
    if (!rate)
        throw Failure(Exit::usage, fmt::format("--fps: '{}' is not a number from 1 to 90",
                                               flags.frames_per_second));
    if (flags.quality == lossless_word) return {*rate, std::nullopt};
    const auto quality = number_in(flags.quality, 1, 100);
    if (!quality)
        throw Failure(Exit::usage, fmt::format("--animation-quality: '{}' is not 1 to 100 or {}",
                                               flags.quality, lossless_word));
    return {*rate, quality};
}

fs::path path_of(const Options& options, const Frame& frame) {
    return fs::path(options.output) / frame.name;
}

void add_frame(WebpAnimation& animation, const fs::path& path, const Executor& executor) {
    const Input file = read_file(path);
    try {
        animation.add(decode(file.bytes, server::decode_limits(limits_here())).image, executor);
    } catch (const Error& e) {
        throw Failure(Exit::refused, file.name + ": " + part_of_line(e.what()));
    }
}

}  // namespace

void check_animation(const AnimationFlags& flags, const std::string& shard) {
    if (flags.target.empty()) return;
    if (!shard.empty())
        throw Failure(Exit::usage,
                      "--animation takes all frames: give it without --shard over the "
                      "same folder when the shards are done");
    const fs::path target = flags.target;
    std::string ending = target.extension().string();
    std::transform(ending.begin(), ending.end(), ending.begin(), server::lower);
    std::error_code ignored;
    if (!ending.empty() && ending != ".webp" && !fs::is_other(target, ignored))
        throw Failure(Exit::usage, fmt::format("--animation: {} does not end in .webp, which is "
                                               "what an animation is written as",
                                               flags.target));
    (void)options_of(flags);
}

void check_animation_target(const Options& options, std::span<const Frame> frames,
                            std::span<const fs::path> files) {
    const std::string& target = options.animation.target;
    if (target.empty()) return;
    check_target(target, files);
    std::error_code ignored;
    const fs::path path = fs::weakly_canonical(target, ignored);
    for (const Frame& frame : frames) {
        if (target != "-" && fs::weakly_canonical(path_of(options, frame), ignored) == path)
            throw Failure(Exit::usage,
                          target + ": is a frame too; give the animation another name");
        const auto scene = server::parse_scene(frame.scene, limits_here().max_lights);
        if (scene.output.format == PictureFormat::exr)
            throw Failure(Exit::usage, frame.name +
                                           ": is OpenEXR, which holds linear light; "
                                           "--animation takes png, jpeg and webp");
    }
}

void write_animation(const Options& options, std::span<const Frame> frames, Console console) {
    const AnimationFlags& flags = options.animation;
    const Executor executor(options.scene.threads);
    console.progress.begin("animation");
    WebpAnimation animation(options_of(flags));
    for (std::size_t i = 0; i < frames.size(); ++i) {
        add_frame(animation, path_of(options, frames[i]), executor);
        console.progress.count(int(i + 1), int(frames.size()));
    }
    console.progress.begin("writing");
    console.outputs.write(flags.target, animation.finish());
}

}  // namespace relit::cli
