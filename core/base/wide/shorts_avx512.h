// 32 short integers at a time in AVX-512, and what the band march needs of ints besides. See
// shorts_vector.h for what each operation is to do.
#pragma once

#include "core/base/wide/wide_avx512.h"

namespace relit::kernels {
namespace {

constexpr int short_lanes = 32;
struct Shorts {
    __m512i v;
};
struct ShortMask {
    __mmask32 bits;
};
RELIT_INLINE Shorts broadcast_short(short a) { return {_mm512_set1_epi16(a)}; }
RELIT_INLINE Shorts load(const short* p) { return {_mm512_loadu_si512(p)}; }
RELIT_INLINE void store(short* p, Shorts a) { _mm512_storeu_si512(p, a.v); }
RELIT_INLINE Shorts operator+(Shorts a, Shorts b) { return {_mm512_add_epi16(a.v, b.v)}; }
RELIT_INLINE Shorts operator-(Shorts a, Shorts b) { return {_mm512_sub_epi16(a.v, b.v)}; }
RELIT_INLINE ShortMask operator>(Shorts a, Shorts b) { return {_mm512_cmpgt_epi16_mask(a.v, b.v)}; }
RELIT_INLINE ShortMask operator&(ShortMask a, ShortMask b) { return {a.bits & b.bits}; }
RELIT_INLINE Shorts add_where(ShortMask m, Shorts a, Shorts b) {
    return {_mm512_mask_add_epi16(a.v, m.bits, a.v, b.v)};
}
RELIT_INLINE Shorts load_marked_quarters(const unsigned short* p) {
    const __m512i a = _mm512_loadu_si512(p);
    return {_mm512_maskz_srli_epi16(_mm512_test_epi16_mask(a, _mm512_set1_epi16(1)), a, 2)};
}
RELIT_INLINE void store_shorts(short* p, Ints a) {
    _mm256_storeu_si256((__m256i*)p, _mm512_cvtepi32_epi16(a.v));
}
RELIT_INLINE Ints load_unsigned(const short* p) {
    return {_mm512_cvtepu16_epi32(_mm256_loadu_si256((const __m256i*)p))};
}

RELIT_INLINE Ints sums_of_products(Shorts a, Shorts b) { return {_mm512_madd_epi16(a.v, b.v)}; }
RELIT_INLINE Shorts broadcast_pair(const short* p) {
    int pair;
    __builtin_memcpy(&pair, p, 4);
    return {_mm512_set1_epi32(pair)};
}

RELIT_INLINE Ints low_half(Ints a) { return {_mm512_and_si512(a.v, _mm512_set1_epi32(0xffff))}; }
RELIT_INLINE Ints high_half(Ints a) { return {_mm512_srli_epi32(a.v, 16)}; }
RELIT_INLINE Ints gather_pairs(const unsigned short* from, Ints at) {
    return {_mm512_i32gather_epi32(at.v, from, 2)};
}
RELIT_INLINE Floats power_of_two(Ints a) {
    return {
        _mm512_castsi512_ps(_mm512_slli_epi32(_mm512_add_epi32(a.v, _mm512_set1_epi32(127)), 23))};
}

}  // namespace
}  // namespace relit::kernels
