// Files that come out: there whole or not at all, also when the program is stopped.
#pragma once

#include <filesystem>
#include <mutex>
#include <set>
#include <span>
#include <string>
#include <string_view>

namespace relit::cli {

/// Writes files under a temporary name in the same folder and renames them when they are whole.
/// Whoever ends the program in between calls remove_unfinished() first. Safe from any thread.
class OutputFiles {
public:
    /// @param target  a path, or "-" for stdout. What the caller holds open (/dev/stdout,
    ///                /dev/fd/3) is written through its descriptor, where it stands; what is no
    ///                regular file (/dev/null, a pipe) is written to directly
    /// @throws Failure unreachable; without words when a descriptor is a pipe that nobody reads
    void write(const std::string& target, std::string_view bytes);

    /// Removes what is not finished; nothing is created or renamed any more.
    void remove_unfinished();

private:
    void write_whole(const std::filesystem::path& path, std::string_view bytes);
    struct Unfinished {
        int descriptor = -1;
        std::string name;
    };
    Unfinished create_unfinished(const std::filesystem::path& path);
    void finish(const std::string& unfinished, const std::filesystem::path& path);
    void remove(const std::string& unfinished);

    std::mutex mutex_;
    std::set<std::string> unfinished_;  // temporary files
};

/// Removes what a killed program left unfinished in the folder: what nobody has written to for a
/// minute.
void remove_abandoned(const std::filesystem::path& folder);

/// Refuses, before the work begins, a target that cannot be written or that is an input.
/// @param inputs  the files that are read
/// @throws Failure usage (a terminal, an input), unreachable (no such folder, a folder itself, a
///         descriptor that is not open for writing)
void check_target(const std::string& target, std::span<const std::filesystem::path> inputs);

/// Writes to stdout. @throws Failure as OutputFiles::write()
void write_to_stdout(std::string_view bytes);

}  // namespace relit::cli
