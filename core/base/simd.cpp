#include "core/base/simd.h"

namespace relit {
namespace {

bool is_available(Simd simd) {
#if defined(__x86_64__)
    switch (simd) {
        case Simd::portable:
            return true;
        case Simd::avx2:
            return __builtin_cpu_supports("avx2");
        case Simd::avx512:
            return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
                   __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl");
    }
#endif
    return simd == Simd::portable;
}

}  // namespace

std::vector<Simd> available_simd() {
    std::vector<Simd> available;
    for (const Simd simd : {Simd::portable, Simd::avx2, Simd::avx512})
        if (is_available(simd)) available.push_back(simd);
    return available;
}

std::string_view name_of(Simd simd) {
    switch (simd) {
        case Simd::portable:
            return "portable";
        case Simd::avx2:
            return "avx2";
        case Simd::avx512:
            return "avx512";
    }
    return {};
}

}  // namespace relit
