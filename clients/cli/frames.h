// Command line -> frames: a sweep, or a manifest of scenes, as the pictures that it means, by the same
// code that reads batches on a server.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "clients/cli/input.h"
#include "clients/cli/options.h"
#include "clients/cli/scene_job.h"
#include "core/base/shared_cache.h"

namespace relit::cli {

/// One picture of many.
struct Frame {
    std::string name;                 ///< of its file
    std::string scene;                ///< in its one form, images by their ids
    std::string etag;                 ///< of the picture
    std::vector<std::string> images;  ///< ids
};

/// The images of frames. Files are read again when they are wanted, for there may be more of them
/// than memory; the last half a gigabyte is kept. Safe from any thread.
class FrameImages {
public:
    explicit FrameImages(std::map<std::string, Input> images);

    /// What is known of them; files are without their bytes.
    [[nodiscard]] const std::map<std::string, Input>& known() const { return images_; }

    /// With its bytes. @pre it is one of those known
    /// @throws Failure as read_file(); refused when the file has changed
    [[nodiscard]] Input get(const std::string& id);

private:
    std::map<std::string, Input> images_;
    SharedCache kept_;
};

struct FrameJob {
    std::vector<Frame> frames;
    std::map<std::string, Input> images;       ///< by id; files without their bytes
    std::vector<std::filesystem::path> files;  ///< all that were read
};

/// @throws as read_scene_job(); Failure usage when it is not one path; Error of parse_batch()
[[nodiscard]] FrameJob read_sweep(const Options& options);

/// @throws as read_scene_job(), naming the manifest's line; Error of parse_batch()
[[nodiscard]] FrameJob read_manifest(const Options& options);

/// The frames of a batch as it is posted. @throws Error of parse_batch()
[[nodiscard]] std::vector<Frame> frames_of(const std::string& request);

/// Every n-th frame, beginning with the i-th.
/// @param shard  "i/n", 0 <= i < n; empty: all of them
/// @throws Failure usage
[[nodiscard]] std::vector<Frame> frames_of_shard(std::vector<Frame> frames,
                                                 const std::string& shard);

}  // namespace relit::cli
