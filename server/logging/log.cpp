#include "server/logging/log.h"

#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/sink.h>
#include <spdlog/spdlog.h>

#include <mutex>

#include "server/logging/line_writer.h"
#include "server/schema/time_text.h"

namespace relit::server {
namespace {

constexpr std::chrono::seconds flush_patience{1};

// Of the line that this thread logs right now: a sink is called on the thread that logs.
thread_local std::span<const LogField> fields_of_line;

std::string_view name_of(spdlog::level::level_enum level) {
    const auto name = spdlog::level::to_string_view(level);
    return {name.data(), name.size()};
}

// Of the writer's own thread, which may outlive the sink.
std::string lost_line(LogFormat format, std::uint64_t lost) {
    constexpr std::string_view words = "log: lines were lost, for nobody took them";
    const auto now = std::chrono::system_clock::now();
    const LogField field{"lines", std::int64_t(lost)};
    if (format == LogFormat::json)
        return log_line_json(now, name_of(spdlog::level::warn), words, {&field, 1}) + '\n';
    return fmt::format("{} {} {} lines={}\n", time_text(now), name_of(spdlog::level::warn), words,
                       lost);
}

class LogSink final : public spdlog::sinks::sink {
public:
    LogSink(LogFormat format, int descriptor)
        : format_(format),
          text_(std::make_unique<spdlog::pattern_formatter>("%Y-%m-%dT%H:%M:%S.%e%z %l %v",
                                                            spdlog::pattern_time_type::local, "")),
          writer_({.descriptor = descriptor,
                   .tell_lost = [format](std::uint64_t lost) { return lost_line(format, lost); }}) {
    }

    void log(const spdlog::details::log_msg& message) override {
        writer_.add(line_of(message, fields_of_line));
    }
    void flush() override { writer_.flush(flush_patience); }
    void set_pattern(const std::string&) override {}  // the format decides
    void set_formatter(std::unique_ptr<spdlog::formatter>) override {}

private:
    std::string line_of(const spdlog::details::log_msg& message, std::span<const LogField> fields) {
        const std::string_view words(message.payload.data(), message.payload.size());
        if (format_ == LogFormat::json)
            return log_line_json(message.time, name_of(message.level), words, fields) + '\n';
        spdlog::memory_buf_t buffer;
        {
            const std::scoped_lock lock(formatting_);  // a formatter keeps the time of its last line
            text_->format(message, buffer);
        }
        std::string line(buffer.data(), buffer.size());
        for (const LogField& field : fields)
            line.append(" ").append(field.name).append("=").append(log_value_text(field.value));
        return line += '\n';
    }

    const LogFormat format_;
    std::mutex formatting_;
    std::unique_ptr<spdlog::formatter> text_;
    LineWriter writer_;  // the first to go: it uses the others
};

}  // namespace

void start_log(LogFormat format, spdlog::level::level_enum level, int descriptor) {
    const auto logger =
        std::make_shared<spdlog::logger>("relitd", std::make_shared<LogSink>(format, descriptor));
    logger->set_level(level);
    spdlog::set_default_logger(logger);
}

void log_event(spdlog::level::level_enum level, std::string_view message,
               std::span<const LogField> fields) {
    fields_of_line = fields;
    // Throws nothing: it tells of its own failures.
    spdlog::default_logger_raw()->log(level, spdlog::string_view_t(message.data(), message.size()));
    fields_of_line = {};
}

}  // namespace relit::server
