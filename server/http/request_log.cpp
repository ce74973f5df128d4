#include "server/http/request_log.h"

#include <spdlog/spdlog.h>

#include <atomic>
#include <random>
#include <vector>

#include "server/logging/log.h"
#include "server/text.h"

namespace relit::server {
namespace {

constexpr std::size_t longest_id = 128;
constexpr std::size_t longest_path = 200;  // in the log

std::string new_request_id() {
    static const auto run = [] {
        std::random_device device;
        return (std::uint64_t(device()) << 32) | device();
    }();
    static std::atomic<std::uint64_t> count{0};
    return fmt::format("{:012x}-{:x}", run & 0xffffffffffff, ++count);
}

std::vector<LogField> fields_of(const Request& request, const RequestOutcome& outcome,
                                std::string_view path) {
    std::vector<LogField> fields = {
        {"id", request.id},
        {"method", request.head ? std::string_view("HEAD") : std::string_view(request.method)},
        {"path", path},
        {"status", std::int64_t(outcome.status)},
        {"bytes", std::int64_t(outcome.body_bytes)},
        {"duration_ms", outcome.total.count()}};
    if (outcome.received.count() > 0)
        fields.push_back({"receive", outcome.received.count(), "spans_ms"});
    for (const Span& span : request.spans)
        fields.push_back({span.stage, span.took.count(), "spans_ms"});
    fields.push_back({"send", (outcome.total - outcome.made).count(), "spans_ms"});
    const auto add = [&](std::string_view name, std::string_view text) {
        if (!text.empty()) fields.push_back({name, text});
    };
    add("client", request.address);
    add("key", request.admission.key);
    add("error", outcome.error_code);
    if (outcome.disconnected) fields.push_back({"disconnected", true});
    add("trace", request.trace.trace_id);
    add("span", request.trace.span_id);
    add("parent_span", request.trace.parent_id);
    return fields;
}

}  // namespace

void log_request(const Request& request, const RequestOutcome& outcome,
                 std::chrono::milliseconds slow) {
    const auto time = outcome.streamed ? outcome.made : outcome.total;
    const bool is_slow = slow.count() > 0 && time >= slow;
    const auto level = is_slow ? spdlog::level::warn : spdlog::level::info;
    if (!spdlog::should_log(level)) return;
    std::string path = request.path.substr(0, longest_path);
    if (path.size() < request.path.size()) path += "...";
    log_event(level, is_slow ? "slow request" : "request", fields_of(request, outcome, path));
}

std::string request_id_of(const Headers& headers) {
    const auto given = headers.find("X-Request-Id");
    if (given == headers.end()) return new_request_id();
    const std::string& id = given->second;
    const bool good = !id.empty() && id.size() <= longest_id &&
                      consists_of(id, lower_letters, upper_letters, digits, "-_.:+/=@~");
    return good ? id : new_request_id();
}

}  // namespace relit::server
