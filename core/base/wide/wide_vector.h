// A register of floats at a time in the compiler's own vectors: 8 of AVX2, else 4, which every
// processor has. Not more than a register: the compiler would take comparisons apart.
#pragma once

#if defined(__AVX2__)
#include <immintrin.h>
#elif defined(__SSE2__)
#include <emmintrin.h>
#endif

#define RELIT_INLINE inline __attribute__((always_inline))
#define RELIT_INLINE_LAMBDA __attribute__((always_inline))

namespace relit::kernels {
namespace {

#ifdef __AVX2__
constexpr int register_size = 32;
#else
constexpr int register_size = 16;
#endif
constexpr int lanes = register_size / 4;

using FloatVector = float __attribute__((vector_size(register_size)));
using IntVector = int __attribute__((vector_size(register_size)));
// In memory that is aligned for its numbers only. In two steps: in one, clang passes over the
// alignment.
using UnalignedFloats __attribute__((aligned(4), may_alias)) = FloatVector;
using UnalignedInts __attribute__((aligned(4), may_alias)) = IntVector;

// True or false per lane.
struct Mask {
    IntVector v;
};
RELIT_INLINE Mask operator&(Mask a, Mask b) { return {a.v & b.v}; }
RELIT_INLINE Mask operator|(Mask a, Mask b) { return {a.v | b.v}; }
RELIT_INLINE Mask operator^(Mask a, Mask b) { return {a.v ^ b.v}; }
RELIT_INLINE Mask operator~(Mask a) { return {~a.v}; }
const Mask all_lanes = {IntVector{} - 1};
RELIT_INLINE bool any(Mask a) {
#ifdef __AVX2__
    return !_mm256_testz_si256((__m256i)a.v, (__m256i)a.v);
#else
    using Halves = long long __attribute__((vector_size(register_size)));
    const Halves h = (Halves)a.v;
    return (h[0] | h[1]) != 0;
#endif
}
RELIT_INLINE bool all(Mask a) { return !any(~a); }
// Lane k in bit k.
RELIT_INLINE unsigned bits(Mask a) {
#if defined(__AVX2__)
    return unsigned(_mm256_movemask_ps((__m256)a.v));
#elif defined(__SSE2__)
    return unsigned(_mm_movemask_ps((__m128)a.v));
#else
    unsigned all = 0;
    for (int k = 0; k < lanes; ++k) all |= unsigned(a.v[k] & 1) << k;
    return all;
#endif
}

struct Ints {
    IntVector v;
};
RELIT_INLINE Ints broadcast(int a) { return {IntVector{} + a}; }
RELIT_INLINE Ints operator+(Ints a, Ints b) { return {a.v + b.v}; }
RELIT_INLINE Ints operator-(Ints a, Ints b) { return {a.v - b.v}; }
RELIT_INLINE Ints operator*(Ints a, Ints b) { return {a.v * b.v}; }
RELIT_INLINE Ints operator&(Ints a, Ints b) { return {a.v & b.v}; }
RELIT_INLINE Ints operator|(Ints a, Ints b) { return {a.v | b.v}; }
RELIT_INLINE Ints load(const int* p) { return {*(const UnalignedInts*)p}; }
RELIT_INLINE void store(int* p, Ints a) { *(UnalignedInts*)p = a.v; }
RELIT_INLINE Ints clamped(Ints a, int lo, int hi) {
    const IntVector l = IntVector{} + lo, h = IntVector{} + hi;
    const IntVector raised = a.v < l ? l : a.v;
    return {raised > h ? h : raised};
}
RELIT_INLINE Ints min(Ints a, Ints b) { return {a.v < b.v ? a.v : b.v}; }
template <int bits>
RELIT_INLINE Ints shifted_left(Ints a) {
    return {a.v << bits};
}
// The sign is kept.
RELIT_INLINE Ints shifted_right(Ints a, int bits) { return {a.v >> bits}; }

struct Floats {
    FloatVector v;
};
RELIT_INLINE Ints bits_of(Floats a) { return {(IntVector)a.v}; }
RELIT_INLINE Floats floats_of_bits(Ints a) { return {(FloatVector)a.v}; }
RELIT_INLINE Floats broadcast(float a) { return {FloatVector{} + a}; }
RELIT_INLINE Floats load(const float* p) { return {*(const UnalignedFloats*)p}; }
RELIT_INLINE void store(float* p, Floats a) { *(UnalignedFloats*)p = a.v; }
RELIT_INLINE Floats operator+(Floats a, Floats b) { return {a.v + b.v}; }
RELIT_INLINE Floats operator-(Floats a, Floats b) { return {a.v - b.v}; }
RELIT_INLINE Floats operator*(Floats a, Floats b) { return {a.v * b.v}; }
RELIT_INLINE Floats operator/(Floats a, Floats b) { return {a.v / b.v}; }
RELIT_INLINE Mask operator<(Floats a, Floats b) { return {a.v < b.v}; }
RELIT_INLINE Mask operator<=(Floats a, Floats b) { return {a.v <= b.v}; }
RELIT_INLINE Mask operator==(Floats a, Floats b) { return {a.v == b.v}; }
RELIT_INLINE Floats select(Mask m, Floats a, Floats b) { return {m.v ? a.v : b.v}; }
// The second where either is not a number.
RELIT_INLINE Floats min(Floats a, Floats b) { return {a.v < b.v ? a.v : b.v}; }
RELIT_INLINE Floats max(Floats a, Floats b) { return {a.v > b.v ? a.v : b.v}; }
RELIT_INLINE Floats magnitude(Floats a) {
    return {(FloatVector)((IntVector)a.v & (IntVector{} + 0x7fffffff))};
}
RELIT_INLINE Floats square_root(Floats a) {
#ifdef __AVX2__
    return {(FloatVector)_mm256_sqrt_ps((__m256)a.v)};
#else
    Floats root;
    for (int k = 0; k < lanes; ++k) root.v[k] = __builtin_sqrtf(a.v[k]);
    return root;
#endif
}
// Towards zero. @pre the numbers fit
RELIT_INLINE Ints to_ints(Floats a) { return {__builtin_convertvector(a.v, IntVector)}; }
RELIT_INLINE Floats to_floats(Ints a) { return {__builtin_convertvector(a.v, FloatVector)}; }
using Doubles = double __attribute__((vector_size(register_size)));
RELIT_INLINE Floats to_floats(const Doubles (&halves)[2]) {
#ifdef __AVX2__
    const __m128 left = _mm256_cvtpd_ps((__m256d)halves[0]);
    const __m128 right = _mm256_cvtpd_ps((__m256d)halves[1]);
    return {(FloatVector)_mm256_set_m128(right, left)};
#else
    return {FloatVector{float(halves[0][0]), float(halves[0][1]), float(halves[1][0]),
                        float(halves[1][1])}};
#endif
}
// Its first (0) or second half.
RELIT_INLINE Doubles to_doubles(Floats a, int half) {
    Doubles d = {};
    for (int k = 0; k < lanes / 2; ++k) d[k] = a.v[half * lanes / 2 + k];
    return d;
}
RELIT_INLINE void store(double* p, Doubles a) {
    for (int k = 0; k < lanes / 2; ++k) p[k] = a[k];
}
// Every third number: from[3 * index].
RELIT_INLINE Doubles gather(const double* from, const int* index) {
    Doubles d = {};
    for (int k = 0; k < lanes / 2; ++k) d[k] = from[3 * index[k]];
    return d;
}
RELIT_INLINE Doubles square_root(Doubles a) {
#ifdef __AVX2__
    return (Doubles)_mm256_sqrt_pd((__m256d)a);
#else
    return Doubles{__builtin_sqrt(a[0]), __builtin_sqrt(a[1])};
#endif
}
// The next integer below. @pre it fits an int
RELIT_INLINE Doubles floor(Doubles a) {
#ifdef __AVX2__
    return (Doubles)_mm256_floor_pd((__m256d)a);
#else
    const Doubles cut = {double(int(a[0])), double(int(a[1]))};
    return cut > a ? cut - 1.0 : cut;
#endif
}
// The next integer below. @pre it fits an int
RELIT_INLINE Floats floor(Floats a) {
#ifdef __AVX2__
    return {(FloatVector)_mm256_floor_ps((__m256)a.v)};
#else
    const Floats cut = to_floats(to_ints(a));
    return {cut.v > a.v ? cut.v - 1.0f : cut.v};
#endif
}
RELIT_INLINE Floats ceil(Floats a) { return broadcast(0.0f) - floor(broadcast(0.0f) - a); }
RELIT_INLINE Floats with_sign_of(Floats a, Floats sign) {
    const IntVector top_bit = IntVector{} + int(0x80000000);
    return {(FloatVector)(((IntVector)a.v & ~top_bit) | ((IntVector)sign.v & top_bit))};
}
// Whether the lowest bit of the mantissa is set.
RELIT_INLINE Mask lowest_bit(Floats a) { return {((IntVector)a.v & 1) != 0}; }
RELIT_INLINE float lowest(Floats a) {
    float least = a.v[0];
    for (int k = 1; k < lanes; ++k) least = a.v[k] < least ? a.v[k] : least;
    return least;
}
RELIT_INLINE float highest(Floats a) {
    float most = a.v[0];
    for (int k = 1; k < lanes; ++k) most = a.v[k] > most ? a.v[k] : most;
    return most;
}

// Writes first + k for each lane k whose bit is set in `which`, in order, and returns where the next
// is to go. May write as many as there are lanes.
RELIT_INLINE int* append_lanes(int* to, unsigned which, int first) {
    for (int k = 0; k < lanes; ++k) {
        *to = first + k;
        to += which >> k & 1;
    }
    return to;
}
// Of the numbers of four registers, one after the other, those at `at`.
RELIT_INLINE Floats pick(Floats a, Floats b, Floats c, Floats d, Ints at) {
#ifdef __AVX2__
    const __m256i index = (__m256i)at.v;
    const auto of = [&](Floats from) RELIT_INLINE_LAMBDA {
        return _mm256_permutevar8x32_ps((__m256)from.v, index);
    };
    const __m256 in_second = _mm256_castsi256_ps(_mm256_slli_epi32(index, 28));
    const __m256 in_latter = _mm256_castsi256_ps(_mm256_slli_epi32(index, 27));
    const __m256 low = _mm256_blendv_ps(of(a), of(b), in_second);
    const __m256 high = _mm256_blendv_ps(of(c), of(d), in_second);
    return {(FloatVector)_mm256_blendv_ps(low, high, in_latter)};
#else
    float all[4 * lanes];
    store(all, a);
    store(all + lanes, b);
    store(all + 2 * lanes, c);
    store(all + 3 * lanes, d);
    Floats out;
    for (int k = 0; k < lanes; ++k) out.v[k] = all[at.v[k]];
    return out;
#endif
}
// out[0], out[1] and out[2]: from[at[k]] and the two after it, for each lane k. Reads a fourth.
RELIT_INLINE void load_triples(const float* from, const int* at, Floats (&out)[3]) {
#ifdef __AVX2__
    // Blocks of four lanes, transposed each.
    const auto every_fourth = [&](int k) RELIT_INLINE_LAMBDA {
        return _mm256_set_m128(_mm_loadu_ps(from + at[k + 4]), _mm_loadu_ps(from + at[k]));
    };
    const __m256 a = every_fourth(0), b = every_fourth(1), c = every_fourth(2);
    const __m256 d = every_fourth(3);
    const __m256d ab = (__m256d)_mm256_unpacklo_ps(a, b), cd = (__m256d)_mm256_unpacklo_ps(c, d);
    const __m256d ab_high = (__m256d)_mm256_unpackhi_ps(a, b);
    const __m256d cd_high = (__m256d)_mm256_unpackhi_ps(c, d);
    out[0].v = (FloatVector)_mm256_unpacklo_pd(ab, cd);
    out[1].v = (FloatVector)_mm256_unpackhi_pd(ab, cd);
    out[2].v = (FloatVector)_mm256_unpacklo_pd(ab_high, cd_high);
#else
    for (int n = 0; n < 3; ++n)
        for (int k = 0; k < lanes; ++k) out[n].v[k] = from[at[k] + n];
#endif
}
// a and b of each lane next to each other.
RELIT_INLINE void store_pairs(float* to, Floats a, Floats b) {
#ifdef __AVX2__
    store(to, {__builtin_shufflevector(a.v, b.v, 0, 8, 1, 9, 2, 10, 3, 11)});
    store(to + lanes, {__builtin_shufflevector(a.v, b.v, 4, 12, 5, 13, 6, 14, 7, 15)});
#else
    store(to, {__builtin_shufflevector(a.v, b.v, 0, 4, 1, 5)});
    store(to + lanes, {__builtin_shufflevector(a.v, b.v, 2, 6, 3, 7)});
#endif
}
RELIT_INLINE void load_pairs(const float* from, Floats& a, Floats& b) {
    const FloatVector low = load(from).v, high = load(from + lanes).v;
#ifdef __AVX2__
    a.v = __builtin_shufflevector(low, high, 0, 2, 4, 6, 8, 10, 12, 14);
    b.v = __builtin_shufflevector(low, high, 1, 3, 5, 7, 9, 11, 13, 15);
#else
    a.v = __builtin_shufflevector(low, high, 0, 2, 4, 6);
    b.v = __builtin_shufflevector(low, high, 1, 3, 5, 7);
#endif
}

// from[at].
RELIT_INLINE Floats gather(const float* from, Ints at) {
#ifdef __AVX2__
    return {(FloatVector)_mm256_i32gather_ps(from, (__m256i)at.v, 4)};
#else
    Floats out;
    for (int k = 0; k < lanes; ++k) out.v[k] = from[at.v[k]];
    return out;
#endif
}

// 32 numbers, of which any can be picked. @pre 0 <= at < 32
struct Picked32 {
    const float* from;
    RELIT_INLINE explicit Picked32(const float* p) : from(p) {}
    RELIT_INLINE Floats operator()(Ints at) const { return gather(from, at); }
};

// Numbers of a row at any places.
struct Gather {
    const float* row;
    RELIT_INLINE explicit Gather(const float* p) : row(p) {}
    // Lanes that have nothing to do may stand anywhere: not even they may read beyond the row.
    RELIT_INLINE static Ints place(Ints at, int rightmost) { return clamped(at, 0, rightmost); }
    RELIT_INLINE Floats operator()(Ints at) const { return gather(row, at); }
};

#ifdef __AVX2__
// The same at places 0 to window_size - 1, from two registers.
constexpr int window_size = 16;
struct Window {
    Floats left, right;
    RELIT_INLINE explicit Window(const float* row) : left(load(row)), right(load(row + lanes)) {}
    RELIT_INLINE static Ints place(Ints at, int) { return at; }
    RELIT_INLINE Floats operator()(Ints at) const {
        const __m256i index = (__m256i)at.v;
        const __m256 from_left = _mm256_permutevar8x32_ps((__m256)left.v, index);
        const __m256 from_right = _mm256_permutevar8x32_ps((__m256)right.v, index);
        const __m256 which = _mm256_castsi256_ps(_mm256_slli_epi32(index, 28));
        return {(FloatVector)_mm256_blendv_ps(from_left, from_right, which)};
    }
};
#else
constexpr int window_size = 0;  // no register to look into: always Gather
using Window = Gather;
#endif

}  // namespace
}  // namespace relit::kernels
