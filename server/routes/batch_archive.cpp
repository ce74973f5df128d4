// GET /v1/batches/{id}/archive
#include <spdlog/fmt/fmt.h>

#include <chrono>

#include "core/io/deflate.h"
#include "server/archive/tar.h"
#include "server/archive/zip.h"
#include "server/error_codes.h"
#include "server/routes/batches.h"
#include "server/routes/query.h"
#include "server/schema/batch_json.h"
#include "server/schema/batch_request.h"

namespace relit::server {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t frames_at_once = 500;
constexpr std::size_t piece_bytes = 1 << 20;
constexpr auto look_up_every = 250ms;  // whether the server stops

enum class ArchiveFormat { tar, zip };

ArchiveFormat format_of(const Request& request) {
    const std::string text = request.query_value("format").value_or("tar");
    if (text == "tar") return ArchiveFormat::tar;
    if (text == "zip") return ArchiveFormat::zip;
    throw Error(error_code::invalid_value, "the parameter 'format' must be 'tar' or 'zip'");
}

// What stands round the files.
class Frame {
public:
    Frame(ArchiveFormat format, std::int64_t time_s) : format_(format), time_s_(time_s) {}

    [[nodiscard]] std::string head(const std::string& name, std::uint64_t size, std::uint32_t crc) {
        return format_ == ArchiveFormat::tar ? tar_head(name, size, time_s_)
                                             : zip_.head(name, size, crc, time_s_);
    }
    [[nodiscard]] std::string padding(std::uint64_t size) const {
        return format_ == ArchiveFormat::tar ? tar_padding(size) : "";
    }
    [[nodiscard]] std::string end() const {
        return format_ == ArchiveFormat::tar ? tar_end() : zip_.end();
    }

private:
    ArchiveFormat format_;
    std::int64_t time_s_;
    ZipWriter zip_;
};

std::uint32_t crc_of(std::string_view bytes) {
    return crc32({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
}

class ArchiveStream {
public:
    ArchiveStream(Services& services, BatchFacts batch, ArchiveFormat format, std::stop_token gone)
        : services_(services), batch_(std::move(batch)), format_(format), gone_(std::move(gone)) {}

    /// Of a finished batch. The files' own bytes have no part in it but their number.
    [[nodiscard]] std::uint64_t size() {
        Frame frame = new_frame();
        std::uint64_t total = 0;
        const auto add = [&](const std::string& name, std::uint64_t size) {
            total += frame.head(name, size, 0).size() + size + frame.padding(size).size();
        };
        for (int next = 0; next < batch_.total;) {
            const auto frames = store().frames(batch_.id, next, frames_at_once);
            if (frames.empty()) break;
            for (const FrameFacts& facts : frames)
                if (facts.state == FrameState::done) add(facts.name, facts.result.size_bytes);
            next = frames.back().number + 1;
        }
        if (batch_.failed > 0) add(std::string(problems_file_name), problems().size());
        return total + frame.end().size();
    }

    bool send(const BodyStream::Write& write) {
        Frame frame = new_frame();
        BatchNews::Watch watch(services_.batches.news(), batch_.id);
        for (int number = 0; number < batch_.total; ++number) {
            const auto facts = finished_frame(number, watch);
            if (!facts) return false;
            if (facts->state == FrameState::failed) continue;
            const auto picture = picture_of(*facts);
            if (!picture || !send_file(frame, facts->name, picture->bytes, write)) return false;
        }
        const std::string list = problems();
        const bool listed = store().find(batch_.id).value_or(BatchFacts{}).failed == 0 ||
                            send_file(frame, std::string(problems_file_name), list, write);
        return listed && write(frame.end());
    }

private:
    JobStore& store() { return services_.batches.store(); }
    [[nodiscard]] Frame new_frame() const { return {format_, batch_.created / 1000}; }
    std::string problems() { return problems_json(store().failed_frames(batch_.id)); }

    // @return nothing where it is gone, as all pictures of a batch that is deleted meanwhile
    std::optional<SharedBytes> picture_of(const FrameFacts& facts) try {
        return services_.batches.picture(batch_.id, facts.result.file);
    } catch (const Error& error) {
        if (error.code != error_code::not_found) throw;
        return std::nullopt;
    }

    // Waits for it. @return nothing where it will not come: the batch is gone, or we are to end
    std::optional<FrameFacts> finished_frame(int number, BatchNews::Watch& watch) {
        for (;;) {
            auto facts = store().frame(batch_.id, number);
            if (!facts) return std::nullopt;
            if (facts->state == FrameState::done || facts->state == FrameState::failed)
                return facts;
            while (!watch.wait(look_up_every, gone_))
                if (gone_.stop_requested() || services_.draining) return std::nullopt;
        }
    }

    static bool send_file(Frame& frame, const std::string& name, std::string_view bytes,
                          const BodyStream::Write& write) {
        if (!write(frame.head(name, bytes.size(), crc_of(bytes)))) return false;
        for (std::size_t at = 0; at < bytes.size(); at += piece_bytes)
            if (!write(bytes.substr(at, piece_bytes))) return false;
        return write(frame.padding(bytes.size()));
    }

    Services& services_;
    const BatchFacts batch_;
    const ArchiveFormat format_;
    const std::stop_token gone_;
};

}  // namespace

Reply get_batch_archive(const Request& request, Services& services) {
    allow_parameters(request, {"format"});
    const ArchiveFormat format = format_of(request);
    BatchFacts batch = services.batches.find(request.path_params.at("id"));
    const auto slot = services.batches.streams().take();
    const bool whole = batch.finished.has_value();
    const std::string name =
        fmt::format("{}.{}", batch.id, format == ArchiveFormat::tar ? "tar" : "zip");
    const auto stream =
        std::make_shared<ArchiveStream>(services, std::move(batch), format, request.client_gone);
    Reply reply{.content_type =
                    format == ArchiveFormat::tar ? "application/x-tar" : "application/zip"};
    reply.stream = {.size_bytes = {},
                    .send = [slot, stream](const auto& write) { return stream->send(write); }};
    if (whole) reply.stream->size_bytes = stream->size();
    reply.headers = {{"Cache-Control", "no-store"},
                     {"Content-Disposition", "attachment; filename=\"" + name + "\""}};
    return reply;
}

}  // namespace relit::server
