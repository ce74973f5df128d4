// What a request says besides JSON: its target with flat parameters, its headers, a form.
#include <algorithm>
#include <string>

#include "server/access/signed_url.h"
#include "server/http/head.h"
#include "server/http/multipart.h"
#include "server/routes/query.h"
#include "server/routes/render_request.h"
#include "server/routes/routes.h"
#include "server/schema/scene_json.h"
#include "tests/fuzz/claims.h"
#include "tests/fuzz/targets.h"

namespace relit::fuzz {
namespace {

using namespace server;

// The first line of `input`, taken from it with its end.
std::string_view take_line(std::string_view& input) {
    const auto line = input.substr(0, input.find('\n'));
    input.remove_prefix(std::min(line.size() + 1, input.size()));
    return line;
}

std::string head_of(std::string_view input) {
    std::string text = "GET " + std::string(take_line(input)) + " HTTP/1.1\r\nHost: a\r\n";
    while (!input.empty()) text += std::string(take_line(input)) + "\r\n";
    return text + "\r\n";
}

Request request_of(const Head& head, const Router& router) {
    Request request;
    request.method = "GET";
    request.path = head.path;
    request.target = head.target;
    request.query = head.query;
    request.headers = head.headers;
    request.path_params = router.match("GET", head.path).params;
    return request;
}

void claim_form_is_its_parts(std::string_view body, const std::vector<Part>& parts) {
    std::size_t size = 0;
    for (const Part& part : parts) {
        size += part.content.size();
        claim(!part.name.empty(), "every part has a name");
        claim(body.find(part.content) != std::string_view::npos, "parts are pieces of the body");
    }
    claim(size <= body.size(), "parts are no more than the body");
}

}  // namespace

void parameters(std::string_view input) {
    static const Limits limits{.json = {.max_depth = 16, .max_values = 500}, .max_lights = 4};
    static const Router router(routes(limits));
    const std::string text = head_of(input);
    const HeadEnd end = find_head_end(text);
    if (end.state != HeadEnd::complete || end.size != text.size()) return;
    Head head;
    if (!accepts([&] { head = parse_head(text, limits); })) return;
    claim(head.path.find('\0') == std::string::npos, "a path has no end within");
    if (const auto target = split_signed(head.target))
        claim(!is_signed_by("a key that nobody has", *target), "no URL is signed without the key");
    Request request;
    if (!accepts([&] { request = request_of(head, router); })) return;
    (void)accepts([&] { (void)page_size(request); });
    (void)accepts([&] { (void)token_header(request, "Relit-Session"); });
    RenderRequest render;
    if (accepts([&] { render = parse_render_request(request, limits); }))
        claim(scene_json(parse_scene(render.scene_text, limits.max_lights)) == render.scene_text,
              "a scene in its one form is read as it is written: " + render.scene_text);
}

void multipart(std::string_view input) {
    const Limits limits{.max_parts = 8};
    const std::string type(take_line(input));
    std::vector<Part> parts;
    if (!accepts([&] { parts = parse_multipart(std::string(input), type, limits); })) return;
    claim(parts.size() <= std::size_t(limits.max_parts), "a form keeps its limit");
    claim_form_is_its_parts(input, parts);
}

}  // namespace relit::fuzz
