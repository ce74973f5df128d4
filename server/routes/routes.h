// The table of everything the server answers: method, pattern, handler, the scope of the
// key that it takes, and what a body may weigh.
#pragma once

#include <vector>

#include "server/http/router.h"
#include "server/limits.h"

namespace relit::server {

[[nodiscard]] std::vector<Route> routes(const Limits& limits);

}  // namespace relit::server
