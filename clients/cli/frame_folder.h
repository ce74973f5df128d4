// The folder of many frames: what is there already, and what comes. A picture is recorded with its
// ETag and the SHA-256 of its bytes once it is there whole, in .relit-frames, so that the same
// command begun again makes what is missing and nothing else.
#pragma once

#include <atomic>
#include <filesystem>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "clients/cli/commands.h"
#include "clients/cli/frames.h"

namespace relit::cli {

/// Safe from any thread.
class FrameFolder {
public:
    /// @param folder  made where it is not there
    /// @param shard   what of the frames this program makes, "i/n" or empty: programs beside each
    ///                other write records of their own, and read those of all
    /// @throws Failure unreachable, usage (no folder at all)
    FrameFolder(std::string folder, const std::string& shard, Console console);
    ~FrameFolder();
    FrameFolder(const FrameFolder&) = delete;
    FrameFolder& operator=(const FrameFolder&) = delete;

    /// Those that are not there, or of another scene, or not as they were written.
    [[nodiscard]] std::vector<Frame> missing(std::span<const Frame> frames) const;

    /// @throws Failure usage when a frame would replace one of `files`, unreachable
    void check_targets(std::span<const Frame> frames,
                       std::span<const std::filesystem::path> files) const;

    /// From now on so many are to come.
    void expect(std::size_t frames);

    /// Writes a picture, then its record. @throws Failure unreachable
    void keep(const Frame& frame, std::string_view picture);

    /// Says why there is none.
    void fail(const Frame& frame, const std::string& words);

    [[nodiscard]] int failed() const { return failed_; }

    /// A note of this program for the next one, whole or not at all; an empty one is none.
    [[nodiscard]] std::string note() const;
    void write_note(const std::string& text);

private:
    void count();
    [[nodiscard]] std::string path_of(const std::string& name) const;

    const std::string folder_;
    const std::string suffix_;  // of the names of records
    Console console_;
    int records_ = -1;  // a descriptor
    std::mutex mutex_;
    std::atomic<int> done_ = 0;
    std::atomic<int> failed_ = 0;
    std::atomic<int> expected_ = 0;
};

}  // namespace relit::cli
