// The pages for people: `/` to try reliefs and lights, `/docs` to read the interface. Their files
// (clients/page) are in the program, so that they work wherever it runs and ask nothing of any
// other host.
#pragma once

#include "server/http/message.h"
#include "server/services.h"

namespace relit::server {

Reply get_front_page(const Request& request, Services& services);  ///< GET /
Reply get_docs_page(const Request& request, Services& services);   ///< GET /docs

/// GET /page/{file}: what the pages are made of.
/// @throws Error not_found
Reply get_page_file(const Request& request, Services& services);

}  // namespace relit::server
