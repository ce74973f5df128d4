#include "server/storage/result_files.h"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <cerrno>
#include <random>

#include "server/error_codes.h"
#include "server/storage/files.h"
#include "server/storage/sha256.h"

namespace relit::server {
namespace {

namespace fs = std::filesystem;

void make_folder(const fs::path& folder) {
    std::error_code error;
    fs::create_directory(folder, error);
    if (!error) return;
    errno = error.value();
    fail_storage("make a folder");
}

}  // namespace

ResultFiles::ResultFiles(fs::path folder)
    : folder_(std::move(folder)),
      clearing_([this](const std::stop_token& stop) { clear_folders(stop); }) {}

std::vector<std::string> ResultFiles::put(std::span<const NewPicture> pictures) const {
    if (pictures.empty()) return {};
    const fs::path incoming = folder_ / "incoming", results = folder_ / "results";
    for (const fs::path& folder : {folder_, incoming, results}) make_folder(folder);
    const auto now = std::chrono::system_clock::now();
    std::deque<TemporaryFile> files;
    for (const NewPicture& picture : pictures) files.emplace_back(incoming, picture.bytes, now);
    std::vector<std::string> names;
    std::set<std::string> batches;
    for (const NewPicture& picture : pictures) {  // while the disk writes
        names.push_back(sha256_hex(picture.bytes));
        batches.insert(picture.batch);
    }
    for (TemporaryFile& file : files) file.sync();
    for (const std::string& batch : batches) make_folder(results / batch);
    for (std::size_t i = 0; i < files.size(); ++i)
        files[i].rename_to(results / pictures[i].batch / names[i]);
    for (const std::string& batch : batches) sync_folder(results / batch);
    sync_folder(results);
    sync_folder(folder_);
    return names;
}

SharedBytes ResultFiles::get(const std::string& batch, const std::string& name) const {
    if (auto bytes = map_file(folder_ / "results" / batch / name)) return *bytes;
    spdlog::error("batches: the picture {} of {} was removed by somebody else", name, batch);
    throw Error(error_code::not_found, "The picture is gone.");
}

// Another folder at once, for a file takes a millisecond to remove while others are written.
void ResultFiles::remove(const std::string& batch) noexcept try {
    const fs::path results = folder_ / "results" / batch;
    if (!fs::exists(results)) return;
    make_folder(folder_ / "removed");
    const fs::path removed =
        folder_ / "removed" / fmt::format("{}-{:08x}", batch, std::random_device()());
    fs::rename(results, removed);
    clear_later(removed);
} catch (const std::exception& error) {
    spdlog::warn("batches: pictures of {} remain: {}", batch, error.what());
}

void ResultFiles::clear_later(const fs::path& folder) {
    const std::scoped_lock lock(mutex_);
    to_clear_.push_back(folder);
    changed_.notify_one();
}

void ResultFiles::clear_folders(const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    while (changed_.wait(lock, stop, [&] { return !to_clear_.empty(); })) {
        const fs::path folder = std::move(to_clear_.front());
        to_clear_.pop_front();
        lock.unlock();
        std::error_code error;  // what stays is found by the next sweep
        for (const auto& file : fs::directory_iterator(folder, error)) {
            if (stop.stop_requested()) return;
            fs::remove(file, error);
        }
        fs::remove(folder, error);
        if (error) spdlog::warn("batches: removed pictures remain: {}", error.message());
        lock.lock();
    }
}

void ResultFiles::sweep(const std::function<std::set<std::string>(const std::string& batch)>& known) {
    std::error_code error;  // what is not there need not be swept, what stays is found the next time
    std::size_t count = 0;
    for (const auto& folder : fs::directory_iterator(folder_ / "removed", error))
        clear_later(folder);
    for (const auto& entry : fs::directory_iterator(folder_ / "incoming", error))
        count += fs::remove(entry, error) ? 1 : 0;
    for (const auto& batch : fs::directory_iterator(folder_ / "results", error)) {
        const std::set<std::string> names = known(batch.path().filename());
        if (names.empty()) remove(batch.path().filename());
        else
            for (const auto& file : fs::directory_iterator(batch.path(), error))
                if (!names.contains(file.path().filename()))
                    count += fs::remove(file, error) ? 1 : 0;
    }
    if (count > 0) spdlog::warn("batches: removed {} unfinished pictures of the last run", count);
}

}  // namespace relit::server
