#include "core/image/large_pages.h"

#include <cstdint>
#include <cstdlib>
#include <limits>
#include <new>

#if defined(__linux__)
#include <sys/mman.h>
#endif

namespace relit {
namespace {

constexpr std::size_t line = 64;
constexpr std::size_t large_page = std::size_t(2) << 20;
// What is smaller glibc keeps when it is freed, and has at hand without the system: a picture of each
// frame lies where the last one did.
constexpr std::size_t kept_when_freed = std::size_t(32) << 20;

void* allocate(std::size_t size_bytes) {
    for (;;) {
        if (void* const memory = std::malloc(size_bytes)) return memory;
        const std::new_handler handler = std::get_new_handler();
        if (!handler) throw std::bad_alloc();
        handler();  // as operator new does: it finds some, or throws
    }
}

}  // namespace

// Aligned by hand: what aligned_alloc() gives does not fit where one of the same size was freed (glibc up
// to 2.37), so that two hundred renders of 512 x 512, one after the other, took 450 MB instead of 60.
void* allocate_texels(std::size_t size_bytes) {
    const std::size_t alignment = size_bytes <= kept_when_freed ? line : large_page;
    if (size_bytes > std::numeric_limits<std::size_t>::max() - alignment) throw std::bad_alloc();
    void* const taken = allocate(size_bytes + alignment);
    const auto after = reinterpret_cast<std::uintptr_t>(taken) + alignment;
    void** const memory = reinterpret_cast<void**>(after - after % alignment);
    memory[-1] = taken;  // malloc() aligns so that there is room for it
#if defined(__linux__)
    // Advice: where it cannot be had, pages are small.
    if (alignment == large_page) madvise(memory, size_bytes, MADV_HUGEPAGE);
#endif
    return memory;
}

void free_texels(void* memory) noexcept {
    if (memory) std::free(static_cast<void**>(memory)[-1]);
}

}  // namespace relit
