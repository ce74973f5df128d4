// System calls on files with our errors: for the operator where a folder cannot be used, for the
// client (without a path) where a file cannot be stored.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "server/shared_bytes.h"

namespace relit::server {

/// When a file was last written, as far as its file system counts.
using FileTime = std::chrono::sys_time<std::chrono::nanoseconds>;

/// A descriptor that closes itself.
class File {
public:
    explicit File(int descriptor) : descriptor_(descriptor) {}
    ~File();
    File(const File&) = delete;
    File& operator=(const File&) = delete;
    [[nodiscard]] int descriptor() const { return descriptor_; }
    [[nodiscard]] bool is_open() const { return descriptor_ >= 0; }

private:
    int descriptor_;
};

/// A file under a temporary name; deleted unless it is renamed.
class TemporaryFile {
public:
    /// A new one in `folder`. @throws Error storage_full, storage_failed
    explicit TemporaryFile(const std::filesystem::path& folder);
    ~TemporaryFile();
    TemporaryFile(const TemporaryFile&) = delete;
    TemporaryFile& operator=(const TemporaryFile&) = delete;

    /// Writes all of `bytes` at its end. @throws Error storage_full, storage_failed
    void append(std::string_view bytes);

    /// Dates it and makes it durable. @throws Error storage_full, storage_failed
    void sync(FileTime time);

    /// Gives it its name, over what is there, within the file system.
    /// @pre it has been synced
    /// @throws Error storage_full, storage_failed
    void rename_to(const std::filesystem::path& path);

private:
    std::string name_;  // empty once renamed
    File file_;
    bool is_synced_ = false;
};

/// Makes a folder where there is none; what it is in has to be there.
/// @throws Error storage_full, storage_failed
void make_folder(const std::filesystem::path& folder);

/// Makes the names in a folder durable. @throws Error storage_full, storage_failed
void sync_folder(const std::filesystem::path& folder);

/// The whole file, mapped; empty where there is none. @throws Error storage_failed
[[nodiscard]] std::optional<SharedBytes> map_file(const std::filesystem::path& path);

/// What a folder tells of a file.
struct FileFacts {
    std::uint64_t size_bytes = 0;
    FileTime time;
};

/// Nothing where there is no regular file (a link is none). @throws Error storage_failed
[[nodiscard]] std::optional<FileFacts> file_facts(const std::filesystem::path& path);

/// Dates a file, if it can; not synced.
void set_file_time(const std::filesystem::path& path, FileTime time) noexcept;

/// @throws Error storage_full or storage_failed, from `errno`
[[noreturn]] void fail_storage(std::string_view doing);

}  // namespace relit::server
