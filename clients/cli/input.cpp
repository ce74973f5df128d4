#include "clients/cli/input.h"

#include <fcntl.h>
#include <spdlog/fmt/fmt.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>

#include "clients/cli/failure.h"
#include "server/samples/samples.h"
#include "server/storage/sha256.h"

namespace relit::cli {
namespace {

constexpr std::string_view sample_prefix = "sample:";
constexpr std::size_t most_bytes = std::size_t(4) << 30;  // of an input that does not end
constexpr std::size_t piece_bytes = 1 << 20;

struct Descriptor {
    int number = -1;
    ~Descriptor() {
        if (number >= 0) ::close(number);
    }
};

std::string read_all(int descriptor, const std::string& name) {
    std::string bytes;
    struct stat status {};
    if (::fstat(descriptor, &status) == 0 && S_ISREG(status.st_mode))
        bytes.reserve(std::size_t(status.st_size) + piece_bytes);
    for (;;) {
        const std::size_t before = bytes.size();
        bytes.resize(before + piece_bytes);
        const auto received = ::read(descriptor, bytes.data() + before, piece_bytes);
        bytes.resize(before + std::size_t(std::max<ssize_t>(received, 0)));
        if (received < 0 && errno == EINTR) continue;
        if (received < 0 && errno == EISDIR)
            throw Failure(Exit::unreachable, name + ": is a folder");
        if (received < 0) fail_with_errno(name, "read it");
        if (received == 0) return bytes;
        if (bytes.size() > most_bytes) throw Failure(Exit::refused, name + ": has more than 4 GiB");
    }
}

Input input_of(std::string name, std::filesystem::path path, std::string&& bytes) {
    if (bytes.empty()) throw Failure(Exit::refused, name + ": is empty");
    const auto owner = std::make_shared<const std::string>(std::move(bytes));
    return {std::move(name), std::move(path), {owner, *owner}, server::sha256_hex(*owner)};
}

Input sample_input(const std::string& argument) {
    const auto name = std::string_view(argument).substr(sample_prefix.size());
    if (const server::Sample* sample = server::find_sample(name))
        return {argument, {}, {nullptr, sample->bytes}, sample->id};
    std::string names;
    for (const server::Sample& sample : server::samples())
        names += fmt::format("{}{}", names.empty() ? "" : ", ", sample.name);
    throw Failure(Exit::refused,
                  fmt::format("{}: there is no such sample; there are {}", argument, names));
}

}  // namespace

Input read_input(const std::string& argument) {
    if (argument == "-") return input_of("stdin", {}, read_all(STDIN_FILENO, "stdin"));
    if (argument.starts_with(sample_prefix)) return sample_input(argument);
    return read_file(argument);
}

Input read_file(const std::filesystem::path& path) {
    const std::string name = path.string();
    const Descriptor file{::open(name.c_str(), O_RDONLY | O_CLOEXEC)};
    if (file.number < 0) fail_with_errno(name, "read it");
    return input_of(name, path, read_all(file.number, name));
}

}  // namespace relit::cli
