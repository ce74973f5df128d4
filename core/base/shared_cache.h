// Things that are made from images (decoded maps, what rays see of them), kept for the renders that
// come after and shared by those that come at the same moment: dragging a light over a relief
// decodes and prepares it once.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <string>
#include <unordered_map>

namespace relit {

/// A bounded cache of immutable things by key. Safe from any thread.
///
/// A thing is made once, however many ask for it at the same time: the first one makes it and the
/// others wait. Where making fails, the one that made it hears of it, and one of those who wait
/// tries for itself. What was not asked for the longest is dropped when the things together exceed
/// the budget; who has one keeps it.
class SharedCache {
public:
    explicit SharedCache(std::uint64_t max_bytes) : max_bytes_(max_bytes) {}
    SharedCache(const SharedCache&) = delete;
    SharedCache& operator=(const SharedCache&) = delete;
    ~SharedCache() = default;

    template <class T>
    struct Made {
        std::shared_ptr<const T> thing;
        std::uint64_t bytes = 0;  ///< what it takes of the budget
    };

    /// The thing of that key.
    /// @param key   names everything that the thing is made of, its type included
    /// @param make  makes it; returns Made<T>. Must not ask this cache for the same key
    /// @throws what `make` throws
    template <class T, class Make>
    [[nodiscard]] std::shared_ptr<const T> get(const std::string& key, const Make& make) {
        const auto thing = get_any(key, [&]() -> Made<void> {
            Made<T> made = make();
            return {std::move(made.thing), made.bytes};
        });
        return std::static_pointer_cast<const T>(thing);
    }

    // For the metrics.
    [[nodiscard]] std::uint64_t bytes() const;   ///< of the things that are kept
    [[nodiscard]] std::uint64_t hits() const;    ///< askings for what was there or being made
    [[nodiscard]] std::uint64_t misses() const;  ///< makings

private:
    struct Entry {
        std::shared_ptr<const void> thing;  // none: it is being made
        std::uint64_t bytes = 0;
        std::list<std::string>::iterator age{};
    };

    std::shared_ptr<const void> get_any(const std::string& key,
                                        const std::function<Made<void>()>& make);
    std::shared_ptr<const void> make_here(std::unique_lock<std::mutex>& lock,
                                          const std::string& key,
                                          const std::function<Made<void>()>& make);
    void keep(const std::string& key, const Made<void>& made);

    const std::uint64_t max_bytes_;
    mutable std::mutex mutex_;
    std::condition_variable made_;
    std::unordered_map<std::string, Entry> entries_;
    std::list<std::string> ages_;  // keys of what is kept, longest unasked for first
    std::uint64_t bytes_ = 0;
    std::uint64_t hits_ = 0;
    std::uint64_t misses_ = 0;
};

}  // namespace relit
