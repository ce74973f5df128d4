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
        {"GET", "/", get_front_page},
        {"GET", "/docs", get_docs_page},
        {"GET", "/studio/{file}", get_page_file},
        {"GET", "/relit.js", get_js_client},
        {"GET", "/relit-jobs.js", get_js_jobs},
        {"POST", "/v1/images", put_image, limits.max_image_bytes, "max-image-bytes"},
        {"GET", "/v1/images", list_images},
        {"GET", "/v1/images/{id}", get_image},
        {"GET", "/v1/images/{id}/content", get_image_content},
        {"DELETE", "/v1/images/{id}", delete_image},
        {"GET", "/v1/images/{id}/relit.png", render_picture},
        {"GET", "/v1/images/{id}/relit.jpg", render_picture},
        {"GET", "/v1/images/{id}/relit.webp", render_picture},
        {"GET", "/v1/images/{id}/relit.exr", render_picture},
        {"POST", "/v1/batches", submit_batch, limits.max_batch_bytes, "max-batch-bytes"},
        {"GET", "/v1/batches", list_batches},
        {"GET", "/v1/batches/{id}", get_batch},
        {"DELETE", "/v1/batches/{id}", delete_batch},
        {"POST", "/v1/batches/{id}/retry", retry_batch},
        {"GET", "/v1/batches/{id}/events", get_batch_events},
        {"GET", "/v1/batches/{id}/frames/{n}", get_batch_frame},
        {"GET", "/v1/batches/{id}/archive", get_batch_archive},
        {"POST", "/v1/scene", check_scene, limits.max_body_bytes, "max-body-bytes"},
        {"GET", "/v1/render", render_picture},
        {"POST", "/v1/render", render_picture, limits.max_body_bytes, "max-body-bytes"},
        {"GET", "/v1/presets", get_presets},
        {"GET", "/v1/samples", get_samples},
        {"GET", "/v1/capabilities", get_capabilities},
        {"GET", "/v1/version", get_version},
        {"GET", "/openapi.json", get_openapi},
        {"GET", "/healthz", get_health, 0, {}, /*while_stopping=*/true},
        {"GET", "/readyz", get_readiness, 0, {}, /*while_stopping=*/true},
        {"GET", "/metrics", get_metrics, 0, {}, /*while_stopping=*/true},
    };
}

}  // namespace relit::server
