// Memory of pictures and maps: an allocator for std::vector. What is larger than 32 MB comes from the
// system each time, page by page; it lies in large pages where there are some (Linux: transparent huge
// pages by madvise): 48 MB were there after 3 ms instead of 22.
#pragma once

#include <cstddef>
#include <vector>

namespace relit {

/// `size_bytes` at the beginning of a line of the cache.
/// @throws std::bad_alloc
[[nodiscard]] void* allocate_texels(std::size_t size_bytes);
void free_texels(void* memory) noexcept;

template <class T>
struct LargePages {
    using value_type = T;
    LargePages() = default;
    template <class Other>
    LargePages(const LargePages<Other>&) noexcept {}  // NOLINT: what allocators are asked for
    [[nodiscard]] T* allocate(std::size_t count) {
        return static_cast<T*>(allocate_texels(count * sizeof(T)));
    }
    void deallocate(T* memory, std::size_t) noexcept { free_texels(memory); }
    friend bool operator==(const LargePages&, const LargePages&) { return true; }
};

/// The numbers of an image or of what is made of one.
using Texels = std::vector<float, LargePages<float>>;

}  // namespace relit
