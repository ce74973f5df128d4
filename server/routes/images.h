// Images: stored once under the hash of their bytes, so that a client may upload blindly and refer
// by id.
#pragma once

#include "server/http/message.h"
#include "server/services.h"

namespace relit::server {

Reply put_image(const Request& request, Services& services);    ///< POST /v1/images
Reply list_images(const Request& request, Services& services);  ///< GET /v1/images?limit=&after=
Reply get_image(const Request& request, Services& services);    ///< GET /v1/images/{id}
Reply get_image_content(const Request& request,
                        Services& services);                     ///< GET /v1/images/{id}/content
Reply delete_image(const Request& request, Services& services);  ///< DELETE /v1/images/{id}

}  // namespace relit::server
