#include "server/http/router.h"

#include <algorithm>
#include <chrono>
#include <new>
#include <optional>
#include <set>

#include "server/access/access.h"
#include "server/error_codes.h"
#include "server/http/cors.h"
#include "server/http/problem.h"
#include "server/logging/log.h"
#include "server/services.h"

namespace relit::server {
namespace {

using Clock = std::chrono::steady_clock;

std::vector<std::string_view> segments_of(std::string_view path) {
    std::vector<std::string_view> segments;
    for (;;) {
        const auto slash = path.find('/');
        segments.push_back(path.substr(0, slash));
        if (slash == std::string_view::npos) return segments;
        path.remove_prefix(slash + 1);
    }
}

bool is_parameter(std::string_view segment) {
    return segment.starts_with('{') && segment.ends_with('}');
}

bool fits(const std::vector<std::string_view>& pattern, const std::vector<std::string_view>& path) {
    return std::equal(pattern.begin(), pattern.end(), path.begin(), path.end(),
                      [](std::string_view wanted, std::string_view segment) {
                          return is_parameter(wanted) ? !segment.empty() : wanted == segment;
                      });
}

PathParams params_of(const std::vector<std::string_view>& pattern,
                     const std::vector<std::string_view>& path) {
    PathParams params;
    for (std::size_t i = 0; i < pattern.size(); ++i)
        if (is_parameter(pattern[i]))
            params.emplace(pattern[i].substr(1, pattern[i].size() - 2), path[i]);
    return params;
}

// A method as a label: a client can send any word.
std::string_view method_label(const Request& request) {
    if (request.head) return "HEAD";
    constexpr std::string_view known[] = {"GET", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"};
    const auto* const found = std::find(std::begin(known), std::end(known), request.method);
    return found == std::end(known) ? "other" : *found;
}

void count(const Router& router, const Request& request, const Reply& reply, Clock::duration time,
           Metrics& metrics) {
    const auto route = router.pattern_of(request.path);
    ++metrics.requests.of({route, method_label(request), reply.status});
    metrics.request_times.of(route).observe(time);
    if (!reply.error_code.empty()) ++metrics.errors.of(reply.error_code);
    if (!reply.limit.empty()) ++metrics.limit_refusals.of(reply.limit);
}

// A reply is what its type says, no page's frame, and loads nothing; the pages have policies of their
// own. Pictures may be shown by pages of other origins unless no other origin may read anything.
void add_browser_headers(const CorsPolicy& cors, Reply& reply) {
    reply.headers.emplace("X-Content-Type-Options", "nosniff");
    if (reply.status != 304)  // a cache would put it in the place of the page's own
        reply.headers.emplace(
            "Content-Security-Policy",
            "default-src 'none'; style-src 'unsafe-inline'; frame-ancestors 'none'");
    reply.headers.emplace("Cross-Origin-Resource-Policy",
                          cors.allow == CorsPolicy::Allow::none ? "same-origin" : "cross-origin");
    reply.headers.emplace("Referrer-Policy", "no-referrer");  // URLs may be signed
}

void finish(const Router& router, const Request& request, Reply& reply, Clock::time_point start,
            Services& services) {
    reply.headers.insert_or_assign("X-Request-Id", request.id);
    if (!request.trace.trace_id.empty())
        reply.headers.insert_or_assign("traceresponse", traceparent_text(request.trace));
    add_browser_headers(services.cors, reply);
    add_access_headers(request, reply);
    add_cors_headers(services.cors, request, reply);
    count(router, request, reply, Clock::now() - start, services.metrics);
}

void log_failure(const Request& request, std::string_view reason) {
    const LogField fields[] = {
        {"id", request.id}, {"trace", request.trace.trace_id}, {"reason", reason}};
    log_event(spdlog::level::err, "request failed", fields);
}

Reply answer_error(const Router& router, const Request& request, const Error& error) {
    Reply reply = problem_reply(error);
    if (error.code == error_code::method_not_allowed)
        reply.headers.emplace("Allow", router.allowed_methods(request.path));
    return reply;
}

Reply answer_options(const Router& router, const Request& request, const CorsPolicy& cors) {
    const auto allowed = router.allowed_methods(request.path);
    if (allowed.empty()) throw Error(error_code::not_found, "There is nothing at this path.");
    Reply reply;
    reply.status = 204;
    reply.headers.emplace("Allow", allowed);
    add_preflight_headers(cors, request, allowed, reply);
    return reply;
}

Reply call_handler(const Router& router, Request& request, Services& services) {
    if (request.method == "OPTIONS") return answer_options(router, request, services.cors);
    auto [route, params] = router.match(request.method, request.path);
    request.path_params = std::move(params);
    return route.handler(request, services);
}

}  // namespace

Router::Router(const std::vector<Route>& routes) {
    for (const Route& route : routes) entries_.push_back({route, segments_of(route.pattern)});
    const auto parameters = [](const Entry& entry) {
        return std::count_if(entry.segments.begin(), entry.segments.end(), is_parameter);
    };
    std::stable_sort(entries_.begin(), entries_.end(),
                     [&](const Entry& a, const Entry& b) { return parameters(a) < parameters(b); });
}

Router::Match Router::match(std::string_view method, std::string_view path) const {
    const auto segments = segments_of(path);
    bool path_exists = false;
    for (const Entry& entry : entries_) {
        if (!fits(entry.segments, segments)) continue;
        path_exists = true;
        if (entry.route.method == method) return {entry.route, params_of(entry.segments, segments)};
    }
    if (!path_exists) throw Error(error_code::not_found, "There is nothing at this path.");
    throw Error(error_code::method_not_allowed,
                "The method does not apply to this path; it takes " + allowed_methods(path) + ".");
}

Scope Router::scope_of(std::string_view method, std::string_view path) const {
    const auto segments = segments_of(path);
    for (const Entry& entry : entries_)
        if (entry.route.method == method && fits(entry.segments, segments))
            return entry.route.scope;
    return Scope::open;
}

bool Router::answers_while_stopping(std::string_view path) const {
    const auto segments = segments_of(path);
    return std::any_of(entries_.begin(), entries_.end(), [&](const Entry& entry) {
        return entry.route.while_stopping && fits(entry.segments, segments);
    });
}

std::string_view Router::pattern_of(std::string_view path) const {
    const auto segments = segments_of(path);
    for (const Entry& entry : entries_)
        if (fits(entry.segments, segments)) return entry.route.pattern;
    return "none";
}

std::string Router::allowed_methods(std::string_view path) const {
    const auto segments = segments_of(path);
    std::set<std::string_view> methods;
    for (const Entry& entry : entries_)
        if (path == "*" || fits(entry.segments, segments)) methods.insert(entry.route.method);
    if (methods.empty()) return {};
    methods.insert("OPTIONS");
    if (methods.contains("GET")) methods.insert("HEAD");
    std::string list;
    for (const auto method : methods) list.append(list.empty() ? "" : ", ").append(method);
    return list;
}

Reply dispatch(const Router& router, Request& request, Services& services) {
    const auto start = Clock::now();
    Reply reply;
    try {
        reply = call_handler(router, request, services);
    } catch (const Error& error) {
        reply = answer_error(router, request, error);
    } catch (const std::bad_alloc&) {
        log_failure(request, "out of memory");
        reply = problem_reply({error_code::memory_full, "The server is out of memory for now."});
    } catch (const std::exception& error) {
        log_failure(request, error.what());
        reply = problem_reply({error_code::internal, "The server failed to answer."});
    } catch (...) {
        log_failure(request, "unknown");
        reply = problem_reply({error_code::internal, "The server failed to answer."});
    }
    finish(router, request, reply, start, services);
    return reply;
}

Reply refuse(const Router& router, const Request& request, const Error& error, Services& services) {
    Reply reply = answer_error(router, request, error);
    finish(router, request, reply, Clock::now(), services);
    return reply;
}

}  // namespace relit::server
