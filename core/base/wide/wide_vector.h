// A register of floats at a time in the compiler's own vectors: 8 of AVX2, else 4, which every
// processor has. Not more than a register: the compiler would take comparisons apart.
#pragma once

#ifdef __AVX2__
#include <immintrin.h>
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

struct Ints {
    IntVector v;
};
RELIT_INLINE Ints broadcast(int a) { return {IntVector{} + a}; }
RELIT_INLINE Ints operator+(Ints a, Ints b) { return {a.v + b.v}; }
RELIT_INLINE Ints operator-(Ints a, Ints b) { return {a.v - b.v}; }
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
