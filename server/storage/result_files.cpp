#include "server/storage/result_files.h"

#include <spdlog/spdlog.h>

#include <cerrno>

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

void ResultFiles::remove(const std::string& batch) const noexcept {
    std::error_code error;
    fs::remove_all(folder_ / "results" / batch, error);
    if (error) spdlog::warn("batches: pictures of {} remain: {}", batch, error.message());
}

void ResultFiles::sweep(
    const std::function<std::set<std::string>(const std::string& batch)>& known) const {
    std::error_code error;  // what is not there need not be swept, what stays is found the next time
    std::size_t count = 0;
    for (const auto& entry : fs::directory_iterator(folder_ / "incoming", error))
        count += fs::remove(entry, error) ? 1 : 0;
    for (const auto& batch : fs::directory_iterator(folder_ / "results", error)) {
        const std::set<std::string> names = known(batch.path().filename());
        for (const auto& file : fs::directory_iterator(batch.path(), error))
            if (!names.contains(file.path().filename())) count += fs::remove(file, error) ? 1 : 0;
        if (names.empty()) fs::remove(batch, error);
    }
    if (count > 0) spdlog::warn("batches: removed {} unfinished pictures of the last run", count);
}

}  // namespace relit::server
