// GET /v1/batches/{id}/events
#include <spdlog/fmt/fmt.h>

#include <chrono>
#include <iterator>
#include <thread>

#include "server/error_codes.h"
#include "server/routes/batches.h"
#include "server/routes/query.h"
#include "server/schema/batch_json.h"
#include "server/text.h"

namespace relit::server {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr std::size_t events_at_once = 500;
constexpr auto look_up_every = 250ms;   // whether the server stops
constexpr auto gather_for = 50ms;       // frames of a quick batch, into one piece
constexpr auto keep_alive_every = 15s;  // so that those between see that the connection is in use
constexpr std::string_view first_words = "retry: 1000\n\n";
constexpr std::string_view still_here = ":\n\n";

// What is beyond the newest event cannot have been seen: waiting for what comes behind it would leave out
// events without a word.
std::int64_t last_event_of(const Request& request, const BatchFacts& batch) {
    const auto text = request.header("Last-Event-ID");
    if (!text) return 0;
    const auto id = parse_number<std::int64_t>(*text);
    if (!id || *id < 0 || *id > batch.last_event)
        throw Error(error_code::malformed_request,
                    "the header Last-Event-ID must be the id of an event of this batch");
    return *id;
}

// Sends what happens to a batch until it ends, in one direction or another.
class EventStream {
public:
    EventStream(Services& services, BatchFacts batch, std::int64_t after, std::stop_token gone)
        : services_(services), batch_(std::move(batch)), after_(after), gone_(std::move(gone)) {}

    bool send(const BodyStream::Write& write) {
        BatchNews::Watch watch(services_.batches.news(), batch_.id);
        if (!write(first_words)) return false;
        auto written = Clock::now();
        while (!gone_.stop_requested() && !services_.draining) {
            if (watch.wait(look_up_every, gone_)) {
                const std::string text = news();
                if (!text.empty()) {
                    if (!write(text)) return false;
                    written = Clock::now();
                }
                if (ended_) return true;
                std::this_thread::sleep_for(gather_for);
            } else if (Clock::now() - written > keep_alive_every) {
                if (!write(still_here)) return false;
                written = Clock::now();
            }
        }
        return true;  // a whole stream as far as it goes: the client comes back
    }

private:
    std::string news() {
        std::string text;
        JobStore& store = services_.batches.store();
        for (;;) {
            const auto events = store.events(batch_.id, after_, events_at_once);
            for (const BatchEvent& event : events) add(text, event);
            if (events.size() < events_at_once) break;
        }
        if (!ended_ && !store.find(batch_.id)) {
            text += fmt::format("event: end\ndata: {}\n\n", end_event_json(batch_, true));
            ended_ = true;
        }
        return text;
    }

    void add(std::string& text, const BatchEvent& event) {
        after_ = event.id;
        const auto name = event.frame ? "frame" : "end";
        const auto data = event.frame ? frame_event_json(*event.frame)
                                      : end_event_json(services_.batches.find(batch_.id), false);
        fmt::format_to(std::back_inserter(text), "id: {}\nevent: {}\ndata: {}\n\n", event.id, name,
                       data);
        ended_ = !event.frame;
    }

    Services& services_;
    const BatchFacts batch_;
    std::int64_t after_;
    const std::stop_token gone_;
    bool ended_ = false;
};

}  // namespace

Reply get_batch_events(const Request& request, Services& services) {
    allow_parameters(request, {});
    BatchFacts batch = services.batches.find(request.path_params.at("id"));
    const std::int64_t after = last_event_of(request, batch);
    // 204 tells a browser to come back no more.
    if (batch.finished && services.batches.store().events(batch.id, after, 1).empty())
        return {.status = 204, .headers = {{"Cache-Control", "no-store"}}};
    const auto slot = services.batches.streams().take();
    const auto stream =
        std::make_shared<EventStream>(services, std::move(batch), after, request.client_gone);
    Reply reply{.content_type = "text/event-stream"};
    reply.stream = {.size_bytes = {},
                    .send = [slot, stream](const auto& write) { return stream->send(write); }};
    reply.headers = {{"Cache-Control", "no-store"}, {"X-Accel-Buffering", "no"}};
    return reply;
}

}  // namespace relit::server
