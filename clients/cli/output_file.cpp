#include "clients/cli/output_file.h"

#include <fcntl.h>
#include <spdlog/fmt/fmt.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdio>
#include <optional>
#include <random>

#include "clients/cli/failure.h"
#include "server/text.h"

namespace relit::cli {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view unfinished_prefix = ".relit-";
constexpr auto abandoned_after = std::chrono::minutes(1);
constexpr int most_links = 40;  // that lead from one to the next, as the kernel has it

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

// The descriptor that a target names: "-", /dev/stdout, /dev/fd/3, /proc/self/fd/3, a link to one
// of them. By its path such a target would be opened anew, from the start, or replaced.
std::optional<int> named_descriptor(const std::string& target) {
    if (target == "-") return STDOUT_FILENO;
    std::error_code failed;
    const fs::path self = fs::canonical("/proc/self", failed);
    fs::path path = target;
    for (int links = 0; links < most_links && !failed; ++links) {
        const fs::path folder = fs::canonical(folder_of(path), failed);
        const bool of_ours = folder.string().starts_with(self.string() + "/");
        if (!failed && of_ours && folder.filename() == "fd")
            return server::parse_number<int>(path.filename().string());
        if (!failed) path = folder / fs::read_symlink(path, failed);
    }
    return std::nullopt;
}

std::string name_of(const std::string& target) { return target == "-" ? "stdout" : target; }

void write_through(int descriptor, const std::string& name, std::string_view bytes) {
    const int error = write_all(descriptor, bytes);
    if (error == EPIPE) throw Failure(Exit::unreachable, "");
    if (error != 0) fail_writing(name, error);
}

// The caller has to have opened it: what the program opens itself is closed on exec.
void check_descriptor(int descriptor, const std::string& name) {
    const int flags = ::fcntl(descriptor, F_GETFD);
    const int mode = ::fcntl(descriptor, F_GETFL);
    if (flags < 0 || (flags & FD_CLOEXEC) != 0 || (mode & O_ACCMODE) == O_RDONLY)
        fail_writing(name, EBADF);
    if (::isatty(descriptor))
        throw Failure(Exit::usage, name + " is a terminal: send the picture to a file or a pipe");
}

}  // namespace

void write_to_stdout(std::string_view bytes) { write_through(STDOUT_FILENO, "stdout", bytes); }

void OutputFiles::write(const std::string& target, std::string_view bytes) {
    if (const auto descriptor = named_descriptor(target))
        return write_through(*descriptor, name_of(target), bytes);
    if (!is_written_directly(target)) return write_whole(behind_links(target), bytes);
    const int file = ::open(target.c_str(), O_WRONLY | O_CLOEXEC);
    if (file < 0) fail_with_errno(target, "write it");
    if (const int error = write_and_close(file, bytes)) fail_writing(target, error);
}

void OutputFiles::write_whole(const fs::path& path, std::string_view bytes) {
    const Unfinished file = create_unfinished(path);
    if (const int error = write_and_close(file.descriptor, bytes)) {
        remove(file.name);
        fail_writing(path.string(), error);
    }
    finish(file.name, path);
}

// Permissions are the umask's business, as for any new file.
OutputFiles::Unfinished OutputFiles::create_unfinished(const fs::path& path) {
    std::random_device random;
    const std::lock_guard lock(mutex_);
    for (int attempt = 0; attempt < 100; ++attempt) {
        const std::string name =
            folder_of(path) / fmt::format("{}{:08x}{:08x}", unfinished_prefix, random(), random());
        const int file = ::open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (file < 0 && errno == EEXIST) continue;
        if (file < 0) break;
        unfinished_.insert(name);
        return {file, name};
    }
    fail_with_errno(path.string(), "write it");
}

void OutputFiles::finish(const std::string& unfinished, const fs::path& path) {
    const std::lock_guard lock(mutex_);
    unfinished_.erase(unfinished);
    if (::rename(unfinished.c_str(), path.c_str()) == 0) return;
    const int error = errno;
    ::unlink(unfinished.c_str());
    fail_writing(path.string(), error);
}

void OutputFiles::remove(const std::string& unfinished) {
    const std::lock_guard lock(mutex_);
    ::unlink(unfinished.c_str());
    unfinished_.erase(unfinished);
}

void OutputFiles::remove_unfinished() {
    mutex_.lock();  // for good: the program is about to end
    for (const std::string& name : unfinished_) ::unlink(name.c_str());
}

void remove_abandoned(const fs::path& folder) {
    const auto is_unfinished = [](const std::string& name) {
        const std::size_t prefix = unfinished_prefix.size();
        return name.starts_with(unfinished_prefix) && name.size() == prefix + 16 &&
               name.find_first_not_of("0123456789abcdef", prefix) == std::string::npos;
    };
    std::error_code ignored;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder, ignored)) {
        const auto age = fs::file_time_type::clock::now() - entry.last_write_time(ignored);
        if (is_unfinished(entry.path().filename().string()) && age > abandoned_after)
            fs::remove(entry.path(), ignored);
    }
}

void check_target(const std::string& target, std::span<const fs::path> inputs) {
    if (const auto descriptor = named_descriptor(target))
        return check_descriptor(*descriptor, name_of(target));
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
