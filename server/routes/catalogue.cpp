#include "server/routes/catalogue.h"

#include "server/http/problem.h"
#include "server/routes/meta.h"
#include "server/routes/query.h"
#include "server/routes/routes.h"
#include "server/schema/capabilities_json.h"
#include "server/schema/media_json.h"
#include "server/schema/openapi.h"
#include "server/schema/presets.h"
#include "server/schema/samples_json.h"
#include "server/storage/sha256.h"

namespace relit::server {
namespace {

// Texts that change with the program only: asked for again and again by pages, sent once.
Reply text_reply(const Request& request, std::string text) {
    allow_parameters(request, {});
    constexpr std::string_view ask_again = "no-cache";
    const std::string etag = strong_etag(text);
    if (has_etag(request, etag)) return not_modified(etag, ask_again);
    Reply reply{.content_type = "application/json", .body = std::move(text)};
    reply.headers = {{"ETag", etag}, {"Cache-Control", std::string(ask_again)}};
    return reply;
}

}  // namespace

Reply get_presets(const Request& request, Services&) { return text_reply(request, presets_json()); }

Reply get_samples(const Request& request, Services&) { return text_reply(request, samples_json()); }

Reply get_media(const Request& request, Services&) { return text_reply(request, media_json()); }

Reply get_capabilities(const Request& request, Services& services) {
    return text_reply(request, capabilities_json(version(), services.limits));
}

Reply get_openapi(const Request& request, Services& services) {
    std::vector<ProblemCode> problems;
    for (const ProblemKind& kind : problem_kinds())
        problems.push_back({kind.code, kind.status, kind.title});
    std::vector<OperationScope> scopes;
    for (const Route& route : routes(services.limits))
        scopes.push_back({route.method, route.pattern, name_of(route.scope)});
    return text_reply(request, openapi_json({.version = version(),
                                             .max_lights = services.limits.max_lights,
                                             .problems = problems,
                                             .scopes = scopes}));
}

}  // namespace relit::server
