#include "server/routes/routes.h"

#include "server/page/page.h"
#include "server/routes/batches.h"
#include "server/routes/catalogue.h"
#include "server/routes/images.h"
#include "server/routes/meta.h"
#include "server/routes/render.h"
#include "server/routes/scene.h"

namespace relit::server {

std::vector<Route> routes(const Limits& limits) {
    return {
        {"GET", "/", get_front_page, Scope::open},
        {"GET", "/docs", get_docs_page, Scope::open},
        {"GET", "/studio/{file}", get_page_file, Scope::open},
        {"GET", "/relit.js", get_js_client, Scope::open},
        {"GET", "/relit-jobs.js", get_js_jobs, Scope::open},
        {"POST", "/v1/images", put_image, Scope::render, limits.max_image_bytes, "max-image-bytes"},
        {"GET", "/v1/images", list_images, Scope::read},
        {"GET", "/v1/images/{id}", get_image, Scope::read},
        {"GET", "/v1/images/{id}/content", get_image_content, Scope::read},
        {"DELETE", "/v1/images/{id}", delete_image, Scope::admin},
        {"GET", "/v1/images/{id}/relit.png", render_picture, Scope::render},
        {"GET", "/v1/images/{id}/relit.jpg", render_picture, Scope::render},
        {"GET", "/v1/images/{id}/relit.webp", render_picture, Scope::render},
        {"GET", "/v1/images/{id}/relit.exr", render_picture, Scope::render},
        {"POST", "/v1/batches", submit_batch, Scope::render, limits.max_batch_bytes,
         "max-batch-bytes"},
        {"GET", "/v1/batches", list_batches, Scope::read},
        {"GET", "/v1/batches/{id}", get_batch, Scope::read},
        {"DELETE", "/v1/batches/{id}", delete_batch, Scope::render},
        {"POST", "/v1/batches/{id}/retry", retry_batch, Scope::render},
        {"GET", "/v1/batches/{id}/events", get_batch_events, Scope::read},
        {"GET", "/v1/batches/{id}/frames/{n}", get_batch_frame, Scope::read},
        {"GET", "/v1/batches/{id}/archive", get_batch_archive, Scope::read},
        {"POST", "/v1/scene", check_scene, Scope::render, limits.max_body_bytes, "max-body-bytes"},
        {"GET", "/v1/render", render_picture, Scope::render},
        {"POST", "/v1/render", render_picture, Scope::render, limits.max_body_bytes,
         "max-body-bytes"},
        {"GET", "/v1/presets", get_presets, Scope::read},
        {"GET", "/v1/samples", get_samples, Scope::read},
        {"GET", "/v1/media", get_media, Scope::read},
        {"GET", "/v1/capabilities", get_capabilities, Scope::read},
        {"GET", "/v1/version", get_version, Scope::open},
        {"GET", "/openapi.json", get_openapi, Scope::open},
        {"GET", "/healthz", get_health, Scope::open, 0, {}, /*while_stopping=*/true},
        {"GET", "/readyz", get_readiness, Scope::open, 0, {}, /*while_stopping=*/true},
        {"GET", "/metrics", get_metrics, Scope::admin, 0, {}, /*while_stopping=*/true},
    };
}

}  // namespace relit::server
