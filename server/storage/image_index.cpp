#include "server/storage/image_index.h"

#include <cassert>

namespace relit::server {

ImageIndex::Entry& ImageIndex::add(const std::string& id, Entry entry) {
    const auto [place, is_new] = images_.try_emplace(id, Image{std::move(entry), {}});
    assert(is_new);
    auto& [key, image] = *place;
    image.use = by_use_.insert(by_use_.end(), key);
    by_age_.emplace(image.entry.created, key);
    size_bytes_ += image.entry.size_bytes;
    return image.entry;
}

void ImageIndex::remove(const std::string& id) {
    const auto found = images_.find(id);
    assert(found != images_.end());
    const auto& [key, image] = *found;
    by_use_.erase(image.use);
    by_age_.erase({image.entry.created, key});
    size_bytes_ -= image.entry.size_bytes;
    images_.erase(found);
}

ImageIndex::Entry* ImageIndex::find(const std::string& id) {
    const auto found = images_.find(id);
    return found == images_.end() ? nullptr : &found->second.entry;
}

const ImageIndex::Entry* ImageIndex::find(const std::string& id) const {
    const auto found = images_.find(id);
    return found == images_.end() ? nullptr : &found->second.entry;
}

void ImageIndex::use(const std::string& id) {
    const auto found = images_.find(id);
    assert(found != images_.end());
    by_use_.splice(by_use_.end(), by_use_, found->second.use);
}

std::optional<std::vector<std::string>> ImageIndex::least_recent(std::uint64_t size_bytes) const {
    std::vector<std::string> ids;
    std::uint64_t found_bytes = 0;
    for (auto id = by_use_.begin(); found_bytes < size_bytes; ++id) {
        if (id == by_use_.end()) return std::nullopt;
        const Entry& entry = images_.find(*id)->second.entry;
        if (!entry.mapped.expired()) continue;
        ids.emplace_back(*id);
        found_bytes += entry.size_bytes;
    }
    return ids;
}

std::vector<ImagePlace> ImageIndex::newest(std::size_t limit,
                                           const std::optional<ImagePlace>& after) const {
    const auto end = after ? by_age_.lower_bound({after->created, after->id}) : by_age_.end();
    std::vector<ImagePlace> places;
    for (auto place = std::make_reverse_iterator(end);
         place != by_age_.rend() && places.size() < limit; ++place)
        places.push_back({place->first, std::string(place->second)});
    return places;
}

}  // namespace relit::server
