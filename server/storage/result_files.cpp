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

std::string ResultFiles::put(const std::string& batch, std::string_view bytes) const {
    const fs::path incoming = folder_ / "incoming";
    const fs::path results = folder_ / "results" / batch;
    for (const fs::path& folder : {folder_, incoming, results.parent_path(), results})
        make_folder(folder);
    std::string name = sha256_hex(bytes);
    TemporaryFile file(incoming, bytes, std::chrono::system_clock::now());
    file.rename_to(results / name);
    return name;
}

void ResultFiles::sync(const std::set<std::string>& batches) const {
    if (batches.empty()) return;
    for (const std::string& batch : batches) sync_folder(folder_ / "results" / batch);
    sync_folder(folder_ / "results");
    sync_folder(folder_);
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
