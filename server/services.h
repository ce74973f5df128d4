// What handlers work with: made once in main.cpp, or by a test, and passed to every handler.
#pragma once

#include "core/base/parallel.h"
#include "server/jobs/render_slots.h"
#include "server/limits.h"
#include "server/storage/image_store.h"

namespace relit::server {

struct Services {
    ImageStore& images;
    RenderSlots& renders;  ///< who may render, and who waits
    RenderSlots& decodes;  ///< who may decode an upload: one image is three times its pixels in memory
    Executor& executor;
    Limits limits;
};

}  // namespace relit::server
