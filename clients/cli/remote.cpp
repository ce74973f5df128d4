#include "clients/cli/remote.h"

#include <spdlog/fmt/fmt.h>

#include <charconv>
#include <thread>

#include "clients/cli/failure.h"
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

// @return how many images the server lacked
int upload_missing(RemoteServer& server, const SceneJob& job, Progress& progress) {
    int uploaded = 0;
    for (const auto& [id, image] : job.images) {
        if (server.has_image(id)) continue;
        progress.begin("sending " + image.name);
        server.upload(image, [&](double share) { progress.reach(share); });
        ++uploaded;
    }
    return uploaded;
}

}  // namespace

std::string RemoteServer::words_of(
    const HttpReply& reply,
    const std::function<std::string(const std::string& pointer)>& image_at) const {
    const auto problem = server::read_problem(reply.body);
    if (is_elsewhere(reply, problem ? problem->pointer : ""))
        return fmt::format("{} is no Relit server: it answers {}", url_, reply.status);
    if (!problem && reply.status == 401)  // to HEAD, which has no problem document
        return fmt::format("{} asks for an API key, in RELIT_API_KEY", url_);
    if (!problem && reply.status == 403)
        return fmt::format("the API key in RELIT_API_KEY is not good for this at {}", url_);
    if (!problem) return fmt::format("{} answers {}, as no Relit server does", url_, reply.status);
    const std::string image = image_at ? image_at(problem->pointer) : "";
    const std::string words = part_of_line(problem->detail);
    return image.empty() ? words : image + ": " + words;
}

// Asks again as long as the server is busy and says that waiting helps.
HttpReply RemoteServer::patiently(const std::function<HttpReply(HttpClient&)>& request) {
    for (int retry = 1;; ++retry) {
        HttpReply reply = request(client_);
        const int wait_s = wait_of(reply);
        if (!is_busy(reply) || retry > most_retries || wait_s > longest_wait_s) return reply;
        progress_.say(fmt::format("relit: {}; trying again in {} s ({} of {})", words_of(reply),
                                  wait_s, retry, most_retries));
        std::this_thread::sleep_for(std::chrono::seconds(wait_s));
    }
}

bool RemoteServer::has_image(const std::string& id) {
    const HttpReply known =
        patiently([&](HttpClient& client) { return client.head("/v1/images/" + id); });
    if (known.status != 200 && known.status != 404) throw Failure(Exit::refused, words_of(known));
    return known.status == 200;
}

void RemoteServer::upload(const Input& image, const std::function<void(double)>& sent) {
    const HttpReply reply = patiently([&](HttpClient& client) {
        return client.post("/v1/images", image.bytes, "application/octet-stream", sent);
    });
    if (reply.status != 200 && reply.status != 201)
        throw Failure(Exit::refused,
                      words_of(reply, [&](const std::string&) { return image.name; }));
}

RemoteAnswer ask_server(const std::string& url, const std::string& path, const std::string& media,
                        const SceneJob& job, Progress& progress) {
    RemoteServer server(url, progress);
    const auto post_scene = [&] {
        return server.patiently([&](HttpClient& client) {
            progress.begin("waiting for the server");
            return client.post(path, job.text, "application/json");
        });
    };
    upload_missing(server, job, progress);
    HttpReply reply = post_scene();
    // An image may have made room for others between its upload and the render.
    if (reply.status == 404 && upload_missing(server, job, progress) > 0) reply = post_scene();
    const auto image_at = [&](const std::string& pointer) {
        return image_name(job.scene, job.images, pointer);
    };
    if (reply.status != 200) throw Failure(Exit::refused, server.words_of(reply, image_at));
    if (!reply.content_type.starts_with(media))
        throw Failure(Exit::refused, fmt::format("{} answers '{}', as no Relit server does", url,
                                                 reply.content_type));
    return {std::move(reply.body), std::move(reply.etag)};
}

}  // namespace relit::cli
