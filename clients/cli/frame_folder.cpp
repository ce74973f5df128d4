#include "clients/cli/frame_folder.h"

#include <fcntl.h>
#include <spdlog/fmt/fmt.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <map>
#include <set>
#include <sstream>

#include "clients/cli/failure.h"
#include "core/base/parallel.h"
#include "server/storage/sha256.h"

namespace relit::cli {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view records_name = ".relit-frames";
constexpr std::string_view note_name = ".relit-batch";

// "3/8" -> "-3-of-8"
std::string suffix_of(const std::string& shard) {
    const auto slash = shard.find('/');
    if (slash == std::string::npos) return "";
    return "-" + shard.substr(0, slash) + "-of-" + shard.substr(slash + 1);
}

// A file that was written: of which picture, and its bytes.
struct Record {
    std::string etag;
    std::string sha256;
    bool operator<(const Record& other) const {
        return std::tie(etag, sha256) < std::tie(other.etag, other.sha256);
    }
};
using Records = std::map<std::string, std::set<Record>>;  // by the file's name

// Lines of ETag, SHA-256 and name; what a crash cut short is no line.
void read_records(const fs::path& path, Records& records) {
    std::ifstream file(path);
    for (std::string line; std::getline(file, line);) {
        std::istringstream words(line);
        Record record;
        std::string name;
        if (words >> record.etag >> record.sha256 >> name) records[name].insert(record);
    }
}

Records records_in(const fs::path& folder) {
    Records records;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder))
        if (entry.path().filename().string().starts_with(records_name))
            read_records(entry.path(), records);
    return records;
}

// A file is what its record says, or it is none.
std::string sha256_of(const fs::path& path) try {
    return read_file(path).id;
} catch (const Failure&) {
    return "";
}

bool is_there(const Frame& frame, const fs::path& path, const Records& records) {
    const auto found = records.find(frame.name);
    if (found == records.end()) return false;
    const auto of_this_scene = [&](const Record& record) { return record.etag == frame.etag; };
    if (std::none_of(found->second.begin(), found->second.end(), of_this_scene)) return false;
    return found->second.contains({frame.etag, sha256_of(path)});
}

void make_folder(const std::string& folder) {
    if (folder == "-") throw Failure(Exit::usage, "-: frames go into a folder, not to stdout");
    std::error_code failed;
    fs::create_directories(folder, failed);
    if (fs::is_directory(folder)) return;
    if (failed && failed != std::errc::not_a_directory && failed != std::errc::file_exists) {
        errno = failed.value();
        fail_with_errno(folder, "make the folder");
    }
    throw Failure(Exit::unreachable, folder + ": is no folder");
}

}  // namespace

FrameFolder::FrameFolder(std::string folder, const std::string& shard, Console console)
    : folder_(std::move(folder)), suffix_(suffix_of(shard)), console_(console) {
    make_folder(folder_);
    const std::string records = path_of(std::string(records_name) + suffix_);
    records_ = ::open(records.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
    // The last line may have been cut.
    if (records_ < 0 || ::write(records_, "\n", 1) != 1) fail_with_errno(records, "write it");
    remove_abandoned(folder_);
}

FrameFolder::~FrameFolder() { ::close(records_); }

std::string FrameFolder::path_of(const std::string& name) const { return fs::path(folder_) / name; }

std::vector<Frame> FrameFolder::missing(std::span<const Frame> frames) const {
    const Records records = records_in(folder_);
    std::vector<char> there(frames.size());
    parallel_rows(Executor(), int(frames.size()), {}, [&](RowRange range) {
        for (auto i = std::size_t(range.begin); i < std::size_t(range.end); ++i)
            there[i] = is_there(frames[i], path_of(frames[i].name), records);
    });
    std::vector<Frame> missing;
    for (std::size_t i = 0; i < frames.size(); ++i)
        if (!there[i]) missing.push_back(frames[i]);
    return missing;
}

void FrameFolder::check_targets(std::span<const Frame> frames,
                                std::span<const fs::path> files) const {
    std::error_code ignored;
    std::set<fs::path> inputs;
    for (const fs::path& file : files) inputs.insert(fs::weakly_canonical(file, ignored));
    const fs::path folder = fs::weakly_canonical(folder_, ignored);
    for (const Frame& frame : frames)
        if (inputs.contains(folder / frame.name))
            throw Failure(Exit::usage, path_of(frame.name) +
                                           ": is an input too; give the frames another folder");
}

void FrameFolder::expect(std::size_t frames) {
    expected_ = int(frames);
    console_.progress.begin("frames");
    console_.progress.count(0, expected_);
}

void FrameFolder::keep(const Frame& frame, std::string_view picture) {
    console_.outputs.write(path_of(frame.name), picture);
    const std::string record =
        fmt::format("{} {} {}\n", frame.etag, server::sha256_hex(picture), frame.name);
    {
        const std::lock_guard lock(mutex_);
        if (::write(records_, record.data(), record.size()) != ssize_t(record.size()))
            fail_with_errno(path_of(std::string(records_name) + suffix_), "write it");
    }
    count();
}

void FrameFolder::fail(const Frame& frame, const std::string& words) {
    console_.progress.complain("relit: " + frame.name + ": " + words);
    ++failed_;
    count();
}

void FrameFolder::count() { console_.progress.count(++done_, expected_); }

std::string FrameFolder::note() const {
    std::ifstream file(path_of(std::string(note_name) + suffix_), std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

void FrameFolder::write_note(const std::string& text) {
    const std::string path = path_of(std::string(note_name) + suffix_);
    if (!text.empty()) return console_.outputs.write(path, text);
    std::error_code ignored;
    fs::remove(path, ignored);
}

}  // namespace relit::cli
