#include "server/storage/files.h"

#include <fcntl.h>
#include <spdlog/spdlog.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cassert>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "server/error_codes.h"

namespace relit::server {
namespace {

// For utimensat() and its like: leaves the time of the last access alone.
struct FileTimes {
    explicit FileTimes(FileTime time) {
        const auto seconds = std::chrono::floor<std::chrono::seconds>(time.time_since_epoch());
        times[0].tv_nsec = UTIME_OMIT;
        times[1].tv_sec = seconds.count();
        times[1].tv_nsec = (time.time_since_epoch() - seconds).count();
    }
    timespec times[2] = {};
};

}  // namespace

File::~File() {
    if (is_open()) ::close(descriptor_);
}

void fail_storage(std::string_view doing) {
    const int error = errno;
    spdlog::error("storage: {}: {}", doing, std::strerror(error));
    if (error == ENOSPC || error == EDQUOT || error == EFBIG)
        throw Error(error_code::storage_full, "There is no room left on the server's disk.");
    throw Error(error_code::storage_failed, "The server cannot read or write its files now.");
}

TemporaryFile::TemporaryFile(const std::filesystem::path& folder)
    : name_((folder / "XXXXXX").string()), file_(::mkostemp(name_.data(), O_CLOEXEC)) {
    if (!file_.is_open()) fail_storage("make a temporary file");
}

TemporaryFile::~TemporaryFile() {
    if (!name_.empty()) ::unlink(name_.c_str());
}

void TemporaryFile::append(std::string_view bytes) {
    while (!bytes.empty()) {
        const auto written = ::write(file_.descriptor(), bytes.data(), bytes.size());
        if (written < 0 && errno == EINTR) continue;
        if (written < 0) fail_storage("write");
        bytes.remove_prefix(std::size_t(written));
    }
}

void TemporaryFile::sync(FileTime time) {
    if (::futimens(file_.descriptor(), FileTimes(time).times) != 0) fail_storage("date a file");
    if (::fsync(file_.descriptor()) != 0) fail_storage("sync a file");
    is_synced_ = true;
}

void TemporaryFile::rename_to(const std::filesystem::path& path) {
    assert(is_synced_);
    if (std::rename(name_.c_str(), path.c_str()) != 0) fail_storage("rename");
    name_.clear();
}

void make_folder(const std::filesystem::path& folder) {
    std::error_code error;
    std::filesystem::create_directory(folder, error);
    if (!error) return;
    errno = error.value();
    fail_storage("make a folder");
}

void sync_folder(const std::filesystem::path& folder) {
    const File file(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (!file.is_open() || ::fsync(file.descriptor()) != 0) fail_storage("sync a folder");
}

std::optional<SharedBytes> map_file(const std::filesystem::path& path) {
    const File file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
    if (!file.is_open()) {
        if (errno == ENOENT || errno == ENOTDIR) return std::nullopt;
        fail_storage("open");
    }
    struct stat status {};
    if (::fstat(file.descriptor(), &status) != 0) fail_storage("look at a file");
    const auto size = std::size_t(status.st_size);
    if (size == 0) return SharedBytes{};
    void* const data = ::mmap(nullptr, size, PROT_READ, MAP_PRIVATE, file.descriptor(), 0);
    if (data == MAP_FAILED) fail_storage("map a file");
    return SharedBytes{
        std::shared_ptr<const void>(
            data, [size](const void* mapped) { ::munmap(const_cast<void*>(mapped), size); }),
        {static_cast<const char*>(data), size}};
}

std::optional<FileFacts> file_facts(const std::filesystem::path& path) {
    struct stat status {};
    if (::lstat(path.c_str(), &status) != 0) {
        if (errno == ENOENT || errno == ENOTDIR) return std::nullopt;
        fail_storage("look at a file");
    }
    if (!S_ISREG(status.st_mode)) return std::nullopt;
    return FileFacts{.size_bytes = std::uint64_t(status.st_size),
                     .time = FileTime(std::chrono::seconds(status.st_mtim.tv_sec) +
                                      std::chrono::nanoseconds(status.st_mtim.tv_nsec))};
}

void set_file_time(const std::filesystem::path& path, FileTime time) noexcept {
    ::utimensat(AT_FDCWD, path.c_str(), FileTimes(time).times, AT_SYMLINK_NOFOLLOW);
}

}  // namespace relit::server
