#include "server/schema/batch_json.h"

#include <nlohmann/json.hpp>

#include "server/schema/time_text.h"

namespace relit::server {
namespace {

using Json = nlohmann::ordered_json;

Json time_of(std::optional<StoreTime> time) {
    if (!time) return nullptr;
    return time_text(
        std::chrono::sys_time<std::chrono::nanoseconds>(std::chrono::milliseconds(*time)));
}

const char* status_of(const BatchFacts& batch) {
    return batch.finished ? "done" : batch.started ? "running" : "queued";
}

Json json_of(const BatchFacts& batch) {
    return {{"id", batch.id},
            {"status", status_of(batch)},
            {"priority", batch.priority},
            {"total", batch.total},
            {"done", batch.done},
            {"failed", batch.failed},
            {"created", time_of(batch.created)},
            {"started", time_of(batch.started)},
            {"finished", time_of(batch.finished)},
            {"bytes", batch.result_bytes}};
}

// Problem documents are JSON of our own making.
Json problems_of(const std::vector<FrameFacts>& failed) {
    Json list = Json::array();
    for (const FrameFacts& frame : failed)
        list.push_back({{"frame", frame.number},
                        {"name", frame.name},
                        {"problem", Json::parse(frame.problem)}});
    return list;
}

}  // namespace

std::string submitted_json(const JobStore::Submitted& batch) {
    return Json{
        {"id", batch.id}, {"status", "queued"}, {"total", batch.total}, {"done", 0}, {"failed", 0}}
        .dump();
}

std::string batch_json(const BatchFacts& batch, const std::vector<FrameFacts>& failed) {
    Json json = json_of(batch);
    json["problems"] = problems_of(failed);
    return json.dump();
}

std::string batch_list_json(const std::vector<BatchFacts>& batches,
                            const std::optional<std::string>& next) {
    Json list = Json::array();
    for (const BatchFacts& batch : batches) list.push_back(json_of(batch));
    return Json{{"batches", std::move(list)}, {"next", next ? Json(*next) : Json(nullptr)}}.dump();
}

std::string frame_event_json(const FrameFacts& frame) {
    const bool done = frame.state == FrameState::done;
    Json json = {
        {"frame", frame.number}, {"name", frame.name}, {"status", done ? "done" : "failed"}};
    if (done) json["bytes"] = frame.result.size_bytes;
    else json["problem"] = Json::parse(frame.problem);
    return json.dump();
}

std::string end_event_json(const BatchFacts& batch, bool deleted) {
    return Json{{"id", batch.id},
                {"status", deleted ? "deleted" : "done"},
                {"total", batch.total},
                {"done", batch.done},
                {"failed", batch.failed}}
        .dump();
}

std::string problems_json(const std::vector<FrameFacts>& failed) {
    return problems_of(failed).dump(2) + "\n";
}

}  // namespace relit::server
