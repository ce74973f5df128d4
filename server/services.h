// What handlers work with: made once in main.cpp, or by a test, and passed to every handler.
#pragma once

#include <atomic>
#include <filesystem>

#include "core/base/parallel.h"
#include "core/base/shared_cache.h"
#include "core/base/simd.h"
#include "server/access/access.h"
#include "server/decoding/image_decoder.h"
#include "server/http/cors.h"
#include "server/jobs/batches.h"
#include "server/jobs/render_slots.h"
#include "server/limits.h"
#include "server/metrics.h"
#include "server/storage/image_store.h"

namespace relit::server {

struct Services {
    ImageStore& images;
    RenderSlots& renders;  ///< who may render, and who waits
    Batches& batches;
    RenderSlots& decodes;  ///< who may have an upload decoded, and who waits
    Executor& executor;
    SharedCache& cache;  ///< decoded maps, and what is made of them, that requests share
    Metrics& metrics;
    Limits limits;
    ImageDecoder decoder;                   ///< of everything that comes from outside
    CorsPolicy cors;                        ///< which pages of other origins may read replies
    std::filesystem::path data_dir;         ///< has to be writable for /readyz
    Simd simd = best_simd();                ///< what renders run on; pictures are the same with any
    std::atomic<bool> draining{false};      ///< set once, when the server takes no more work
    std::atomic<bool> stopping{false};      ///< set once, when it takes no more connections
    Access access = {};                     ///< who may do what
    std::chrono::milliseconds log_slow{0};  ///< requests that take longer are warned of; 0: none
};

}  // namespace relit::server
