#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <random>
#include <thread>

#include "clients/cli/failure.h"
#include "clients/cli/frame_work.h"
#include "clients/cli/remote.h"
#include "core/base/error.h"
#include "server/error_codes.h"
#include "server/schema/client_json.h"
#include "server/schema/scene_json.h"

namespace relit::cli {
namespace {

using namespace std::chrono_literals;

constexpr int most_frames_at_once = 1000;  // of one batch
constexpr int most_retries = 5;            // of a server that is gone: half a minute in all
constexpr std::chrono::milliseconds first_pause = 20ms, longest_pause = 1s;

// A batch as it is sent, and noted in the folder for the next program.
struct SentBatch {
    std::string url;
    std::string key;
    std::string body;
};

std::string new_key() {
    std::random_device random;
    return fmt::format("{:08x}{:08x}{:08x}{:08x}", random(), random(), random(), random());
}

std::string note_of(const SentBatch& batch) {
    return batch.url + "\n" + batch.key + "\n" + batch.body;
}

// @return nothing of a batch for another server, or where there is no note
std::optional<SentBatch> noted_batch(const std::string& note, const std::string& url) {
    const auto first = note.find('\n');
    const auto second = first == std::string::npos ? first : note.find('\n', first + 1);
    if (second == std::string::npos || note.substr(0, first) != url) return std::nullopt;
    return SentBatch{url, note.substr(first + 1, second - first - 1), note.substr(second + 1)};
}

// "/scenes/12/output/region" -> 12
std::optional<std::size_t> scene_in(const std::string& pointer) {
    constexpr std::string_view list = "/scenes/";
    if (!pointer.starts_with(list)) return std::nullopt;
    return std::size_t(std::atoi(pointer.c_str() + list.size()));
}

// Batches on one server, one after the other.
class Submitter {
public:
    Submitter(const std::string& url, std::vector<Frame> missing, FrameImages& images,
              FrameFolder& folder, Progress& progress)
        : url_(url), images_(images), folder_(folder), progress_(progress), server_(url, progress) {
        for (Frame& frame : missing) missing_.emplace(frame.name, std::move(frame));
    }

    void make_all() {
        if (const auto noted = noted_batch(folder_.note(), url_)) take_up(*noted);
        folder_.write_note("");
        if (missing_.empty()) return;
        const std::size_t at_once = frames_at_once();
        while (!missing_.empty()) make_next(at_once);
    }

private:
    // What the program before this one had sent. Whatever is wrong with it, there is still the rest.
    void take_up(const SentBatch& batch) try {
        const std::vector<Frame> sent = frames_of(batch.body);
        upload_for(sent);
        const HttpReply reply = posted(batch);
        if (const auto id = accepted(reply)) {
            fetch_all(*id, sent);
            remove(*id);
        }
    } catch (const Error&) {
    }

    // Servers may take smaller batches than ours.
    std::size_t frames_at_once() {
        const HttpReply reply =
            server_.patiently([](HttpClient& client) { return client.get("/v1/capabilities"); });
        const auto limit = server::read_max_batch_frames(reply.body);
        return std::size_t(std::min(limit.value_or(most_frames_at_once), most_frames_at_once));
    }

    void make_next(std::size_t at_once) {
        std::vector<Frame> part;
        for (const auto& [name, frame] : missing_)
            if (part.size() < at_once) part.push_back(frame);
        upload_for(part);
        std::erase_if(part, [&](const Frame& frame) { return !is_missing(frame); });
        while (!part.empty()) {
            const std::string id = submit(part);
            if (id.empty()) continue;
            if (!fetch_all(id, part))
                throw Failure(Exit::refused, "the batch is gone from the server");
            remove(id);
            break;
        }
        folder_.write_note("");
    }

    // @return its id; empty: a frame was refused, and is no part any more
    std::string submit(std::vector<Frame>& part) {
        std::vector<server::BatchFrame> scenes;
        for (const Frame& frame : part) scenes.push_back({frame.name, frame.scene});
        const SentBatch batch{url_, new_key(), server::scenes_request(scenes)};
        folder_.write_note(note_of(batch));
        HttpReply reply = posted(batch);
        // An image may have made room for others between its upload and the batch.
        if (reply.status == 404 && upload_for(part) > 0) reply = posted(batch);
        if (auto id = accepted(reply)) return *id;
        drop_refused(reply, part);
        return "";
    }

    HttpReply posted(const SentBatch& batch) {
        for (;;) {
            HttpReply reply = server_.patiently([&](HttpClient& client) {
                return client.post("/v1/batches", batch.body, "application/json", {}, batch.key);
            });
            if (reply.status != 409) return reply;
            std::this_thread::sleep_for(1s);  // the server is at it: we were there before
        }
    }

    [[nodiscard]] static std::optional<std::string> accepted(const HttpReply& reply) {
        return reply.status == 202 ? server::read_batch_id(reply.body) : std::nullopt;
    }

    // One bad frame must not keep the others from being made.
    void drop_refused(const HttpReply& reply, std::vector<Frame>& part) {
        const auto problem = server::read_problem(reply.body);
        const auto number = problem ? scene_in(problem->pointer) : std::nullopt;
        if (!number || *number >= part.size())
            throw Failure(Exit::refused, server_.words_of(reply));
        const Frame frame = part[*number];
        std::string words = part_of_line(problem->detail);
        const std::string prefix = fmt::format("frame {}: ", *number);
        if (words.starts_with(prefix)) words = part_of_line(words.substr(prefix.size()));
        fail(frame, words);
        part.erase(part.begin() + std::ptrdiff_t(*number));
    }

    // --- Images ---

    // Sends what the server lacks; frames whose images it refuses fail.
    // @return how many it lacked
    int upload_for(const std::vector<Frame>& frames) {
        std::map<std::string, std::vector<Frame>> users;
        for (const Frame& frame : frames)
            for (const std::string& id : frame.images)
                if (images_.known().contains(id)) users[id].push_back(frame);
        int uploaded = 0;
        for (const auto& [id, by] : users) {
            if (server_.has_image(id)) continue;
            ++uploaded;
            try {
                server_.upload(images_.get(id));
            } catch (const Failure& e) {
                if (e.status != Exit::refused) throw;
                for (const Frame& frame : by)
                    if (is_missing(frame)) fail(frame, e.what());
            }
        }
        return uploaded;
    }

    // --- Frames ---

    // @return false: the batch is gone
    bool fetch_all(const std::string& id, const std::vector<Frame>& sent) {
        for (std::size_t number = 0; number < sent.size(); ++number)
            if (is_missing(sent[number]) && !fetch(id, int(number), sent[number])) return false;
        return true;
    }

    bool fetch(const std::string& id, int number, const Frame& frame) {
        const std::string path = fmt::format("/v1/batches/{}/frames/{}", id, number);
        for (auto pause = first_pause;; pause = std::min(pause * 3 / 2, longest_pause)) {
            const HttpReply reply = steadily([&] { return server_.client().get(path); });
            if (reply.status == 200 && reply.content_type.starts_with("image/")) {
                folder_.keep(frame, reply.body);
                settle(frame);
                return true;
            }
            const auto problem = server::read_problem(reply.body);
            const bool unfinished =
                reply.status == 409 && problem && problem->code == error_code::conflict;
            if (!unfinished) {
                const HttpReply batch = batch_reply(id);
                if (batch.status == 404) return false;
                if (const auto words = failure_of(batch, number)) {
                    fail(frame, *words);
                    return true;
                }
                if (reply.status != 503) throw Failure(Exit::refused, server_.words_of(reply));
            }
            std::this_thread::sleep_for(pause);
        }
    }

    HttpReply batch_reply(const std::string& id) {
        return steadily([&] {
            return server_.patiently(
                [&](HttpClient& client) { return client.get("/v1/batches/" + id); });
        });
    }

    // Why the frame failed. A failed frame answers as its problem would have been answered, which may
    // be any status.
    [[nodiscard]] static std::optional<std::string> failure_of(const HttpReply& batch, int number) {
        const auto failed = server::read_failed_frames(batch.body);
        if (!failed) return std::nullopt;
        for (const server::FailedFrame& frame : *failed)
            if (frame.number == number) return part_of_line(frame.problem.detail);
        return std::nullopt;
    }

    void remove(const std::string& id) {
        (void)steadily([&] { return server_.client().remove("/v1/batches/" + id); });
    }

    // A server may be restarted while a batch is on it.
    HttpReply steadily(const std::function<HttpReply()>& request) {
        for (int retry = 1;; ++retry) try {
                return request();
            } catch (const Failure& e) {
                if (e.status != Exit::unreachable || retry > most_retries) throw;
                const auto wait = std::chrono::seconds(1 << (retry - 1));
                progress_.say(fmt::format("relit: {}; trying again in {} s ({} of {})", e.what(),
                                          wait.count(), retry, most_retries));
                std::this_thread::sleep_for(wait);
            }
    }

    [[nodiscard]] bool is_missing(const Frame& frame) const {
        const auto found = missing_.find(frame.name);
        return found != missing_.end() && found->second.etag == frame.etag;
    }

    void settle(const Frame& frame) { missing_.erase(frame.name); }

    void fail(const Frame& frame, const std::string& words) {
        folder_.fail(frame, words);
        settle(frame);
    }

    const std::string& url_;
    std::map<std::string, Frame> missing_;  // by name
    FrameImages& images_;
    FrameFolder& folder_;
    Progress& progress_;
    RemoteServer server_;
};

}  // namespace

void render_frames_there(const std::string& url, std::vector<Frame> frames, FrameImages& images,
                         FrameFolder& folder, Progress& progress) {
    Submitter(url, std::move(frames), images, folder, progress).make_all();
}

}  // namespace relit::cli
