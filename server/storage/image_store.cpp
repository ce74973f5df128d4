#include "server/storage/image_store.h"

#include <fcntl.h>
#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cassert>
#include <cerrno>
#include <cstring>
#include <stdexcept>

#include "server/error_codes.h"
#include "server/storage/image_info_file.h"
#include "server/storage/sha256.h"

namespace relit::server {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view facts_extension = ".info";
constexpr auto use_written_every = std::chrono::minutes(1);

Error no_such_image() {
    return {error_code::not_found, "There is no image with this id: upload it (again)."};
}

[[noreturn]] void refuse_folder(const fs::path& folder, const std::string& reason) {
    throw std::runtime_error("the data folder " + folder.string() + " " + reason);
}

// Makes the folder where it is missing.
int lock_folder(const fs::path& folder) {
    std::error_code failure;
    fs::create_directories(folder, failure);
    if (failure) refuse_folder(folder, "cannot be made: " + failure.message());
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

ImageStore::ImageStore(fs::path folder, ImageStoreSettings settings)
    : folder_(std::move(folder)), settings_(std::move(settings)), lock_(lock_folder(folder_)) {
    for (const BuiltIn& image : settings_.built_in) {
        assert(image.id == id_of(image.bytes));
        built_in_[image.id] = {image.bytes, {}};
    }
    try {
        fs::create_directories(folder_ / "images");
        fs::create_directories(folder_ / "incoming");
        remove_leftovers(folder_ / "incoming");
        sync_folder(folder_);
        read_folder();
        sync_folders_of(make_room(0));
    } catch (const std::exception&) {
        refuse_folder(folder_, "cannot be read or written");
    }
    spdlog::info("storage: {} images, {} bytes of at most {} (max-storage)", index_.count(),
                 index_.size_bytes(), settings_.max_bytes);
}

bool ImageStore::is_id(std::string_view text) {
    return text.size() == 64 && std::all_of(text.begin(), text.end(), [](char c) {
               return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f');
           });
}

std::string ImageStore::id_of(std::string_view bytes) { return sha256_hex(bytes); }

ImageStore::Files ImageStore::files_of(const std::string& id) const {
    const fs::path folder = folder_ / "images" / id.substr(0, 2) / id.substr(2, 2);
    return {folder, folder / id, folder / (id + std::string(facts_extension))};
}

void ImageStore::read_folder() {
    struct Found {
        std::string id;
        FileFacts image;
        FileTime used;
    };
    std::vector<Found> images;
    std::vector<fs::path> foreign, orphans;
    for (const auto& item : fs::recursive_directory_iterator(folder_ / "images")) {
        if (item.is_directory() && !item.is_symlink()) continue;
        const fs::path& path = item.path();
        const bool is_facts = path.extension() == facts_extension;
        const std::string id = is_facts ? path.stem() : path.filename();
        const bool is_ours = is_id(id) && path.parent_path() == files_of(id).folder;
        const auto image = is_ours ? file_facts(files_of(id).image) : std::nullopt;
        if (is_ours && is_facts && !image) orphans.push_back(path);
        else if (!image) foreign.push_back(path);
        else if (!is_facts) {
            const auto facts = file_facts(files_of(id).facts);
            images.push_back({id, *image, facts ? facts->time : image->time});
        }
    }
    for (const fs::path& path : orphans) fs::remove(path);
    if (!foreign.empty())
        spdlog::warn("storage: ignores {} files that are not its own, such as {}", foreign.size(),
                     foreign.front().string());
    std::sort(images.begin(), images.end(),
              [](const Found& a, const Found& b) { return a.used < b.used; });
    for (const Found& found : images)
        index_.add(found.id, {.size_bytes = found.image.size_bytes,
                              .created = found.image.time,
                              .use_written = found.used,
                              .info = {},
                              .mapped = {}});
}

void ImageStore::make_folders(const Files& files) const {
    // One by one: a store that somebody has deleted must not come back in part, and look well.
    for (const fs::path& folder : {files.folder.parent_path(), files.folder}) make_folder(folder);
    sync_folder(folder_ / "images");
    sync_folder(files.folder.parent_path());
}

void ImageStore::write_files(const Files& files, std::string_view bytes, const ImageInfo& info,
                             FileTime time) const {
    make_folders(files);
    TemporaryFile facts(folder_ / "incoming"), image(folder_ / "incoming");
    facts.append(image_info_text(info));
    image.append(bytes);
    facts.sync(time);
    image.sync(time);
    try {
        facts.rename_to(files.facts);
        image.rename_to(files.image);  // from here on it exists
        sync_folder(files.folder);
    } catch (const Error&) {
        ::unlink(files.image.c_str());
        ::unlink(files.facts.c_str());
        throw;
    }
}

ImageStore::Put ImageStore::put(std::string_view bytes, const ImageInfo& info) {
    const auto id = id_of(bytes);
    std::unique_lock lock(mutex_);
    arrived_.wait(lock, [&] { return !arriving_.contains(id); });
    if (const auto* entry = use(id))
        return {id, false, {id, info, entry->size_bytes, entry->created}};
    const auto evicted = make_room(bytes.size());
    arriving_.insert(id);
    arriving_bytes_ += bytes.size();
    const auto end_arrival = [&] {
        arriving_.erase(id);
        arriving_bytes_ -= bytes.size();
        arrived_.notify_all();
    };

    lock.unlock();
    const FileTime now = std::chrono::system_clock::now();
    try {
        sync_folders_of(evicted);
        write_files(files_of(id), bytes, info, now);
    } catch (...) {
        lock.lock();
        end_arrival();
        throw;
    }
    lock.lock();
    end_arrival();
    index_.add(id, {.size_bytes = bytes.size(),
                    .created = now,
                    .use_written = now,
                    .info = info,
                    .mapped = {}});
    return {id, true, {id, info, bytes.size(), now}};
}

// @return the images that had to go; their folders are not synced
std::vector<std::string> ImageStore::make_room(std::uint64_t size_bytes) {
    const std::uint64_t max = settings_.max_bytes;
    if (size_bytes > max)
        throw Error(error_code::storage_full,
                    fmt::format("The image has {} bytes, and all stored images together may have "
                                "{} (max-storage).",
                                size_bytes, max),
                    {}, "max-storage");
    const std::uint64_t wanted = index_.size_bytes() + arriving_bytes_ + size_bytes;
    if (wanted <= max) return {};
    auto ids = index_.least_recent(wanted - max);
    if (!ids)
        throw Error(error_code::storage_full,
                    fmt::format("There is no room left to store images: together they may have {} "
                                "bytes (max-storage), and those in use cannot go.",
                                max),
                    {}, "max-storage");
    for (const std::string& id : *ids) {
        unlink_stored(id);
        ++evicted_;
    }
    spdlog::debug("storage: evicted {} images to make room (max-storage)", ids->size());
    return std::move(*ids);
}

void ImageStore::unlink_stored(const std::string& id) const {
    const auto files = files_of(id);
    if (::unlink(files.image.c_str()) != 0 && errno != ENOENT) fail_storage("remove");
    ::unlink(files.facts.c_str());  // one left behind is removed at the next start
    index_.remove(id);
}

void ImageStore::sync_folders_of(const std::vector<std::string>& ids) const {
    std::set<fs::path> folders;
    for (const std::string& id : ids) folders.insert(files_of(id).folder);
    for (const fs::path& folder : folders) sync_folder(folder);
}

// @return null where it is not stored
ImageIndex::Entry* ImageStore::use(const std::string& id) const {
    ImageIndex::Entry* const entry = index_.find(id);
    if (!entry) return nullptr;
    index_.use(id);
    const FileTime now = std::chrono::system_clock::now();
    if (now < entry->use_written || now - entry->use_written >= use_written_every) {
        set_file_time(files_of(id).facts, now);
        entry->use_written = now;
    }
    return entry;
}

// Who asks while others hold the bytes shares their mapping.
std::optional<SharedBytes> ImageStore::map_stored(const std::string& id) const {
    ImageIndex::Entry* const entry = index_.find(id);
    if (!entry) return std::nullopt;
    if (auto owner = entry->mapped.lock()) {
        const std::string_view bytes(static_cast<const char*>(owner.get()), entry->size_bytes);
        return SharedBytes{std::move(owner), bytes};
    }
    auto mapped = map_file(files_of(id).image);
    if (mapped && mapped->bytes.size() == entry->size_bytes) {
        entry->mapped = mapped->owner;
        return mapped;
    }
    spdlog::error("storage: image {} was removed or changed by somebody else; it is forgotten", id);
    unlink_stored(id);
    return std::nullopt;
}

SharedBytes ImageStore::get(const std::string& id) const {
    const std::scoped_lock lock(mutex_);
    if (use(id))
        if (const auto bytes = map_stored(id)) return *bytes;
    if (const auto found = built_in_.find(id); found != built_in_.end())
        return {nullptr, found->second.bytes};
    throw no_such_image();
}

StoredImage ImageStore::info(const std::string& id) const {
    if (auto image = find(id)) return std::move(*image);
    return describe_built_in(id);
}

std::optional<StoredImage> ImageStore::find(const std::string& id) const {
    {
        const std::scoped_lock lock(mutex_);
        if (!use(id)) return std::nullopt;
    }
    return describe(id);
}

std::optional<StoredImage> ImageStore::describe(const std::string& id) const {
    const auto known = [&]() -> std::optional<StoredImage> {
        const ImageIndex::Entry* const entry = index_.find(id);
        if (!entry || !entry->info) return std::nullopt;
        return StoredImage{id, *entry->info, entry->size_bytes, entry->created};
    };
    {
        const std::scoped_lock lock(mutex_);
        if (auto image = known()) return image;
        if (!index_.find(id)) return std::nullopt;
    }
    const auto info = read_facts(id);
    const std::scoped_lock lock(mutex_);
    if (auto* const entry = index_.find(id); entry && info) entry->info = info;
    return known();
}

// From the file beside the image, or else from the image. @return nothing where it is gone
std::optional<ImageInfo> ImageStore::read_facts(const std::string& id) const {
    const auto files = files_of(id);
    if (const auto text = map_file(files.facts))
        if (const auto info = parse_image_info(*text)) return info;
    std::optional<SharedBytes> bytes;
    {
        const std::scoped_lock lock(mutex_);
        bytes = map_stored(id);
    }
    if (!bytes) return std::nullopt;
    const auto info = settings_.read_info(*bytes);
    try {
        TemporaryFile facts(folder_ / "incoming");
        facts.append(image_info_text(info));
        facts.sync(std::chrono::system_clock::now());
        const std::scoped_lock lock(mutex_);
        if (index_.find(id)) facts.rename_to(files.facts);
    } catch (const Error&) {  // logged; the facts are known all the same
    }
    return info;
}

StoredImage ImageStore::describe_built_in(const std::string& id) const {
    const auto found = built_in_.find(id);
    if (found == built_in_.end()) throw no_such_image();
    auto& [bytes, known] = found->second;
    std::unique_lock lock(mutex_);
    if (!known) {
        lock.unlock();
        const auto info = decode(bytes).info;
        lock.lock();
        known = info;
    }
    return {id, *known, bytes.size(), std::nullopt};
}

bool ImageStore::contains(const std::string& id) const { return place(id).has_value(); }

std::optional<ImagePlace> ImageStore::place(const std::string& id) const {
    const std::scoped_lock lock(mutex_);
    const ImageIndex::Entry* const entry = index_.find(id);
    if (!entry) return std::nullopt;
    return ImagePlace{entry->created, id};
}

void ImageStore::remove(const std::string& id) {
    {
        const std::scoped_lock lock(mutex_);
        if (!index_.find(id)) {
            if (!built_in_.contains(id)) throw no_such_image();
            throw Error(error_code::conflict,
                        "This image is a sample that ships with the server: it cannot be deleted.");
        }
        unlink_stored(id);
    }
    sync_folder(files_of(id).folder);
}

ImageStore::Page ImageStore::list(std::size_t limit, const std::optional<ImagePlace>& after) const {
    std::vector<ImagePlace> places;
    {
        const std::scoped_lock lock(mutex_);
        places = index_.newest(limit + 1, after);
    }
    Page page;
    if (places.size() > limit) {
        places.pop_back();
        page.next = places.back();
    }
    for (const ImagePlace& place : places) try {
            const auto image = describe(place.id);
            // Gone meanwhile; or gone and back, as a newer one.
            if (image && image->created == place.created) page.images.push_back(*image);
        } catch (const Error& error) {
            if (error.code == error_code::storage_failed) throw;
            spdlog::error("storage: image {} cannot be listed: {}", place.id, error.what());
        }
    return page;
}

std::uint64_t ImageStore::stored_bytes() const {
    const std::scoped_lock lock(mutex_);
    return index_.size_bytes();
}

std::size_t ImageStore::stored_images() const {
    const std::scoped_lock lock(mutex_);
    return index_.count();
}

std::uint64_t ImageStore::evicted_images() const {
    const std::scoped_lock lock(mutex_);
    return evicted_;
}

}  // namespace relit::server
