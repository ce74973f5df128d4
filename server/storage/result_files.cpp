#include "server/storage/result_files.h"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cerrno>
#include <map>

#include "server/error_codes.h"
#include "server/random_hex.h"
#include "server/storage/files.h"
#include "server/storage/sha256.h"
#include "server/text.h"

namespace relit::server {
namespace {

namespace fs = std::filesystem;

// A file that is being filled.
struct Pack {
    explicit Pack(const fs::path& incoming) : file(incoming) {}
    std::string name = random_hex(2);
    TemporaryFile file;
    std::size_t size = 0;
};

// What a picture's name says; nothing of a name that is none of ours.
struct Place {
    std::string_view pack;
    std::size_t offset = 0, size = 0;
};

std::string_view next_part(std::string_view& name) {
    const auto part = name.substr(0, name.find('-'));
    name.remove_prefix(std::min(part.size() + 1, name.size()));
    return part;
}

Place place_of(std::string_view name) {
    (void)next_part(name);
    Place place{.pack = next_part(name)};
    const auto offset = parse_number<std::size_t>(next_part(name));
    const auto size = parse_number<std::size_t>(name);
    if (!offset || !size) return {};
    place.offset = *offset;
    place.size = *size;
    return place;
}

// @return how many files were removed
std::size_t remove_others(const fs::path& folder, const std::set<std::string>& pictures) {
    std::set<std::string_view> packs;
    for (const std::string& name : pictures) packs.insert(ResultFiles::pack_of(name));
    std::error_code error;  // what stays is found the next time
    std::size_t count = 0;
    for (const auto& file : fs::directory_iterator(folder, error))
        if (!packs.contains(file.path().filename().native()))
            count += fs::remove(file, error) ? 1 : 0;
    return count;
}

}  // namespace

ResultFiles::ResultFiles(fs::path folder)
    : folder_(std::move(folder)),
      clearing_([this](const std::stop_token& stop) { clear_folders(stop); }) {}

// One pack for each batch: what is synced and renamed is a file, however many pictures it holds.
std::vector<std::string> ResultFiles::put(std::span<const NewPicture> pictures) const {
    if (pictures.empty()) return {};
    const fs::path incoming = folder_ / "incoming", results = folder_ / "results";
    for (const fs::path& folder : {folder_, incoming, results}) make_folder(folder);
    std::vector<std::string> names;
    std::map<std::string_view, Pack> packs;
    for (const auto& [batch, bytes] : pictures) {
        Pack& pack = packs.try_emplace(batch, incoming).first->second;
        names.push_back(
            fmt::format("{}-{}-{}-{}", sha256_hex(bytes), pack.name, pack.size, bytes.size()));
        pack.file.append(bytes);
        pack.size += bytes.size();
    }
    for (auto& [batch, pack] : packs) {
        pack.file.sync(std::chrono::system_clock::now());
        make_folder(results / batch);
        pack.file.rename_to(results / batch / pack.name);
        sync_folder(results / batch);
    }
    sync_folder(results);
    sync_folder(folder_);
    return names;
}

SharedBytes ResultFiles::get(const std::string& batch, const std::string& name) const {
    const Place place = place_of(name);
    const auto pack =
        place.pack.empty() ? std::nullopt : map_file(folder_ / "results" / batch / place.pack);
    if (pack && place.offset <= pack->bytes.size() &&
        place.size <= pack->bytes.size() - place.offset)
        return {pack->owner, pack->bytes.substr(place.offset, place.size)};
    throw Error(error_code::not_found, "The picture is gone.");
}

std::string_view ResultFiles::content_hash(std::string_view name) {
    return name.substr(0, name.find('-'));
}

std::string_view ResultFiles::pack_of(std::string_view name) { return place_of(name).pack; }

// Another folder at once, for a file takes a millisecond to remove while others are written.
void ResultFiles::remove(const std::string& batch) noexcept try {
    const fs::path results = folder_ / "results" / batch;
    if (!fs::exists(results)) return;
    make_folder(folder_ / "removed");
    const fs::path removed = folder_ / "removed" / fmt::format("{}-{}", batch, random_hex(1));
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
        else count += remove_others(batch.path(), names);
    }
    if (count > 0) spdlog::warn("batches: removed {} unfinished files of the last run", count);
}

}  // namespace relit::server
