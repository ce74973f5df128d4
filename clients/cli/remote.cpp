#include "clients/cli/remote.h"

#include <spdlog/fmt/fmt.h>

#include <charconv>
#include <thread>

#include "clients/cli/failure.h"
#include "clients/cli/http_client.h"
#include "server/schema/client_json.h"

namespace relit::cli {
namespace {

constexpr int most_retries = 8;
constexpr int longest_wait_s = 30;

// 507 too: the images that fill the storage may be in use, and go when their renders are done. No
// field of the answer tells that from a full disk.
bool is_busy(const HttpReply& reply) {
    return reply.status == 503 || reply.status == 429 || reply.status == 507;
}

// What is asked for here is there on every Relit server, but for images, which errors point to.
bool is_elsewhere(const HttpReply& reply, const std::string& pointer) {
    return (reply.status == 404 || reply.status == 405) && pointer.empty();
}

int wait_of(const HttpReply& reply) {
    int seconds = 1;
    const std::string& text = reply.retry_after;
    std::from_chars(text.data(), text.data() + text.size(), seconds);
    return std::max(seconds, 1);
}

// The connection to the server for one command.
class Talk {
public:
    Talk(const std::string& url, const SceneJob& job, Progress& progress)
        : url_(url), client_(url), job_(job), progress_(progress) {}

    // What a refusal says, with the image that it blames; `name` where it is known already.
    [[nodiscard]] std::string words_of(const HttpReply& reply, std::string name = "") const {
        const auto problem = server::read_problem(reply.body);
        if (is_elsewhere(reply, problem ? problem->pointer : ""))
            return fmt::format("{} is no Relit server: it answers {}", url_, reply.status);
        if (!problem)
            return fmt::format("{} answers {}, as no Relit server does", url_, reply.status);
        if (name.empty()) name = image_name(job_, problem->pointer);
        const std::string words = part_of_line(problem->detail);
        return name.empty() ? words : name + ": " + words;
    }

    // @return how many images the server lacked
    int upload_missing() {
        int uploaded = 0;
        for (const auto& [id, image] : job_.images) {
            const std::string path = "/v1/images/" + id;
            const HttpReply known = patiently([&] { return client_.head(path); });
            if (known.status == 200) continue;
            if (known.status != 404) throw Failure(Exit::refused, words_of(known));
            upload(image);
            ++uploaded;
        }
        return uploaded;
    }

    HttpReply post_scene(const std::string& path) {
        return patiently([&] {
            progress_.begin("waiting for the server");
            return client_.post(path, job_.text, "application/json");
        });
    }

private:
    void upload(const Input& image) {
        const HttpReply reply = patiently([&] {
            progress_.begin("sending " + image.name);
            return client_.post("/v1/images", image.bytes, "application/octet-stream",
                                [&](double share) { progress_.reach(share); });
        });
        if (reply.status != 200 && reply.status != 201)
            throw Failure(Exit::refused, words_of(reply, image.name));
    }

    // Asks again as long as the server is busy and says that waiting helps.
    template <class Request>
    HttpReply patiently(const Request& request) {
        for (int retry = 1;; ++retry) {
            HttpReply reply = request();
            const int wait_s = wait_of(reply);
            if (!is_busy(reply) || retry > most_retries || wait_s > longest_wait_s) return reply;
            progress_.say(fmt::format("relit: {}; trying again in {} s ({} of {})", words_of(reply),
                                      wait_s, retry, most_retries));
            std::this_thread::sleep_for(std::chrono::seconds(wait_s));
        }
    }

    const std::string& url_;
    HttpClient client_;
    const SceneJob& job_;
    Progress& progress_;
};

}  // namespace

RemoteAnswer ask_server(const std::string& url, const std::string& path, const std::string& media,
                        const SceneJob& job, Progress& progress) {
    Talk talk(url, job, progress);
    talk.upload_missing();
    HttpReply reply = talk.post_scene(path);
    // An image may have made room for others between its upload and the render.
    if (reply.status == 404 && talk.upload_missing() > 0) reply = talk.post_scene(path);
    if (reply.status != 200) throw Failure(Exit::refused, talk.words_of(reply));
    if (!reply.content_type.starts_with(media))
        throw Failure(Exit::refused, fmt::format("{} answers '{}', as no Relit server does", url,
                                                 reply.content_type));
    return {std::move(reply.body), std::move(reply.etag)};
}

}  // namespace relit::cli
