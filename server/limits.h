// Every cap of the server in one struct: what a request may cost before it is refused. The names of
// the settings (server/config.cpp) are these names with dashes; an error about a limit names it so.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>

#include "core/io/decode.h"

namespace relit::server {

/// Of one JSON text: its tree takes far more memory than its bytes.
struct JsonLimits {
    int max_depth = 64;          ///< levels of objects and lists
    int max_values = 2'000'000;  ///< numbers, strings, objects, lists, ...
};

struct Limits {
    // What a request may bring.
    std::size_t max_head_bytes = 32 << 10;  ///< request line and headers
    std::size_t max_uri_bytes = 16 << 10;   ///< the request line's target
    int max_headers = 100;
    std::size_t max_image_bytes = 256u << 20;      ///< one image file
    std::size_t max_body_bytes = 320u << 20;       ///< any body, all parts of a form together
    std::size_t max_body_memory_bytes = 1u << 30;  ///< bodies of all requests in flight
    JsonLimits json;                               ///< settings max-json-depth, max-json-values
    int max_parts = 80;                            ///< of a multipart/form-data body
    std::size_t max_part_head_bytes = 8 << 10;     ///< of each of them

    // What images and scenes may ask for.
    std::int64_t max_image_pixels = 64LL << 20;
    std::int64_t max_interlaced_pixels = 32LL << 20;  ///< of files that a decoder holds whole
    int max_image_side = 32768;
    int max_image_channels = 4;
    std::int64_t max_image_values = 192LL << 20;  ///< pixels times channels
    std::int64_t max_tile_bytes = 64LL << 20;     ///< of a tiled file's tile
    std::int64_t max_environment_pixels = 32LL << 20;
    std::int64_t max_output_pixels = 64LL << 20;
    int max_lights = 64;
    /// Texels times samples of light, about 45 ns of a thread each (scene_cost.h): some minutes.
    std::int64_t max_scene_cost = 10'000'000'000;
    std::size_t max_render_memory_bytes = 12ull
                                          << 30;  ///< of one picture, as scene_cost.h tells it

    // What is kept.
    std::size_t max_storage_bytes = 10ull << 30;  ///< all stored images; old ones go for new ones

    std::size_t max_cache_bytes = 512u
                                  << 20;  ///< decoded maps kept for the requests that come after

    // Batches.
    std::size_t max_batch_bytes = 64u << 20;  ///< the body that submits one
    int max_batch_frames = 10'000;            ///< of one batch
    int max_unfinished_batches = 10'000;
    int max_batch_renders = 0;  ///< frames rendered at once; 0: one for every thread
    int batch_share = 50;  ///< percent of them that may begin while requests are being rendered
    std::size_t max_result_bytes = 20ull
                                   << 30;  ///< pictures of all batches; finished ones go for new
    std::chrono::seconds batch_frame_timeout{600};
    std::chrono::seconds batch_expiry{7 * 86400};  ///< of a batch after its last frame

    // How much goes on at once.
    int max_streams = 0;  ///< replies that are made while they are sent; 0: 80 % of max_connections
    int max_connections = 256;
    int max_waiting_connections = 1024;  ///< beyond those; they are served when others end
    int max_address_connections = 0;     ///< of one address, waiting ones included; 0: any number
    int max_renders = 0;                 ///< 0: one for every two threads
    int max_queue = 64;  ///< renders that wait, and apart from them uploads that wait to be decoded
    int max_decodes = 1;     ///< uploads checked at once; each takes one of decode_workers
    int decode_workers = 2;  ///< processes that decode, one image at a time each
    std::size_t max_decode_memory_bytes = 1536u << 20;  ///< of each, beyond its program

    // How much a client may ask for: the one with a key, or an address.
    int rate_limit = 0;    ///< requests a second; 0: any number
    int rate_burst = 100;  ///< at once, after a pause

    // How long things may take.
    std::chrono::seconds idle_timeout{20};   ///< between two requests of a connection
    std::chrono::seconds head_timeout{10};   ///< from a head's first byte to its last
    std::chrono::seconds read_timeout{5};    ///< between two pieces of a request
    std::chrono::seconds write_timeout{10};  ///< between two pieces of a reply
    std::size_t min_bytes_per_second =
        32 << 10;  ///< of a body or reply, on average, after write_timeout
    std::chrono::seconds transfer_timeout{600};  ///< a request's body, or a reply, in all
    std::chrono::seconds decode_timeout{30};     ///< of one image, once it has a process
    std::chrono::seconds render_timeout{60};     ///< from the arrival of a request to its picture
    std::chrono::seconds stop_timeout{20};  ///< for the requests under way when the server stops

    /// Streams hold a connection each; the rest is left for requests that end.
    [[nodiscard]] int streams_at_once() const {
        return max_streams > 0 ? max_streams : max_connections * 4 / 5;
    }
};

/// What of it the decoder is to hold files to.
[[nodiscard]] inline DecodeLimits decode_limits(const Limits& limits) {
    DecodeLimits decode;
    decode.max_pixels = limits.max_image_pixels;
    decode.max_interlaced_pixels = std::min(limits.max_interlaced_pixels, limits.max_image_pixels);
    decode.max_side = limits.max_image_side;
    decode.max_channels = limits.max_image_channels;
    decode.max_values = limits.max_image_values;
    decode.max_tile_bytes = limits.max_tile_bytes;
    return decode;
}

}  // namespace relit::server
