// A scene to a server and its answer back: images go there under the SHA-256 of their bytes, and
// only those that the server lacks.
#pragma once

#include <string>

#include "clients/cli/progress.h"
#include "clients/cli/scene_job.h"

namespace relit::cli {

struct RemoteAnswer {
    std::string body;
    std::string etag;
};

/// Posts the scene to `path` of the server, for an answer of a media type that begins with `media`.
/// A busy or full server is asked again, as late as it says, within bounds; images that it forgot
/// meanwhile are sent once more.
/// @throws Failure unreachable, refused with the server's own sentence, or naming the URL when it is
///         no Relit server's; usage for no address
[[nodiscard]] RemoteAnswer ask_server(const std::string& url, const std::string& path,
                                      const std::string& media, const SceneJob& job,
                                      Progress& progress);

}  // namespace relit::cli
