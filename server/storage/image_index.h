// What the store knows of its images without looking at a file: how large, how old, how long
// unused. For ImageStore, which locks it and keeps it true to the folder.
#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/io/decode.h"
#include "server/storage/files.h"

namespace relit::server {

/// A place in the images' order of age; of two of the same moment the id decides. It stays a place
/// when its image is gone.
struct ImagePlace {
    FileTime created;
    std::string id;
};

/// Images by id, by age and by use. Not safe from several threads.
class ImageIndex {
public:
    struct Entry {
        std::uint64_t size_bytes = 0;
        FileTime created;
        FileTime use_written;              ///< the time of use that the folder knows
        std::optional<ImageInfo> info;     ///< once somebody has asked for it
        std::weak_ptr<const void> mapped;  ///< its bytes, while somebody holds them
    };

    /// Adds an image that is not there, as the one used last.
    Entry& add(const std::string& id, Entry entry);
    void remove(const std::string& id);

    /// Null where there is none; stays where it is until it is removed.
    [[nodiscard]] Entry* find(const std::string& id);
    [[nodiscard]] const Entry* find(const std::string& id) const;

    /// Makes an image that is there the one used last.
    void use(const std::string& id);

    /// The least recently used images that nobody holds, as many as have `size_bytes` together;
    /// nothing where all of them have less.
    [[nodiscard]] std::optional<std::vector<std::string>> least_recent(
        std::uint64_t size_bytes) const;

    /// At most `limit` images, newest first, of those older than `after` (or of all).
    [[nodiscard]] std::vector<ImagePlace> newest(std::size_t limit,
                                                 const std::optional<ImagePlace>& after) const;

    [[nodiscard]] std::uint64_t size_bytes() const { return size_bytes_; }  ///< of all together
    [[nodiscard]] std::size_t count() const { return images_.size(); }

private:
    struct Image {
        Entry entry;
        std::list<std::string_view>::iterator use;
    };
    std::map<std::string, Image, std::less<>> images_;
    std::list<std::string_view> by_use_;                      // last: used last
    std::set<std::pair<FileTime, std::string_view>> by_age_;  // views of the keys of images_
    std::uint64_t size_bytes_ = 0;
};

}  // namespace relit::server
