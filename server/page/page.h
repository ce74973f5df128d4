// The pages for people: `/` to try reliefs and lights, `/docs` to read the interface; and the
// modules for pages of others. Their files (clients/studio, clients/js) are in the program, so that
// they work wherever it runs and ask nothing of any other host.
#pragma once

#include "server/http/message.h"
#include "server/services.h"

namespace relit::server {

Reply get_front_page(const Request& request, Services& services);  ///< GET /
Reply get_docs_page(const Request& request, Services& services);   ///< GET /docs

Reply get_js_client(const Request& request, Services& services);  ///< GET /relit.js
Reply get_js_jobs(const Request& request, Services& services);    ///< GET /relit-jobs.js

/// GET /page/{file}: what the pages are made of.
/// @throws Error not_found
Reply get_page_file(const Request& request, Services& services);

}  // namespace relit::server
