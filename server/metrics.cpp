#include "server/metrics.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <iterator>
#include <utility>

namespace relit::server {
namespace {

using Labels = std::vector<std::pair<std::string_view, std::string>>;

// A label's value between quotes: backslash, quote and line feed are escaped.
std::string escaped(std::string_view text) {
    std::string result;
    for (const char c : text) {
        if (c == '\n') {
            result += "\\n";
        } else {
            if (c == '\\' || c == '"') result += '\\';
            result += c;
        }
    }
    return result;
}

void write_head(std::string& text, std::string_view name, std::string_view type,
                std::string_view help) {
    fmt::format_to(std::back_inserter(text), "# HELP {} {}\n# TYPE {} {}\n", name, help, name,
                   type);
}

template <class Number>
void write_sample(std::string& text, std::string_view name, const Labels& labels, Number value) {
    text += name;
    for (std::size_t i = 0; i < labels.size(); ++i)
        fmt::format_to(std::back_inserter(text), "{}{}=\"{}\"", i == 0 ? '{' : ',', labels[i].first,
                       escaped(labels[i].second));
    fmt::format_to(std::back_inserter(text), "{} {}\n", labels.empty() ? "" : "}", value);
}

// The ranges add up: each count is of all that took no longer.
void write_histogram(std::string& text, const std::string& name, const Histogram& histogram,
                     Labels labels) {
    const auto counts = histogram.counts();
    std::uint64_t total = 0;
    labels.emplace_back("le", "");
    for (std::size_t i = 0; i < counts.size(); ++i) {
        labels.back().second =
            i < Histogram::bounds_s.size() ? fmt::format("{}", Histogram::bounds_s[i]) : "+Inf";
        write_sample(text, name + "_bucket", labels, total += counts[i]);
    }
    labels.pop_back();
    write_sample(text, name + "_sum", labels, histogram.sum_s());
    write_sample(text, name + "_count", labels, total);
}

void write_http(std::string& text, const Metrics& metrics) {
    write_head(text, "relit_http_requests_total", "counter", "Requests answered.");
    metrics.requests.each([&](const RequestLabels& of, const Count& count) {
        write_sample(text, "relit_http_requests_total",
                     {{"route", std::string(of.route)},
                      {"method", std::string(of.method)},
                      {"status", std::to_string(of.status)}},
                     count.load());
    });
    write_head(text, "relit_errors_total", "counter", "Problem documents sent, by their code.");
    metrics.errors.each([&](std::string_view code, const Count& count) {
        write_sample(text, "relit_errors_total", {{"code", std::string(code)}}, count.load());
    });
    write_head(text, "relit_limit_refusals_total", "counter",
               "Refusals because of a limit, by its setting.");
    metrics.limit_refusals.each([&](std::string_view limit, const Count& count) {
        write_sample(text, "relit_limit_refusals_total", {{"limit", std::string(limit)}},
                     count.load());
    });
    write_head(text, "relit_request_seconds", "histogram",
               "Time from a whole request to its reply, before sending it.");
    metrics.request_times.each([&](std::string_view route, const Histogram& times) {
        write_histogram(text, "relit_request_seconds", times, {{"route", std::string(route)}});
    });
}

void write_renders(std::string& text, const Metrics& metrics) {
    write_head(text, "relit_render_stage_seconds", "histogram", "Time in each stage of a render.");
    for (std::size_t i = 0; i < render_stage_names.size(); ++i)
        write_histogram(text, "relit_render_stage_seconds", metrics.stage_times[i],
                        {{"stage", std::string(render_stage_names[i])}});
    write_head(text, "relit_renders_total", "counter",
               "Renders that were let into the queue, by how they ended.");
    for (std::size_t i = 0; i < render_result_names.size(); ++i)
        write_sample(text, "relit_renders_total", {{"result", std::string(render_result_names[i])}},
                     metrics.renders[i].load());
}

void write_decodes(std::string& text, const Metrics& metrics) {
    write_head(text, "relit_decodes_total", "counter",
               "Images given to a decoding process, by how that ended.");
    for (std::size_t i = 0; i < decode_result_names.size(); ++i)
        write_sample(text, "relit_decodes_total", {{"result", std::string(decode_result_names[i])}},
                     metrics.decodes[i].load());
    write_head(text, "relit_decode_seconds", "histogram",
               "Time to decode an image, with the wait for a process.");
    write_histogram(text, "relit_decode_seconds", metrics.decode_times, {});
}

}  // namespace

void Histogram::observe(std::chrono::duration<double> time) {
    const auto range = std::lower_bound(bounds_s.begin(), bounds_s.end(), time.count());
    counts_[std::size_t(range - bounds_s.begin())].fetch_add(1, std::memory_order_relaxed);
    const auto ns = std::chrono::duration_cast<std::chrono::nanoseconds>(time).count();
    sum_ns_.fetch_add(std::uint64_t(std::max<long long>(ns, 0)), std::memory_order_relaxed);
}

std::array<std::uint64_t, Histogram::bounds_s.size() + 1> Histogram::counts() const {
    std::array<std::uint64_t, bounds_s.size() + 1> counts{};
    std::transform(counts_.begin(), counts_.end(), counts.begin(),
                   [](const Count& count) { return count.load(std::memory_order_relaxed); });
    return counts;
}

double Histogram::sum_s() const { return 1e-9 * double(sum_ns_.load(std::memory_order_relaxed)); }

std::string metrics_text(const Metrics& metrics, std::string_view version,
                         std::span<const PlainMetric> others) {
    std::string text;
    write_head(text, "relit_build_info", "gauge", "Always 1; the version is a label.");
    write_sample(text, "relit_build_info", {{"version", std::string(version)}}, 1);
    write_http(text, metrics);
    write_renders(text, metrics);
    write_decodes(text, metrics);
    write_head(text, "relit_batch_frames_total", "counter", "Frames of batches that have ended.");
    for (std::size_t i = 0; i < 2; ++i)
        write_sample(text, "relit_batch_frames_total", {{"result", i == 0 ? "done" : "failed"}},
                     metrics.batch_frames[i].load());
    const auto counter = [&](std::string_view name, std::string_view help, const Count& count) {
        write_head(text, name, "counter", help);
        write_sample(text, name, {}, count.load());
    };
    counter("relit_rendered_pixels_total", "Pixels of finished pictures.", metrics.rendered_pixels);
    counter("relit_received_bytes_total", "Bytes that clients sent.", metrics.traffic.received);
    counter("relit_sent_bytes_total", "Bytes sent to clients.", metrics.traffic.sent);
    write_head(text, "relit_connections", "gauge", "Connections open, each with a thread.");
    write_sample(text, "relit_connections", {}, metrics.connections.load());
    write_head(text, "relit_waiting_connections", "gauge",
               "Connections open, in line for a thread.");
    write_sample(text, "relit_waiting_connections", {}, metrics.waiting_connections.load());
    write_head(text, "relit_refused_connections_total", "counter",
               "Connections for which there was no place in line.");
    write_sample(text, "relit_refused_connections_total", {}, metrics.refused_connections.load());
    for (const PlainMetric& other : others) {
        write_head(text, other.name, other.rises ? "counter" : "gauge", other.help);
        write_sample(text, other.name, {}, other.value);
    }
    return text;
}

}  // namespace relit::server
