// A register of short integers at a time in the compiler's own vectors, and what the band march
// needs of ints besides.
#pragma once

#ifdef __SSE2__
#include <immintrin.h>
#endif

#include "core/base/wide/wide_vector.h"

namespace relit::kernels {
namespace {

constexpr int short_lanes = register_size / 2;
using ShortVector = short __attribute__((vector_size(register_size)));
using UnsignedShortVector = unsigned short __attribute__((vector_size(register_size)));
using HalfOfShorts = short __attribute__((vector_size(register_size / 2)));
using HalfOfUnsignedShorts = unsigned short __attribute__((vector_size(register_size / 2)));
// As UnalignedFloats (wide_vector.h).
using UnalignedShorts __attribute__((aligned(2), may_alias)) = ShortVector;
using UnalignedUnsignedShorts __attribute__((aligned(2), may_alias)) = UnsignedShortVector;
using UnalignedHalfOfShorts __attribute__((aligned(2), may_alias)) = HalfOfShorts;
using UnalignedHalfOfUnsignedShorts __attribute__((aligned(2), may_alias)) = HalfOfUnsignedShorts;
using UnsignedVector = unsigned __attribute__((vector_size(register_size)));

struct Shorts {
    ShortVector v;
};
struct ShortMask {
    ShortVector v;
};
RELIT_INLINE Shorts broadcast_short(short a) { return {ShortVector{} + a}; }
RELIT_INLINE Shorts load(const short* p) { return {*(const UnalignedShorts*)p}; }
RELIT_INLINE void store(short* p, Shorts a) { *(UnalignedShorts*)p = a.v; }
// @pre the results fit
RELIT_INLINE Shorts operator+(Shorts a, Shorts b) { return {a.v + b.v}; }
RELIT_INLINE Shorts operator-(Shorts a, Shorts b) { return {a.v - b.v}; }
RELIT_INLINE ShortMask operator>(Shorts a, Shorts b) { return {a.v > b.v}; }
RELIT_INLINE ShortMask operator&(ShortMask a, ShortMask b) { return {a.v & b.v}; }
// a + b where the mask is set, else a; modulo 65536.
RELIT_INLINE Shorts add_where(ShortMask m, Shorts a, Shorts b) {
    using Unsigned = UnsignedShortVector;
    return {(ShortVector)((Unsigned)a.v + (Unsigned)(m.v & b.v))};
}
// A quarter of each number that is odd, 0 for the others.
RELIT_INLINE Shorts load_marked_quarters(const unsigned short* p) {
    const UnsignedShortVector a = *(const UnalignedUnsignedShorts*)p;
    return {(ShortVector)((a >> 2) & -(a & 1))};
}
// The lower halves of ints.
RELIT_INLINE void store_shorts(short* p, Ints a) {
    *(UnalignedHalfOfShorts*)p = __builtin_convertvector(a.v, HalfOfShorts);
}
RELIT_INLINE Ints load_unsigned(const short* p) {
    return {__builtin_convertvector(*(const UnalignedHalfOfUnsignedShorts*)p, IntVector)};
}

// Sums of two neighbouring products each.
RELIT_INLINE Ints sums_of_products(Shorts a, Shorts b) {
#if defined(__AVX2__)
    return {(IntVector)_mm256_madd_epi16((__m256i)a.v, (__m256i)b.v)};
#elif defined(__SSE2__)
    return {(IntVector)_mm_madd_epi16((__m128i)a.v, (__m128i)b.v)};
#else
    Ints out;
    for (int k = 0; k < lanes; ++k)
        out.v[k] = int(a.v[2 * k]) * b.v[2 * k] + int(a.v[2 * k + 1]) * b.v[2 * k + 1];
    return out;
#endif
}
// Two numbers, again and again.
RELIT_INLINE Shorts broadcast_pair(const short* p) {
    int pair;
    __builtin_memcpy(&pair, p, 4);
    return {(ShortVector)(IntVector{} + pair)};
}

RELIT_INLINE Ints low_half(Ints a) { return {a.v & 0xffff}; }
RELIT_INLINE Ints high_half(Ints a) { return {(IntVector)((UnsignedVector)a.v >> 16)}; }
// Numbers at and after each place, the first in the lower half.
RELIT_INLINE Ints gather_pairs(const unsigned short* from, Ints at) {
#ifdef __AVX2__
    return {(IntVector)_mm256_i32gather_epi32((const int*)from, (__m256i)at.v, 2)};
#else
    int pairs[lanes];
    for (int k = 0; k < lanes; ++k) __builtin_memcpy(pairs + k, from + at.v[k], 4);
    Ints out;
    for (int k = 0; k < lanes; ++k) out.v[k] = pairs[k];
    return out;
#endif
}
// @pre -126 <= a <= 127
RELIT_INLINE Floats power_of_two(Ints a) { return {(FloatVector)((a.v + 127) << 23)}; }

}  // namespace
}  // namespace relit::kernels
