#include "server/routes/meta.h"

namespace relit::server {

std::string_view version() { return RELIT_VERSION; }

Reply get_health(const Request&, Services&) {
    Reply reply{.content_type = "application/json", .body = R"({"status":"ok"})"};
    reply.headers.emplace("Cache-Control", "no-store");
    return reply;
}

Reply get_version(const Request&, Services&) {
    Reply reply{.content_type = "application/json",
                .body = R"({"name":"relit","version":")" + std::string(version()) + "\"}"};
    reply.headers.emplace("Cache-Control", "no-cache");
    return reply;
}

}  // namespace relit::server
