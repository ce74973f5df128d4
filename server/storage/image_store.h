// Uploaded images as files named by the SHA-256 of their bytes: the same bytes are stored once, and
// what an id means never changes. For the image routes and for scenes that refer to images.
#pragma once

#include <cstdint>
#include <filesystem>
#include <mutex>
#include <string>
#include <string_view>

#include "core/io/decode.h"
#include "server/shared_bytes.h"

namespace relit::server {

/// What the store knows of an image.
struct StoredImage {
    std::string id;
    ImageInfo info;
    std::uint64_t size_bytes = 0;
};

/// A folder of images. Safe from any thread; one process at a time (a lock file keeps others out).
///
/// Durability: when put() has returned, the image survives a crash of the program and of the
/// machine; when it has not, the image is there whole or not at all, never in part. The same holds
/// for remove(). Files are written under a temporary name, synced, renamed, and their folders
/// synced; what a crash leaves behind under a temporary name is deleted at the next start. An
/// image's facts are in a small file beside it, which is not precious: where it is missing or
/// unreadable it is made anew from the image.
///
/// Layout: images/ab/cd/<id>, <id>.info beside it, incoming/ for temporary names, lock.
class ImageStore {
public:
    /// @param folder  made if it is not there
    /// @param limits  for decoding an image whose facts are missing
    /// @throws std::runtime_error with a sentence for the operator: in use, not writable
    explicit ImageStore(std::filesystem::path folder, DecodeLimits limits = {});
    ~ImageStore();
    ImageStore(const ImageStore&) = delete;
    ImageStore& operator=(const ImageStore&) = delete;

    struct Put {
        std::string id;
        bool created = false;  ///< false: it was there before
    };

    /// Stores an image that has been decoded to `info`. Putting the same bytes at the same time is
    /// fine: one caller creates it, and it is durable for all of them when they return.
    /// @throws Error storage_full, storage_failed
    Put put(std::string_view bytes, const ImageInfo& info);

    /// The stored bytes, mapped: they stay readable when the image is removed meanwhile.
    /// @throws Error not_found (also for what is no id), storage_failed
    [[nodiscard]] SharedBytes get(const std::string& id) const;

    /// @throws Error not_found, storage_failed
    [[nodiscard]] StoredImage info(const std::string& id) const;

    [[nodiscard]] bool contains(const std::string& id) const;

    /// @throws Error not_found, storage_failed
    void remove(const std::string& id);

    /// The id that bytes have or would have.
    [[nodiscard]] static std::string id_of(std::string_view bytes);

private:
    struct Place {
        std::filesystem::path folder;
        std::filesystem::path file;
        std::filesystem::path info;
    };
    [[nodiscard]] Place place_of(const std::string& id) const;
    [[nodiscard]] Place existing_place(const std::string& id) const;
    void make_folders(const Place& place) const;

    std::filesystem::path folder_;
    DecodeLimits limits_;
    int lock_ = -1;
    mutable std::mutex changing_;  // names only: writing and syncing go on side by side
};

}  // namespace relit::server
