#include "server/routes/routes.h"

#include "server/routes/images.h"
#include "server/routes/meta.h"
#include "server/routes/render.h"

namespace relit::server {

std::vector<Route> routes(const Limits& limits) {
    return {
        {"POST", "/v1/images", put_image, limits.max_image_bytes, "max-image-bytes"},
        {"GET", "/v1/images/{id}", get_image},
        {"GET", "/v1/images/{id}/content", get_image_content},
        {"DELETE", "/v1/images/{id}", delete_image},
        {"GET", "/v1/render", render_picture},
        {"POST", "/v1/render", render_picture, limits.max_body_bytes, "max-body-bytes"},
        {"GET", "/v1/version", get_version},
        {"GET", "/healthz", get_health},
    };
}

}  // namespace relit::server
