// One target as a program of libFuzzer's; RELIT_FUZZ_TARGET is its name.
#include <cstddef>
#include <cstdint>

#include "tests/fuzz/targets.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    relit::fuzz::RELIT_FUZZ_TARGET({reinterpret_cast<const char*>(data), size});
    return 0;
}
