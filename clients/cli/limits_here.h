// What a scene may ask for on this machine, which is the caller's own: the server's caps are for
// strangers. What the decoder holds files to by itself remains.
#pragma once

#include <limits>
#include <string_view>

#include "core/io/decode.h"
#include "server/limits.h"

namespace relit::cli {

[[nodiscard]] inline server::Limits limits_here() {
    constexpr auto endless = std::numeric_limits<std::int64_t>::max();
    server::Limits limits;
    limits.max_image_pixels = endless;
    limits.max_environment_pixels = endless;
    limits.max_output_pixels = endless;
    limits.max_image_values = endless;
    limits.max_scene_cost = endless;
    limits.max_render_memory_bytes = std::numeric_limits<std::size_t>::max();
    limits.json.max_values = std::numeric_limits<int>::max();
    limits.max_lights = 1'000'000;
    limits.max_batch_frames = 1'000'000;
    return limits;
}

/// A file of the caller's own, decoded in this process.
[[nodiscard]] inline DecodedImage decode_here(std::string_view bytes) {
    return decode(bytes, server::decode_limits(limits_here()));
}

}  // namespace relit::cli
