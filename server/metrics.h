// What the server has done, as numbers that only rise: counted where the thing happens, with an
// atomic addition each, and read by GET /metrics. Gauges (who waits, who is connected) are asked of
// their owners when the metrics are read.
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace relit::server {

using Count = std::atomic<std::uint64_t>;

/// How often a time fell into which range.
class Histogram {
public:
    /// Upper ends of the ranges, in seconds; one more has none.
    static constexpr std::array<double, 16> bounds_s = {
        0.0005, 0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1, 2.5, 5, 10, 30, 60};

    void observe(std::chrono::duration<double> time);

    [[nodiscard]] std::array<std::uint64_t, bounds_s.size() + 1> counts() const;
    [[nodiscard]] double sum_s() const;

private:
    std::array<Count, bounds_s.size() + 1> counts_{};
    Count sum_ns_{0};
};

/// One metric for each set of labels that has occurred; finding one takes no lock. For few labels
/// of our own making: they are compared one after another and never forgotten, and must outlive
/// the family.
template <class Labels, class Value>
class Family {
public:
    Family() = default;
    ~Family() {
        for (const Member* member = first_; member;) {
            const Member* next = member->next;
            delete member;
            member = next;
        }
    }
    Family(const Family&) = delete;
    Family& operator=(const Family&) = delete;

    Value& of(const Labels& labels) {
        if (Value* value = find(labels)) return *value;
        const std::scoped_lock lock(adding_);
        if (Value* value = find(labels)) return *value;
        auto* member = new Member{labels, {}, first_.load()};
        first_.store(member, std::memory_order_release);
        return member->value;
    }

    /// Calls `visit(labels, value)` for each.
    template <class Visit>
    void each(const Visit& visit) const {
        for (const Member* member = first_.load(std::memory_order_acquire); member;
             member = member->next)
            visit(member->labels, member->value);
    }

private:
    struct Member {
        Labels labels;
        Value value;
        Member* next;
    };
    Value* find(const Labels& labels) {
        for (Member* member = first_.load(std::memory_order_acquire); member; member = member->next)
            if (member->labels == labels) return &member->value;
        return nullptr;
    }

    std::atomic<Member*> first_{nullptr};
    std::mutex adding_;
};

struct RequestLabels {
    std::string_view route;  ///< its pattern, never the path
    std::string_view method;
    int status = 0;
    auto operator<=>(const RequestLabels&) const = default;
};

enum class RenderStage { decode, queue, render, encode };
inline constexpr std::array<std::string_view, 4> render_stage_names = {"decode", "queue", "render",
                                                                       "encode"};

/// How a render that was let into the queue ended.
enum class RenderResult { done, cancelled, timed_out, superseded, failed };
inline constexpr std::array<std::string_view, 5> render_result_names = {
    "done", "cancelled", "timed_out", "superseded", "failed"};

/// How an image's decoding ended. `crashed`: without an answer; `abandoned`: nobody waited any longer;
/// `failed`: there was no process for it.
enum class DecodeResult { done, refused, too_costly, crashed, abandoned, failed };
inline constexpr std::array<std::string_view, 6> decode_result_names = {
    "done", "refused", "too_costly", "crashed", "abandoned", "failed"};

/// Bytes of all connections, heads included.
struct Traffic {
    Count received{0};
    Count sent{0};
};

struct Metrics {
    Family<RequestLabels, Count> requests;
    Family<std::string_view, Histogram> request_times;  ///< by route, until the reply is made
    Family<std::string_view, Count> errors;             ///< by code
    Family<std::string_view, Count> limit_refusals;     ///< by the setting behind them
    std::array<Histogram, render_stage_names.size()> stage_times;  ///< by RenderStage
    std::array<Count, render_result_names.size()> renders{};       ///< by RenderResult
    std::array<Count, 2> batch_frames{};                           ///< done, failed
    std::array<Count, decode_result_names.size()> decodes{};       ///< by DecodeResult
    Histogram decode_times;                                        ///< of those that are done
    Count rendered_pixels{0};
    Traffic traffic;
    std::atomic<int> connections{0};          ///< open now, each with a thread
    std::atomic<int> waiting_connections{0};  ///< open now, in line for a thread
    Count refused_connections{0};             ///< for which there was no place in line

    void count(RenderResult result) { ++renders[std::size_t(result)]; }
    void count(DecodeResult result) { ++decodes[std::size_t(result)]; }
    void observe(RenderStage stage, std::chrono::duration<double> time) {
        stage_times[std::size_t(stage)].observe(time);
    }
};

/// A number without labels that somebody else keeps.
struct PlainMetric {
    std::string_view name;
    std::string_view help;
    bool rises = false;  ///< a counter, or else a gauge
    double value = 0;
};

/// All of it in Prometheus's text format, version 0.0.4.
///
/// @param version  of the program
/// @param others   written after the metrics
[[nodiscard]] std::string metrics_text(const Metrics& metrics, std::string_view version,
                                       std::span<const PlainMetric> others);

inline constexpr std::string_view metrics_media_type = "text/plain; version=0.0.4; charset=utf-8";

}  // namespace relit::server
