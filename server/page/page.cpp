#include "server/page/page.h"

#include <algorithm>
#include <array>

#include "core/base/error.h"
#include "embedded/page.h"
#include "server/error_codes.h"
#include "server/storage/sha256.h"

namespace relit::server {
namespace {

namespace files = embedded::page;

constexpr std::string_view html = "text/html; charset=utf-8";
constexpr std::string_view css = "text/css; charset=utf-8";
constexpr std::string_view javascript = "text/javascript; charset=utf-8";
constexpr std::string_view svg = "image/svg+xml; charset=utf-8";

// Nothing from elsewhere, nothing inline, nobody's frame; pictures are blobs that the script fetched.
constexpr std::string_view content_policy =
    "default-src 'self'; img-src 'self' blob: data:; object-src 'none'; base-uri 'none'; "
    "form-action 'none'; frame-ancestors 'none'";

// A new version of the program has new pages under the same names, so a browser asks each time.
constexpr std::string_view always_ask = "no-cache";

struct PageFile {
    std::string_view name;
    std::string_view content_type;
    std::string_view bytes;
    std::string etag;
};

PageFile page_file(std::string_view name, std::string_view content_type, std::string_view bytes) {
    return {name, content_type, bytes, strong_etag(bytes)};
}

const auto& page_files() {
    static const auto all = std::to_array<PageFile>({
        page_file("index.html", html, files::index_html()),
        page_file("page.css", css, files::page_css()),
        page_file("page.js", javascript, files::page_js()),
        page_file("light.js", javascript, files::light_js()),
        page_file("scene.js", javascript, files::scene_js()),
        page_file("frames.js", javascript, files::frames_js()),
        page_file("docs.html", html, files::docs_html()),
        page_file("docs.css", css, files::docs_css()),
        page_file("docs.js", javascript, files::docs_js()),
        page_file("icon.svg", svg, files::icon_svg()),
        page_file("relit.js", javascript, files::relit_js()),
        page_file("relit-jobs.js", javascript, files::relit_jobs_js()),
    });
    return all;
}

Reply file_reply(const Request& request, std::string_view name) {
    const auto& all = page_files();
    const auto file =
        std::find_if(all.begin(), all.end(), [&](const PageFile& f) { return f.name == name; });
    if (file == all.end()) throw Error(error_code::not_found, "There is nothing at this path.");
    if (has_etag(request, file->etag)) return not_modified(file->etag, always_ask);
    Reply reply{.content_type = std::string(file->content_type), .body = std::string(file->bytes)};
    reply.headers = {{"ETag", file->etag},
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
