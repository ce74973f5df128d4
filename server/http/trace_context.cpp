#include "server/http/trace_context.h"

#include <spdlog/fmt/fmt.h>

#include <cstdint>
#include <random>

#include "server/text.h"

namespace relit::server {
namespace {

// "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01"
constexpr std::size_t version_00_size = 55;

bool is_lower_hex(std::string_view text) { return consists_of(text, digits, "abcdef"); }

bool is_id(std::string_view text) {
    return is_lower_hex(text) && text.find_first_not_of('0') != std::string_view::npos;
}

std::uint64_t random_id() {
    thread_local std::mt19937_64 random = [] {
        std::random_device device;
        std::seed_seq seed{device(), device(), device(), device()};
        return std::mt19937_64(seed);
    }();
    for (;;)
        if (const std::uint64_t id = random()) return id;
}

}  // namespace

std::optional<TraceContext> parse_traceparent(std::string_view header) {
    if (header.size() < version_00_size || header[2] != '-' || header[35] != '-' ||
        header[52] != '-')
        return std::nullopt;
    const auto version = header.substr(0, 2), trace = header.substr(3, 32),
               parent = header.substr(36, 16), flags = header.substr(53, 2);
    if (!is_lower_hex(version) || version == "ff" || !is_id(trace) || !is_id(parent) ||
        !is_lower_hex(flags))
        return std::nullopt;
    // A later version may say more, behind another dash.
    if (header.size() > version_00_size && (version == "00" || header[version_00_size] != '-'))
        return std::nullopt;
    return TraceContext{.trace_id = std::string(trace),
                        .parent_id = std::string(parent),
                        .span_id = {},
                        .sampled = (hex_digit(flags[1]) & 1) != 0};
}

TraceContext trace_of_request(std::optional<std::string_view> traceparent) {
    TraceContext trace;
    if (auto given = traceparent ? parse_traceparent(*traceparent) : std::nullopt)
        trace = std::move(*given);
    else trace.trace_id = fmt::format("{:016x}{:016x}", random_id(), random_id());
    trace.span_id = fmt::format("{:016x}", random_id());
    return trace;
}

std::string traceparent_text(const TraceContext& trace) {
    return fmt::format("00-{}-{}-{:02x}", trace.trace_id, trace.span_id, trace.sampled ? 1 : 0);
}

}  // namespace relit::server
