#include "core/image/large_pages.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <cstring>
#include <fstream>
#include <limits>
#include <memory>
#include <new>
#include <vector>

namespace relit {
namespace {

double memory_mib() {
    std::ifstream file("/proc/self/statm");
    long pages = 0, resident = 0;
    file >> pages >> resident;
    return double(resident) * 4096 / (1 << 20);
}

TEST(LargePages, BeginAtALineOfTheCacheAndAreAllThere) {
    for (const std::size_t size :
         {std::size_t(0), std::size_t(1), std::size_t(63), std::size_t(64), std::size_t(1000),
          std::size_t(32) << 20, (std::size_t(32) << 20) + 1}) {
        void* const memory = allocate_texels(size);
        EXPECT_EQ(reinterpret_cast<std::uintptr_t>(memory) % 64, 0u) << size;
        std::memset(memory, 1, size);
        free_texels(memory);
    }
    free_texels(nullptr);
}

TEST(LargePages, ThatNoMachineHasAreRefused) {
    for (const std::size_t off : {1, 64, 4096})
        EXPECT_THROW((void)allocate_texels(std::numeric_limits<std::size_t>::max() - off),
                     std::bad_alloc);
}

// Pictures come and go, and small things that are made meanwhile stay for longer.
TEST(LargePages, ThatWereFreedAreUsedAgain) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    GTEST_SKIP() << "their memory is not glibc's";
#endif
    const double before = memory_mib();
    std::vector<std::unique_ptr<char[]>> small;
    const auto make_small = [&] {
        for (const std::size_t size : {24, 40, 56, 72, 88})
            small.push_back(std::make_unique<char[]>(size));
    };
    for (int frame = 0; frame < 300; ++frame) {
        const Texels heights(std::size_t(512) * 512);
        make_small();
        const Texels colours(std::size_t(512) * 512 * 3);
        make_small();
    }
    EXPECT_LT(memory_mib(), before + 30) << "MiB; a frame has 4";
}

}  // namespace
}  // namespace relit
