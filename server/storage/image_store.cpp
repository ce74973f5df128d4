#include "server/storage/image_store.h"

#include <fcntl.h>
#include <spdlog/spdlog.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>

#include "server/error_codes.h"
#include "server/storage/files.h"
#include "server/storage/image_info_file.h"
#include "server/storage/sha256.h"

namespace relit::server {
namespace {

namespace fs = std::filesystem;

bool is_id(std::string_view text) {
    return text.size() == 64 && std::all_of(text.begin(), text.end(), [](char c) {
               return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f');
           });
}

Error no_such_image() { return {error_code::not_found, "There is no image with this id."}; }

[[noreturn]] void refuse_folder(const fs::path& folder, const std::string& reason) {
    throw std::runtime_error("the data folder " + folder.string() + " " + reason);
}

int lock_folder(const fs::path& folder) {
    const int file = ::open((folder / "lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
    if (file < 0) refuse_folder(folder, std::string("cannot be written: ") + std::strerror(errno));
    if (::flock(file, LOCK_EX | LOCK_NB) == 0) return file;
    const int error = errno;
    ::close(file);
    if (error == EWOULDBLOCK) refuse_folder(folder, "is in use by another relitd");
    refuse_folder(folder, std::string("cannot be locked: ") + std::strerror(error));
}

void remove_leftovers(const fs::path& incoming) {
    std::size_t count = 0;
    for (const auto& entry : fs::directory_iterator(incoming)) count += fs::remove(entry) ? 1 : 0;
    if (count > 0) spdlog::warn("storage: removed {} unfinished uploads of the last run", count);
}

}  // namespace

ImageStore::ImageStore(fs::path folder, DecodeLimits limits)
    : folder_(std::move(folder)), limits_(limits) {
    std::error_code error;
    fs::create_directories(folder_, error);
    if (error) refuse_folder(folder_, "cannot be made: " + error.message());
    lock_ = lock_folder(folder_);
    try {
        fs::create_directories(folder_ / "images");
        fs::create_directories(folder_ / "incoming");
        remove_leftovers(folder_ / "incoming");
        sync_folder(folder_);
    } catch (const std::exception&) {
        ::close(lock_);
        refuse_folder(folder_, "cannot be written");
    }
}

ImageStore::~ImageStore() { ::close(lock_); }

std::string ImageStore::id_of(std::string_view bytes) { return sha256_hex(bytes); }

ImageStore::Place ImageStore::place_of(const std::string& id) const {
    const fs::path folder = folder_ / "images" / id.substr(0, 2) / id.substr(2, 2);
    return {folder, folder / id, folder / (id + ".info")};
}

ImageStore::Place ImageStore::existing_place(const std::string& id) const {
    if (!contains(id)) throw no_such_image();
    return place_of(id);
}

bool ImageStore::contains(const std::string& id) const {
    return is_id(id) && ::access(place_of(id).file.c_str(), F_OK) == 0;
}

void ImageStore::make_folders(const Place& place) const {
    std::error_code error;
    fs::create_directories(place.folder, error);
    if (error) {
        errno = error.value();
        fail_storage("make a folder");
    }
    sync_folder(folder_ / "images");
    sync_folder(place.folder.parent_path());
}

ImageStore::Put ImageStore::put(std::string_view bytes, const ImageInfo& info) {
    const auto id = id_of(bytes);
    const auto place = place_of(id);
    bool created = false;
    if (!contains(id)) {
        make_folders(place);
        TemporaryFile facts(folder_ / "incoming", image_info_text(info));
        TemporaryFile file(folder_ / "incoming", bytes);
        const std::scoped_lock lock(changing_);
        created = !contains(id);
        facts.rename_to(place.info);
        file.rename_to(place.file);  // from here on it exists
    }
    sync_folder(
        place.folder);  // also for who found it there: the one that renamed may not have come so far
    return {id, created};
}

SharedBytes ImageStore::get(const std::string& id) const {
    const auto bytes = map_file(existing_place(id).file);
    if (!bytes) throw no_such_image();
    return *bytes;
}

StoredImage ImageStore::info(const std::string& id) const {
    const auto place = existing_place(id);
    const auto bytes = get(id);
    if (const auto text = map_file(place.info))
        if (const auto info = parse_image_info(*text)) return {id, *info, bytes.bytes.size()};
    const auto info = decode(bytes, limits_).info;
    TemporaryFile facts(folder_ / "incoming", image_info_text(info));
    const std::scoped_lock lock(changing_);
    if (!contains(id)) throw no_such_image();
    facts.rename_to(place.info);
    return {id, info, bytes.bytes.size()};
}

void ImageStore::remove(const std::string& id) {
    const auto place = existing_place(id);
    {
        const std::scoped_lock lock(changing_);
        if (::unlink(place.file.c_str()) != 0) {
            if (errno == ENOENT) throw no_such_image();
            fail_storage("remove");
        }
        ::unlink(
            place.info.c_str());  // one left behind is harmless: it is written anew with its image
    }
    sync_folder(place.folder);
}

}  // namespace relit::server
