#include "server/http/message.h"
#include "server/text.h"

#include <algorithm>

namespace relit::server {
namespace {

std::string_view without_weakness(std::string_view etag) {
    return etag.starts_with("W/") ? etag.substr(2) : etag;
}

}  // namespace

bool HeaderLess::operator()(std::string_view a, std::string_view b) const {
    return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end(),
                                        [](char x, char y) { return lower(x) < lower(y); });
}

std::optional<std::string> Request::header(std::string_view name) const {
    const auto found = headers.find(name);
    if (found == headers.end()) return std::nullopt;
    return found->second;
}

std::optional<std::string> Request::query_value(const std::string& name) const {
    const auto found = query.find(name);
    if (found == query.end()) return std::nullopt;
    return found->second;
}

bool has_etag(const Request& request, std::string_view etag) {
    const auto header = request.header("If-None-Match");
    if (!header) return false;
    std::string_view rest = *header;
    if (trimmed(rest) == "*") return true;
    // Our tags hold no comma, so splitting at commas inside quotes can only fail to match.
    while (!rest.empty()) {
        const auto comma = rest.find(',');
        const auto tag = trimmed(rest.substr(0, comma));
        if (without_weakness(tag) == without_weakness(etag)) return true;
        rest = comma == std::string_view::npos ? std::string_view{} : rest.substr(comma + 1);
    }
    return false;
}

Reply not_modified(std::string_view etag, std::string_view cache_control) {
    Reply reply;
    reply.status = 304;
    reply.headers = {{"ETag", std::string(etag)}, {"Cache-Control", std::string(cache_control)}};
    return reply;
}

}  // namespace relit::server
