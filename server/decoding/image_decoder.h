// Decoding of images from outside, as routes, batches and the store ask for it: in processes apart
// (DecodePool), or in a test's own.
#pragma once

#include <chrono>
#include <functional>
#include <stop_token>
#include <string_view>

#include "core/io/decode.h"

namespace relit::server {

/// Who waits for it, and how long.
struct DecodeControl {
    std::stop_token stop{};
    std::chrono::steady_clock::time_point deadline = std::chrono::steady_clock::time_point::max();
};

/// Both throw Error as relit::decode() does, and cancelled (`stop`), timed_out (`deadline`),
/// too_costly, not_ready. Safe from any thread.
struct ImageDecoder {
    std::function<DecodedImage(std::string_view bytes, const DecodeControl& control)> decode;

    /// Decodes all of it and keeps none of its texels: a file that passes can be decoded.
    std::function<ImageInfo(std::string_view bytes, const DecodeControl& control)> check;
};

}  // namespace relit::server
