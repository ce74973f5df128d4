// A server as commands ask it: patiently while it is busy, and refusals as sentences. Images go
// there under the SHA-256 of their bytes, and only those that the server lacks.
#pragma once

#include <functional>
#include <map>
#include <string>

#include "clients/cli/http_client.h"
#include "clients/cli/input.h"
#include "clients/cli/progress.h"
#include "clients/cli/scene_job.h"

namespace relit::cli {

class RemoteServer {
public:
    /// @throws Failure usage for no address
    RemoteServer(const std::string& url, Progress& progress)
        : url_(url), client_(url), progress_(progress) {}

    /// What asks, and asks again, as late as the server says and within bounds, while it is busy or
    /// full.
    /// @throws Failure unreachable
    HttpReply patiently(const std::function<HttpReply(HttpClient&)>& request);

    /// @throws Failure unreachable, refused
    [[nodiscard]] bool has_image(const std::string& id);
    /// @param sent  told the share that is sent
    void upload(const Input& image, const std::function<void(double)>& sent = {});

    /// What a refusal says.
    /// @param image_at  the name of the image that a pointer blames; empty when it blames none
    [[nodiscard]] std::string words_of(
        const HttpReply& reply,
        const std::function<std::string(const std::string& pointer)>& image_at = {}) const;

    HttpClient& client() { return client_; }

private:
    const std::string url_;
    HttpClient client_;
    Progress& progress_;
};

struct RemoteAnswer {
    std::string body;
    std::string etag;
};

/// Posts the scene to `path` of the server, for an answer of a media type that begins with `media`.
/// Images that the server forgot meanwhile are sent once more.
/// @throws Failure unreachable, refused with the server's own sentence, or naming the URL when it is
///         no Relit server's; usage for no address
[[nodiscard]] RemoteAnswer ask_server(const std::string& url, const std::string& path,
                                      const std::string& media, const SceneJob& job,
                                      Progress& progress);

}  // namespace relit::cli
