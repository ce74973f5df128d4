// Uploaded images as files named by the SHA-256 of their bytes: the same bytes are stored once, and
// what an id means never changes. For the image routes and for scenes that refer to images.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "core/io/decode.h"
#include "server/shared_bytes.h"
#include "server/storage/files.h"
#include "server/storage/image_index.h"

namespace relit::server {

/// What the store knows of an image.
struct StoredImage {
    std::string id;
    ImageInfo info;
    std::uint64_t size_bytes = 0;
    std::optional<FileTime> created;  ///< when it was stored; nothing for a built-in image
};

/// An image that is there without being stored: it ships in the program.
struct BuiltIn {
    std::string id;          ///< SHA-256 of the bytes, as of any image
    std::string_view bytes;  ///< a file that decode() takes; for as long as the program runs
};

struct ImageStoreSettings {
    /// For an image whose facts are missing. @throws Error as decode()
    std::function<ImageInfo(std::string_view bytes)> read_info = [](std::string_view bytes) {
        return decode(bytes).info;
    };
    /// Setting max-storage: the bytes of all stored images together, small files beside them not
    /// counted; above 0.
    std::uint64_t max_bytes = 10ull << 30;
    std::vector<BuiltIn> built_in = {};
};

/// A folder of images. Safe from any thread; one process at a time (a lock file keeps others out).
///
/// Durability: when put() has returned, the image survives a crash of the program and of the
/// machine; when it has not, the image is there whole or not at all, never in part. The same holds
/// for remove() and for eviction. Files are written under a temporary name, synced, renamed, and
/// their folders synced; what a crash leaves behind under a temporary name is deleted at the next
/// start. An image's facts are in a small file beside it, which is not precious: where it is missing
/// or unreadable it is made anew from the image, and where its image is missing it is deleted at
/// the next start.
///
/// Budget: images are evicted to make room for others, those first that have not been used for the
/// longest time. Use is put(), get(), info() and find(), not list(). An image is never evicted while
/// somebody holds bytes that get() has returned, nor while it is being put. Whatever is put at the
/// same time, the stored images never have more than `max_bytes` together.
///
/// Times: the image file's time is when it was stored, that of the file of facts is when it was used
/// last: written at most once a minute for each image and not synced, for losing it only makes the
/// next evictions a little unjust. Everything else is found in the folder at start.
///
/// Built-in images lie under the stored ones: get() and info() know them too. They are never listed,
/// evicted or counted, and put() of their bytes stores a copy as of any others.
///
/// Layout: images/ab/cd/<id>, <id>.info beside it, incoming/ for temporary names, lock. Other files
/// are left alone.
class ImageStore {
public:
    /// Evicts images until the stored ones are within the budget.
    ///
    /// @param folder  made if it is not there
    /// @throws std::runtime_error with a sentence for the operator: in use, not writable
    explicit ImageStore(std::filesystem::path folder, ImageStoreSettings settings = {});
    ImageStore(const ImageStore&) = delete;
    ImageStore& operator=(const ImageStore&) = delete;

    struct Put {
        std::string id;
        bool created = false;  ///< false: it was there before
        StoredImage image;
    };

    /// Stores an image that has been decoded to `info`. Putting the same bytes at the same time is
    /// fine: one caller creates it, the others wait until it is durable.
    /// @throws Error storage_full (nothing is evicted where that would not help), storage_failed
    Put put(std::string_view bytes, const ImageInfo& info);

    /// The bytes, mapped: they stay readable when the image is removed meanwhile.
    /// @throws Error not_found (also for what is no id), storage_failed
    [[nodiscard]] SharedBytes get(const std::string& id) const;

    /// @throws Error not_found, storage_failed
    [[nodiscard]] StoredImage info(const std::string& id) const;

    /// The same of an image that is stored, not only built in; nothing where it is not.
    /// @throws Error storage_failed
    [[nodiscard]] std::optional<StoredImage> find(const std::string& id) const;

    [[nodiscard]] bool contains(const std::string& id) const;  ///< whether it is stored

    /// @throws Error not_found, conflict (it is only built in), storage_failed
    void remove(const std::string& id);

    struct Page {
        std::vector<StoredImage> images;
        std::optional<ImagePlace> next;  ///< the `after` of the page that follows, if there is one
    };

    /// Up to `limit` stored images, newest first, of those older than `after`. Whatever is put or
    /// removed between two pages, an image that is there all the time is on exactly one of them.
    /// @throws Error storage_failed
    [[nodiscard]] Page list(std::size_t limit, const std::optional<ImagePlace>& after = {}) const;

    /// Where a stored image stands in that order; nothing where it is not stored.
    [[nodiscard]] std::optional<ImagePlace> place(const std::string& id) const;

    [[nodiscard]] std::uint64_t stored_bytes() const;
    [[nodiscard]] std::size_t stored_images() const;
    [[nodiscard]] std::uint64_t evicted_images() const;  ///< since the start, those at start included

    /// The id that bytes have or would have.
    [[nodiscard]] static std::string id_of(std::string_view bytes);

    /// Whether it has the form of one: 64 lower-case hex digits.
    [[nodiscard]] static bool is_id(std::string_view text);

private:
    struct Files {
        std::filesystem::path folder;
        std::filesystem::path image;
        std::filesystem::path facts;
    };
    struct BuiltInImage {
        std::string_view bytes;
        std::optional<ImageInfo> info;  // once somebody has asked for it
    };

    [[nodiscard]] Files files_of(const std::string& id) const;
    void read_folder();
    void make_folders(const Files& files) const;
    void write_files(const Files& files, std::string_view bytes, const ImageInfo& info,
                     FileTime time) const;
    [[nodiscard]] std::optional<StoredImage> describe(const std::string& id) const;
    [[nodiscard]] std::optional<ImageInfo> read_facts(const std::string& id) const;
    [[nodiscard]] StoredImage describe_built_in(const std::string& id) const;

    // With mutex_ locked:
    ImageIndex::Entry* use(const std::string& id) const;
    [[nodiscard]] std::optional<SharedBytes> map_stored(const std::string& id) const;
    [[nodiscard]] std::vector<std::string> make_room(std::uint64_t size_bytes);
    void unlink_stored(const std::string& id) const;

    void sync_folders_of(const std::vector<std::string>& ids) const;

    std::filesystem::path folder_;
    ImageStoreSettings settings_;
    File lock_;

    mutable std::mutex mutex_;  // of all below, and of names in the folder once they are in index_
    mutable ImageIndex index_;  // what is known of an image changes by asking for it
    mutable std::map<std::string, BuiltInImage> built_in_;
    std::set<std::string> arriving_;  // being put: not yet in index_, with room kept for them
    std::uint64_t arriving_bytes_ = 0;
    std::condition_variable arrived_;
    std::uint64_t evicted_ = 0;
};

}  // namespace relit::server
