#include "core/image/large_pages.h"

#include <cstdlib>
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

}  // namespace

void* allocate_texels(std::size_t size_bytes) {
    const std::size_t alignment = size_bytes <= kept_when_freed ? line : large_page;
    const std::size_t size = (size_bytes + alignment - 1) / alignment * alignment;
    void* memory = nullptr;
    while (size >= size_bytes && !(memory = std::aligned_alloc(alignment, size))) {
        const std::new_handler handler = std::get_new_handler();
        if (!handler) break;
        handler();  // as operator new does: it finds some, or throws
    }
    if (!memory) throw std::bad_alloc();
#if defined(__linux__)
    // Advice: where it cannot be had, pages are small.
    if (alignment == large_page) madvise(memory, size, MADV_HUGEPAGE);
#endif
    return memory;
}

void free_texels(void* memory) noexcept { std::free(memory); }

}  // namespace relit
