// 16 floats at a time in AVX-512. See wide_vector.h for what each operation is to do.
#pragma once

#include <immintrin.h>

#define RELIT_INLINE inline __attribute__((always_inline))
#define RELIT_INLINE_LAMBDA __attribute__((always_inline))

namespace relit::kernels {
namespace {

constexpr int register_size = 64;
constexpr int lanes = 16;

struct Mask {
    __mmask16 bits;
};
RELIT_INLINE Mask operator&(Mask a, Mask b) { return {__mmask16(a.bits & b.bits)}; }
RELIT_INLINE Mask operator|(Mask a, Mask b) { return {__mmask16(a.bits | b.bits)}; }
RELIT_INLINE Mask operator^(Mask a, Mask b) { return {__mmask16(a.bits ^ b.bits)}; }
RELIT_INLINE Mask operator~(Mask a) { return {__mmask16(~a.bits)}; }
constexpr Mask all_lanes = {0xffff};
RELIT_INLINE bool any(Mask a) { return a.bits != 0; }
RELIT_INLINE bool all(Mask a) { return a.bits == 0xffff; }
RELIT_INLINE unsigned bits(Mask a) { return a.bits; }

struct Ints {
    __m512i v;
};
RELIT_INLINE Ints broadcast(int a) { return {_mm512_set1_epi32(a)}; }
RELIT_INLINE Ints operator+(Ints a, Ints b) { return {_mm512_add_epi32(a.v, b.v)}; }
RELIT_INLINE Ints operator-(Ints a, Ints b) { return {_mm512_sub_epi32(a.v, b.v)}; }
RELIT_INLINE Ints operator*(Ints a, Ints b) { return {_mm512_mullo_epi32(a.v, b.v)}; }
RELIT_INLINE Ints operator&(Ints a, Ints b) { return {_mm512_and_si512(a.v, b.v)}; }
RELIT_INLINE Ints operator|(Ints a, Ints b) { return {_mm512_or_si512(a.v, b.v)}; }
RELIT_INLINE Ints load(const int* p) { return {_mm512_loadu_si512(p)}; }
RELIT_INLINE void store(int* p, Ints a) { _mm512_storeu_si512(p, a.v); }
RELIT_INLINE Ints clamped(Ints a, int lo, int hi) {
    return {_mm512_min_epi32(_mm512_max_epi32(a.v, _mm512_set1_epi32(lo)), _mm512_set1_epi32(hi))};
}
RELIT_INLINE Ints min(Ints a, Ints b) { return {_mm512_min_epi32(a.v, b.v)}; }
template <int bits>
RELIT_INLINE Ints shifted_left(Ints a) {
    return {_mm512_slli_epi32(a.v, bits)};
}
RELIT_INLINE Ints shifted_right(Ints a, int bits) {
    return {_mm512_sra_epi32(a.v, _mm_cvtsi32_si128(bits))};
}

struct Floats {
    __m512 v;
};
RELIT_INLINE Ints bits_of(Floats a) { return {_mm512_castps_si512(a.v)}; }
RELIT_INLINE Floats floats_of_bits(Ints a) { return {_mm512_castsi512_ps(a.v)}; }
RELIT_INLINE Floats broadcast(float a) { return {_mm512_set1_ps(a)}; }
RELIT_INLINE Floats load(const float* p) { return {_mm512_loadu_ps(p)}; }
RELIT_INLINE void store(float* p, Floats a) { _mm512_storeu_ps(p, a.v); }
RELIT_INLINE Floats operator+(Floats a, Floats b) { return {_mm512_add_ps(a.v, b.v)}; }
RELIT_INLINE Floats operator-(Floats a, Floats b) { return {_mm512_sub_ps(a.v, b.v)}; }
RELIT_INLINE Floats operator*(Floats a, Floats b) { return {_mm512_mul_ps(a.v, b.v)}; }
RELIT_INLINE Floats operator/(Floats a, Floats b) { return {_mm512_div_ps(a.v, b.v)}; }
RELIT_INLINE Mask operator<(Floats a, Floats b) {
    return {_mm512_cmp_ps_mask(a.v, b.v, _CMP_LT_OQ)};
}
RELIT_INLINE Mask operator<=(Floats a, Floats b) {
    return {_mm512_cmp_ps_mask(a.v, b.v, _CMP_LE_OQ)};
}
RELIT_INLINE Mask operator==(Floats a, Floats b) {
    return {_mm512_cmp_ps_mask(a.v, b.v, _CMP_EQ_OQ)};
}
RELIT_INLINE Floats select(Mask m, Floats a, Floats b) {
    return {_mm512_mask_blend_ps(m.bits, b.v, a.v)};
}
RELIT_INLINE Floats min(Floats a, Floats b) { return {_mm512_min_ps(a.v, b.v)}; }
RELIT_INLINE Floats max(Floats a, Floats b) { return {_mm512_max_ps(a.v, b.v)}; }
RELIT_INLINE Floats magnitude(Floats a) { return {_mm512_abs_ps(a.v)}; }
RELIT_INLINE Floats square_root(Floats a) { return {_mm512_sqrt_ps(a.v)}; }
RELIT_INLINE Floats floor(Floats a) {
    return {_mm512_roundscale_ps(a.v, _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC)};
}
RELIT_INLINE Floats ceil(Floats a) { return broadcast(0.0f) - floor(broadcast(0.0f) - a); }
RELIT_INLINE Floats with_sign_of(Floats a, Floats sign) {
    return {_mm512_castsi512_ps(_mm512_ternarylogic_epi32(_mm512_set1_epi32(int(0x80000000)),
                                                          _mm512_castps_si512(sign.v),
                                                          _mm512_castps_si512(a.v), 0xca))};
}
RELIT_INLINE Ints to_ints(Floats a) { return {_mm512_cvttps_epi32(a.v)}; }
RELIT_INLINE Floats to_floats(Ints a) { return {_mm512_cvtepi32_ps(a.v)}; }
using Doubles = double __attribute__((vector_size(64)));
RELIT_INLINE Floats to_floats(const Doubles (&halves)[2]) {
    const __m256 left = _mm512_cvtpd_ps((__m512d)halves[0]);
    const __m256 right = _mm512_cvtpd_ps((__m512d)halves[1]);
    return {_mm512_insertf32x8(_mm512_castps256_ps512(left), right, 1)};
}
RELIT_INLINE Doubles to_doubles(Floats a, int half) {
    const __m256 part = half == 0 ? _mm512_castps512_ps256(a.v) : _mm512_extractf32x8_ps(a.v, 1);
    return (Doubles)_mm512_cvtps_pd(part);
}
RELIT_INLINE void store(double* p, Doubles a) { _mm512_storeu_pd(p, (__m512d)a); }
RELIT_INLINE Doubles gather(const double* from, const int* index) {
    const __m256i i = _mm256_loadu_si256((const __m256i*)index);
    const __m256i thrice = _mm256_add_epi32(i, _mm256_add_epi32(i, i));
    return (Doubles)_mm512_i32gather_pd(thrice, from, 8);
}
RELIT_INLINE Doubles square_root(Doubles a) { return (Doubles)_mm512_sqrt_pd((__m512d)a); }
RELIT_INLINE Doubles floor(Doubles a) {
    return (Doubles)_mm512_roundscale_pd((__m512d)a, _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC);
}
RELIT_INLINE Mask lowest_bit(Floats a) {
    return {_mm512_test_epi32_mask(_mm512_castps_si512(a.v), _mm512_set1_epi32(1))};
}
RELIT_INLINE float lowest(Floats a) { return _mm512_reduce_min_ps(a.v); }
RELIT_INLINE float highest(Floats a) { return _mm512_reduce_max_ps(a.v); }

RELIT_INLINE int* append_lanes(int* to, unsigned which, int first) {
    const __m512i numbers = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
    const __m512i all = _mm512_add_epi32(numbers, _mm512_set1_epi32(first));
    _mm512_storeu_si512(to, _mm512_maskz_compress_epi32(__mmask16(which), all));
    return to + __builtin_popcount(which);
}
RELIT_INLINE Floats pick(Floats a, Floats b, Floats c, Floats d, Ints at) {
    const __m512 low = _mm512_permutex2var_ps(a.v, at.v, b.v);
    const __m512 high = _mm512_permutex2var_ps(c.v, at.v, d.v);
    return {_mm512_mask_blend_ps(_mm512_test_epi32_mask(at.v, _mm512_set1_epi32(2 * lanes)), low,
                                 high)};
}
RELIT_INLINE void load_triples(const float* from, const int* at, Floats (&out)[3]) {
    // Blocks of four lanes, transposed each.
    const auto every_fourth = [&](int k) RELIT_INLINE_LAMBDA {
        __m512 a = _mm512_castps128_ps512(_mm_loadu_ps(from + at[k]));
        a = _mm512_insertf32x4(a, _mm_loadu_ps(from + at[k + 4]), 1);
        a = _mm512_insertf32x4(a, _mm_loadu_ps(from + at[k + 8]), 2);
        return _mm512_insertf32x4(a, _mm_loadu_ps(from + at[k + 12]), 3);
    };
    const __m512 a = every_fourth(0), b = every_fourth(1), c = every_fourth(2);
    const __m512 d = every_fourth(3);
    const __m512d ab = _mm512_castps_pd(_mm512_unpacklo_ps(a, b));
    const __m512d cd = _mm512_castps_pd(_mm512_unpacklo_ps(c, d));
    const __m512d ab_high = _mm512_castps_pd(_mm512_unpackhi_ps(a, b));
    const __m512d cd_high = _mm512_castps_pd(_mm512_unpackhi_ps(c, d));
    out[0].v = _mm512_castpd_ps(_mm512_unpacklo_pd(ab, cd));
    out[1].v = _mm512_castpd_ps(_mm512_unpackhi_pd(ab, cd));
    out[2].v = _mm512_castpd_ps(_mm512_unpacklo_pd(ab_high, cd_high));
}
RELIT_INLINE void store_pairs(float* to, Floats a, Floats b) {
    const __m512i low = _mm512_setr_epi32(0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23);
    const __m512i high = _mm512_add_epi32(low, _mm512_set1_epi32(lanes / 2));
    store(to, {_mm512_permutex2var_ps(a.v, low, b.v)});
    store(to + lanes, {_mm512_permutex2var_ps(a.v, high, b.v)});
}
RELIT_INLINE void load_pairs(const float* from, Floats& a, Floats& b) {
    const __m512i even =
        _mm512_setr_epi32(0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30);
    const __m512i odd = _mm512_add_epi32(even, _mm512_set1_epi32(1));
    const __m512 low = load(from).v, high = load(from + lanes).v;
    a.v = _mm512_permutex2var_ps(low, even, high);
    b.v = _mm512_permutex2var_ps(low, odd, high);
}

RELIT_INLINE Floats gather(const float* from, Ints at) {
    return {_mm512_i32gather_ps(at.v, from, 4)};
}

// 32 numbers, of which any can be picked. @pre 0 <= at < 32
struct Picked32 {
    Floats left, right;
    RELIT_INLINE explicit Picked32(const float* from)
        : left(load(from)), right(load(from + lanes)) {}
    RELIT_INLINE Floats operator()(Ints at) const {
        return {_mm512_permutex2var_ps(left.v, at.v, right.v)};
    }
};

// Numbers of a row at any of `window_size` places, from two registers.
constexpr int window_size = 32;
struct Window {
    Floats left, right;
    RELIT_INLINE explicit Window(const float* row) : left(load(row)), right(load(row + lanes)) {}
    RELIT_INLINE static Ints place(Ints at, int) { return at; }
    RELIT_INLINE Floats operator()(Ints at) const {
        return {_mm512_permutex2var_ps(left.v, at.v, right.v)};
    }
};
struct Gather {
    const float* row;
    RELIT_INLINE explicit Gather(const float* p) : row(p) {}
    // Lanes that have nothing to do may stand anywhere: not even they may read beyond the row.
    RELIT_INLINE static Ints place(Ints at, int rightmost) { return clamped(at, 0, rightmost); }
    RELIT_INLINE Floats operator()(Ints at) const { return gather(row, at); }
};

}  // namespace
}  // namespace relit::kernels
