#include "tests/support/batch_client.h"

#include <chrono>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <thread>

#include "tests/support/http_client.h"

namespace relit::test {
namespace {

using namespace std::chrono_literals;
using Json = nlohmann::json;

// One event's text -> what it says. @return whether it was the end
bool take_event(const std::string& text, std::int64_t& last_id, SeenEvents& seen) {
    if (!text.starts_with("id: ")) return false;  // retry, or a comment
    const std::int64_t id = std::stoll(text.substr(4));
    if (id != last_id + 1)
        seen.faults += std::to_string(id) + " after " + std::to_string(last_id) + "\n";
    last_id = id;
    const Json data = Json::parse(text.substr(text.find("data: ") + 6));
    if (text.find("event: end") != std::string::npos) return true;
    if (!seen.frames.emplace(data["frame"], data["status"]).second)
        seen.faults += "frame " + data["frame"].dump() + " twice\n";
    return false;
}

}  // namespace

std::string submit_until_accepted(const CurrentPort& port, const std::string& body,
                                  const std::string& key) {
    for (;;) {
        try {
            const HttpReply reply =
                http(port(), "POST", "/v1/batches", body, {{"Idempotency-Key", key}});
            if (reply.status == 202) return Json::parse(reply.body)["id"];
            if (reply.status != 409 && reply.status != 503) throw std::invalid_argument(reply.body);
        } catch (const std::runtime_error&) {  // the server is gone, or went while it answered
        }
        std::this_thread::sleep_for(20ms);
    }
}

SeenEvents follow_events(const CurrentPort& port, const std::string& batch) {
    SeenEvents seen;
    std::int64_t last_id = 0;
    for (int opened = 0;;) {
        try {
            RawConnection connection(port());
            connection.send(http_request("GET", "/v1/batches/" + batch + "/events", "",
                                         {{"Last-Event-ID", std::to_string(last_id)}}));
            if (const int status = connection.receive_head().status; status != 200) {
                if (status != 503) seen.faults += "status " + std::to_string(status) + "\n";
                if (status != 503) return seen;
            } else {
                seen.reconnected = opened++;
            }
            std::string text;
            while (const auto chunk = connection.next_chunk()) {
                text += *chunk;
                for (auto end = text.find("\n\n"); end != std::string::npos;
                     end = text.find("\n\n")) {
                    if (take_event(text.substr(0, end), last_id, seen)) return seen;
                    text.erase(0, end + 2);
                }
            }
        } catch (const std::runtime_error&) {  // cut: what was seen whole counts
        }
        std::this_thread::sleep_for(20ms);
    }
}

}  // namespace relit::test
