#include "core/base/shared_cache.h"

namespace relit {

std::shared_ptr<const void> SharedCache::get_any(const std::string& key,
                                                 const std::function<Made<void>()>& make) {
    std::unique_lock lock(mutex_);
    for (;;) {
        const auto found = entries_.find(key);
        if (found == entries_.end()) return make_here(lock, key, make);
        if (found->second.thing) {
            ++hits_;
            ages_.splice(ages_.end(), ages_, found->second.age);
            return found->second.thing;
        }
        made_.wait(lock);
    }
}

std::shared_ptr<const void> SharedCache::make_here(std::unique_lock<std::mutex>& lock,
                                                   const std::string& key,
                                                   const std::function<Made<void>()>& make) {
    ++misses_;
    entries_.emplace(key, Entry{});  // whoever asks from here on waits
    lock.unlock();
    try {
        const Made<void> made = make();
        lock.lock();
        keep(key, made);
        made_.notify_all();
        return made.thing;
    } catch (...) {
        if (!lock.owns_lock()) lock.lock();
        entries_.erase(key);
        made_.notify_all();
        throw;
    }
}

// What is larger than the whole budget pushes out nothing else. It is not kept: those who wait make
// it again, one after the other, as they would without a cache.
void SharedCache::keep(const std::string& key, const Made<void>& made) {
    if (made.bytes > max_bytes_) {
        entries_.erase(key);
        return;
    }
    Entry& entry = entries_.at(key);
    entry = {made.thing, made.bytes, ages_.insert(ages_.end(), key)};
    bytes_ += made.bytes;
    while (bytes_ > max_bytes_) {
        const auto oldest = entries_.find(ages_.front());
        bytes_ -= oldest->second.bytes;
        ages_.pop_front();
        entries_.erase(oldest);
    }
}

std::uint64_t SharedCache::bytes() const {
    const std::scoped_lock lock(mutex_);
    return bytes_;
}

std::uint64_t SharedCache::hits() const {
    const std::scoped_lock lock(mutex_);
    return hits_;
}

std::uint64_t SharedCache::misses() const {
    const std::scoped_lock lock(mutex_);
    return misses_;
}

}  // namespace relit
