#include "clients/cli/output_file.h"

#include <fcntl.h>
#include <spdlog/fmt/fmt.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <random>

#include "clients/cli/failure.h"

namespace relit::cli {
namespace {

namespace fs = std::filesystem;

// @return 0 or errno
int write_all(int descriptor, std::string_view bytes) {
    while (!bytes.empty()) {
        const auto written = ::write(descriptor, bytes.data(), bytes.size());
        if (written < 0 && errno == EINTR) continue;
        if (written < 0) return errno;
        bytes.remove_prefix(std::size_t(written));
    }
    return 0;
}

// Writes and closes. @return 0 or errno
int write_and_close(int descriptor, std::string_view bytes) {
    const int failed = write_all(descriptor, bytes);
    const int not_closed = ::close(descriptor) == 0 ? 0 : errno;  // network folders say it here
    return failed != 0 ? failed : not_closed;
}

[[noreturn]] void fail_writing(const std::string& name, int error) {
    errno = error;
    fail_with_errno(name, "write it");
}

bool is_written_directly(const fs::path& path) {
    std::error_code ignored;
    const auto status = fs::status(path, ignored);
    return fs::exists(status) && !fs::is_regular_file(status);
}

fs::path folder_of(const fs::path& path) {
    return path.has_parent_path() ? path.parent_path() : fs::path(".");
}

// The file that a link names, so that the link stays.
fs::path behind_links(const fs::path& path) {
    std::error_code failed;
    const fs::path file = fs::is_symlink(path, failed) ? fs::weakly_canonical(path, failed) : path;
    return failed || file.empty() ? path : file;
}

}  // namespace

void write_to_stdout(std::string_view bytes) {
    const int error = write_all(STDOUT_FILENO, bytes);
    if (error == EPIPE) throw Failure(Exit::unreachable, "");
    if (error != 0) fail_writing("stdout", error);
}

void OutputFiles::write(const std::string& target, std::string_view bytes) {
    if (target == "-") return write_to_stdout(bytes);
    if (!is_written_directly(target)) return write_whole(behind_links(target), bytes);
    const int file = ::open(target.c_str(), O_WRONLY | O_CLOEXEC);
    if (file < 0) fail_with_errno(target, "write it");
    if (const int error = write_and_close(file, bytes)) fail_writing(target, error);
}

void OutputFiles::write_whole(const fs::path& path, std::string_view bytes) {
    const int file = create_unfinished(path);
    if (const int error = write_and_close(file, bytes)) {
        remove();
        fail_writing(path.string(), error);
    }
    finish(path);
}

// Permissions are the umask's business, as for any new file.
int OutputFiles::create_unfinished(const fs::path& path) {
    std::random_device random;
    const std::lock_guard lock(mutex_);
    for (int attempt = 0; attempt < 100; ++attempt) {
        const std::string name =
            folder_of(path) / fmt::format(".relit-{:08x}{:08x}", random(), random());
        const int file = ::open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (file < 0 && errno == EEXIST) continue;
        if (file < 0) break;
        unfinished_ = name;
        return file;
    }
    fail_with_errno(path.string(), "write it");
}

void OutputFiles::finish(const fs::path& path) {
    const std::lock_guard lock(mutex_);
    if (::rename(unfinished_.c_str(), path.c_str()) == 0) {
        unfinished_.clear();
        return;
    }
    const int error = errno;
    ::unlink(unfinished_.c_str());
    unfinished_.clear();
    fail_writing(path.string(), error);
}

void OutputFiles::remove() {
    const std::lock_guard lock(mutex_);
    if (!unfinished_.empty()) ::unlink(unfinished_.c_str());
    unfinished_.clear();
}

void OutputFiles::remove_unfinished() {
    mutex_.lock();  // for good: the program is about to end
    if (!unfinished_.empty()) ::unlink(unfinished_.c_str());
}

void check_target(const std::string& target, std::span<const fs::path> inputs) {
    if (target == "-") {
        if (::isatty(STDOUT_FILENO))
            throw Failure(Exit::usage,
                          "stdout is a terminal: send the picture to a file or a pipe");
        return;
    }
    std::error_code ignored;
    if (fs::is_directory(target, ignored))
        throw Failure(Exit::unreachable, target + ": is a folder");
    if (is_written_directly(target)) return;
    for (const fs::path& input : inputs)
        if (fs::equivalent(target, input, ignored))
            throw Failure(Exit::usage, target + ": is an input too; give the picture another name");
    const fs::path folder = folder_of(behind_links(target));
    if (::access(folder.c_str(), W_OK | X_OK) != 0) fail_with_errno(target, "write it");
}

}  // namespace relit::cli
