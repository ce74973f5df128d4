// What the server offers: presets, samples, media, formats and limits, and the interface's own
// description.
#pragma once

#include "server/http/message.h"
#include "server/services.h"

namespace relit::server {

Reply get_presets(const Request& request, Services& services);       ///< GET /v1/presets
Reply get_samples(const Request& request, Services& services);       ///< GET /v1/samples
Reply get_media(const Request& request, Services& services);         ///< GET /v1/media
Reply get_capabilities(const Request& request, Services& services);  ///< GET /v1/capabilities
Reply get_openapi(const Request& request, Services& services);       ///< GET /openapi.json

}  // namespace relit::server
