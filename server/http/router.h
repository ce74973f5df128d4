// From method and path to a handler, and from what a handler returns or throws to the reply. One
// table of routes, no regular expressions; the transport asks the router before it reads a body.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/error.h"
#include "server/access/scope.h"
#include "server/http/message.h"

namespace relit::server {

struct Services;

using Handler = Reply (*)(const Request&, Services&);

/// One row of the table.
struct Route {
    std::string_view method;  ///< "GET" answers HEAD too
    std::string_view pattern;  ///< "/v1/images/{id}/content": a name in braces takes one whole segment
    Handler handler = nullptr;
    Scope scope = Scope::admin;        ///< of the key that it takes, where the server has keys
    std::size_t max_body_bytes = 0;    ///< refused from the Content-Length on, or when counted
    std::string_view limit_name = {};  ///< the setting behind max_body_bytes, for the refusal
    bool while_stopping = false;       ///< answered also when the server takes no more work
};

using PathParams = std::map<std::string, std::string>;

/// The table. Its order does not matter: a literal segment goes before a parameter.
class Router {
public:
    explicit Router(const std::vector<Route>& routes);

    struct Match {
        const Route& route;
        PathParams params;
    };

    /// The route of a request.
    /// @throws Error not_found (no pattern fits), method_not_allowed (one fits, with other methods)
    [[nodiscard]] Match match(std::string_view method, std::string_view path) const;

    /// The scope of a request's route; open for what is only told about, as OPTIONS and 404 are.
    [[nodiscard]] Scope scope_of(std::string_view method, std::string_view path) const;

    /// The pattern that a path fits, whatever its methods; "none" where there is no such path.
    [[nodiscard]] std::string_view pattern_of(std::string_view path) const;

    /// Whether a path is answered also when the server takes no more work.
    [[nodiscard]] bool answers_while_stopping(std::string_view path) const;

    /// What `Allow` lists for a path, "GET, HEAD, OPTIONS, POST"; empty where there is no such
    /// path.
    [[nodiscard]] std::string allowed_methods(std::string_view path) const;

private:
    struct Entry {
        Route route;
        std::vector<std::string_view> segments;
    };
    std::vector<Entry> entries_;
};

/// Answers a request: match, call the handler, turn what it throws into a problem document. OPTIONS
/// is answered here with `Allow`. Every reply carries `X-Request-Id`, `traceresponse`, the headers of CORS,
/// of access and those that keep browsers careful; every request is counted. Whether the client may ask
/// was decided before: Access::admit().
[[nodiscard]] Reply dispatch(const Router& router, Request& request, Services& services);

/// Answers a request that is refused before a handler sees it: with the same headers, and
/// counted as well.
[[nodiscard]] Reply refuse(const Router& router, const Request& request, const Error& error,
                           Services& services);

}  // namespace relit::server
