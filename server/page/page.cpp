#include "server/page/page.h"

#include <algorithm>
#include <iterator>
#include <map>

#include "core/base/error.h"
#include "embedded/page.h"
#include "server/error_codes.h"
#include "server/storage/sha256.h"

namespace relit::server {
namespace {

// By the ending of a file's name.
std::string content_type(std::string_view name) {
    constexpr std::pair<std::string_view, std::string_view> types[] = {{".html", "text/html"},
                                                                       {".css", "text/css"},
                                                                       {".js", "text/javascript"},
                                                                       {".svg", "image/svg+xml"}};
    const auto type = std::find_if(std::begin(types), std::end(types),
                                   [&](const auto& t) { return name.ends_with(t.first); });
    return std::string(type->second) + "; charset=utf-8";
}

// Nothing from elsewhere, nothing inline, nobody's frame; pictures are blobs that the script fetched.
constexpr std::string_view content_policy =
    "default-src 'self'; img-src 'self' blob: data:; object-src 'none'; base-uri 'none'; "
    "form-action 'none'; frame-ancestors 'none'";

// A new version of the program has new pages under the same names, so a browser asks each time.
constexpr std::string_view always_ask = "no-cache";

struct PageFile {
    std::string_view bytes;
    std::string etag;
};

const auto& page_files() {
    static const auto all = [] {
        std::map<std::string_view, PageFile> files;
        for (const auto& [name, bytes] : embedded::page::files())
            files.emplace(name, PageFile{bytes, strong_etag(bytes)});
        return files;
    }();
    return all;
}

Reply file_reply(const Request& request, std::string_view name) {
    const auto found = page_files().find(name);
    if (found == page_files().end())
        throw Error(error_code::not_found, "There is nothing at this path.");
    const PageFile& file = found->second;
    if (has_etag(request, file.etag)) return not_modified(file.etag, always_ask);
    Reply reply{.content_type = content_type(name), .body = std::string(file.bytes)};
    reply.headers = {{"ETag", file.etag},
                     {"Cache-Control", std::string(always_ask)},
                     {"Content-Security-Policy", std::string(content_policy)},
                     {"Referrer-Policy", "no-referrer"}};
    return reply;
}

}  // namespace

Reply get_front_page(const Request& request, Services&) {
    return file_reply(request, "index.html");
}

Reply get_docs_page(const Request& request, Services&) { return file_reply(request, "docs.html"); }

Reply get_js_client(const Request& request, Services&) { return file_reply(request, "relit.js"); }

Reply get_js_jobs(const Request& request, Services&) {
    return file_reply(request, "relit-jobs.js");
}

Reply get_page_file(const Request& request, Services&) {
    return file_reply(request, request.path_params.at("file"));
}

}  // namespace relit::server
