// How many connections an address has: one client may not take those of all others.
#pragma once

#include <memory>
#include <mutex>
#include <string>
#include <unordered_map>

namespace relit::server {

class AddressSlots {
public:
    /// @param max  of each address; 0: any number, and none are counted
    explicit AddressSlots(int max) : max_(max) {}
    AddressSlots(const AddressSlots&) = delete;
    AddressSlots& operator=(const AddressSlots&) = delete;

    /// One connection of an address, until the last copy is gone. Must not outlive its AddressSlots.
    using Slot = std::shared_ptr<void>;

    /// @return null where the address has as many as it may have. Safe from any thread.
    [[nodiscard]] Slot take(const std::string& address) {
        if (max_ == 0) return {this, [](void*) {}};
        const std::scoped_lock lock(mutex_);
        int& count = open_[address];
        if (count >= max_) return nullptr;
        ++count;
        return {this, [this, address](void*) { give_back(address); }};
    }

private:
    void give_back(const std::string& address) {
        const std::scoped_lock lock(mutex_);
        const auto found = open_.find(address);
        if (--found->second == 0) open_.erase(found);
    }

    const int max_;
    std::mutex mutex_;
    std::unordered_map<std::string, int> open_;
};

}  // namespace relit::server
