// W numbers side by side. Include only where PNEUMA_LANES names the instruction set that the file is compiled for: each
// gets functions of its own name, so that the linker never mixes them up.
#pragma once

#include <cstddef>
#include <cstdint>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace pneuma::physics {
inline namespace PNEUMA_LANES {

// Overloads without a library function in between (see PerLane). Fused multiply-add is part of the result everywhere;
// where the processor has none, the C library computes it.
inline float fused(float a, float b, float c) {
  return __builtin_fmaf(a, b, c);
}
inline double fused(double a, double b, double c) {
  return __builtin_fma(a, b, c);
}
inline float root(float a) {
  return __builtin_sqrtf(a);
}
inline double root(double a) {
  return __builtin_sqrt(a);
}

/// Plain numbers, for any width; the vector registers follow below.
template <class Scalar, std::size_t W>
struct Pack {
  using Real = Scalar;
  static constexpr std::size_t width = W;
  static constexpr std::size_t slots_per_ms = 5'000;
  /// The slot whose numbers load_rows puts into a lane, and store_rows takes from it.
  static constexpr std::size_t slot_of_lane(std::size_t lane) { return lane; }

  Real lanes[W];

  static Pack all(Real value) {
    Pack r;
    for (std::size_t i = 0; i < W; ++i) r.lanes[i] = value;
    return r;
  }
  static Pack load(const Real* from) {
    Pack r;
    for (std::size_t i = 0; i < W; ++i) r.lanes[i] = from[i];
    return r;
  }
  void store(Real* to) const {
    for (std::size_t i = 0; i < W; ++i) to[i] = lanes[i];
  }
  /// x, y, z of W slots in a row, from x, y, z, 0 each.
  static void load_rows(const Real* from, Pack& x, Pack& y, Pack& z) {
    for (std::size_t i = 0; i < W; ++i) {
      x.lanes[i] = from[4 * i];
      y.lanes[i] = from[4 * i + 1];
      z.lanes[i] = from[4 * i + 2];
    }
  }
  static void store_rows(Real* to, const Pack& x, const Pack& y, const Pack& z) {
    for (std::size_t i = 0; i < W; ++i) {
      to[4 * i] = x.lanes[i];
      to[4 * i + 1] = y.lanes[i];
      to[4 * i + 2] = z.lanes[i];
      to[4 * i + 3] = 0;
    }
  }
  /// x, y, z of the slots that start at from[offsets[i]], for slot i in its lane.
  static void gather(const Real* from, const std::uint32_t* offsets, Pack& x, Pack& y, Pack& z) {
    for (std::size_t i = 0; i < W; ++i) {
      x.lanes[i] = from[offsets[i]];
      y.lanes[i] = from[offsets[i] + 1];
      z.lanes[i] = from[offsets[i] + 2];
    }
  }

  friend Pack operator+(const Pack& a, const Pack& b) {
    Pack r;
    for (std::size_t i = 0; i < W; ++i) r.lanes[i] = a.lanes[i] + b.lanes[i];
    return r;
  }
  friend Pack operator-(const Pack& a, const Pack& b) {
    Pack r;
    for (std::size_t i = 0; i < W; ++i) r.lanes[i] = a.lanes[i] - b.lanes[i];
    return r;
  }
  friend Pack operator*(const Pack& a, const Pack& b) {
    Pack r;
    for (std::size_t i = 0; i < W; ++i) r.lanes[i] = a.lanes[i] * b.lanes[i];
    return r;
  }
  friend Pack operator/(const Pack& a, const Pack& b) {
    Pack r;
    for (std::size_t i = 0; i < W; ++i) r.lanes[i] = a.lanes[i] / b.lanes[i];
    return r;
  }
  /// a b + c, rounded once.
  friend Pack fma(const Pack& a, const Pack& b, const Pack& c) {
    Pack r;
    for (std::size_t i = 0; i < W; ++i) r.lanes[i] = fused(a.lanes[i], b.lanes[i], c.lanes[i]);
    return r;
  }
  /// c - a b, rounded once.
  friend Pack fnma(const Pack& a, const Pack& b, const Pack& c) {
    Pack r;
    for (std::size_t i = 0; i < W; ++i) r.lanes[i] = fused(-a.lanes[i], b.lanes[i], c.lanes[i]);
    return r;
  }
  friend Pack sqrt(const Pack& a) {
    Pack r;
    for (std::size_t i = 0; i < W; ++i) r.lanes[i] = root(a.lanes[i]);
    return r;
  }
  /// `value` where a > 0, and 0 elsewhere.
  friend Pack where_positive(const Pack& a, const Pack& value) {
    Pack r;
    for (std::size_t i = 0; i < W; ++i) r.lanes[i] = a.lanes[i] > 0 ? value.lanes[i] : 0;
    return r;
  }
  /// `value` where a > 0, and `other` elsewhere.
  friend Pack choose(const Pack& a, const Pack& value, const Pack& other) {
    Pack r;
    for (std::size_t i = 0; i < W; ++i) r.lanes[i] = a.lanes[i] > 0 ? value.lanes[i] : other.lanes[i];
    return r;
  }
  /// One bit a lane, the first one lowest: a <= b.
  friend std::uint32_t at_most(const Pack& a, const Pack& b) {
    std::uint32_t bits = 0;
    for (std::size_t i = 0; i < W; ++i) bits |= (a.lanes[i] <= b.lanes[i] ? 1U : 0U) << i;
    return bits;
  }
  /// The one that is less, or more; `known` where a is not a number.
  friend Pack lower(const Pack& a, const Pack& known) {
    Pack r;
    for (std::size_t i = 0; i < W; ++i) r.lanes[i] = a.lanes[i] < known.lanes[i] ? a.lanes[i] : known.lanes[i];
    return r;
  }
  friend Pack higher(const Pack& a, const Pack& known) {
    Pack r;
    for (std::size_t i = 0; i < W; ++i) r.lanes[i] = a.lanes[i] > known.lanes[i] ? a.lanes[i] : known.lanes[i];
    return r;
  }
  /// The larger of `most` and |a|; `most` where a is not a number.
  friend Pack largest(const Pack& most, const Pack& a) {
    Pack r;
    for (std::size_t i = 0; i < W; ++i) {
      const Real size = a.lanes[i] < 0 ? -a.lanes[i] : a.lanes[i];
      r.lanes[i] = size > most.lanes[i] ? size : most.lanes[i];
    }
    return r;
  }
};

// What the vector packs have alike: `Type` is the struct, `wide` and `suffix` name its intrinsics.
#define PNEUMA_PACK_OPERATIONS(Type, wide, suffix)              \
  static Type all(Real value) {                                 \
    return {wide##_set1_##suffix(value)};                       \
  }                                                             \
  static Type load(const Real* from) {                          \
    return {wide##_loadu_##suffix(from)};                       \
  }                                                             \
  void store(Real* to) const {                                  \
    wide##_storeu_##suffix(to, lanes);                          \
  }                                                             \
  friend Type operator+(Type a, Type b) {                       \
    return {wide##_add_##suffix(a.lanes, b.lanes)};             \
  }                                                             \
  friend Type operator-(Type a, Type b) {                       \
    return {wide##_sub_##suffix(a.lanes, b.lanes)};             \
  }                                                             \
  friend Type operator*(Type a, Type b) {                       \
    return {wide##_mul_##suffix(a.lanes, b.lanes)};             \
  }                                                             \
  friend Type operator/(Type a, Type b) {                       \
    return {wide##_div_##suffix(a.lanes, b.lanes)};             \
  }                                                             \
  friend Type fma(Type a, Type b, Type c) {                     \
    return {wide##_fmadd_##suffix(a.lanes, b.lanes, c.lanes)};  \
  }                                                             \
  friend Type fnma(Type a, Type b, Type c) {                    \
    return {wide##_fnmadd_##suffix(a.lanes, b.lanes, c.lanes)}; \
  }                                                             \
  friend Type lower(Type a, Type known) {                       \
    return {wide##_min_##suffix(a.lanes, known.lanes)};         \
  }                                                             \
  friend Type higher(Type a, Type known) {                      \
    return {wide##_max_##suffix(a.lanes, known.lanes)};         \
  }                                                             \
  friend Type sqrt(Type a) {                                    \
    return {wide##_sqrt_##suffix(a.lanes)};                     \
  }

#if defined(__AVX512F__) && defined(__AVX512DQ__)

template <>
struct Pack<float, 16> {
  using Real = float;
  static constexpr std::size_t width = 16;
  static constexpr std::size_t slots_per_ms = 250'000;
  static constexpr std::size_t slot_of_lane(std::size_t lane) { return 4 * (lane % 4) + lane / 4; }

  __m512 lanes;

  PNEUMA_PACK_OPERATIONS(Pack, _mm512, ps)

  static void load_rows(const float* from, Pack& x, Pack& y, Pack& z) {
    transpose(_mm512_loadu_ps(from), _mm512_loadu_ps(from + 16), _mm512_loadu_ps(from + 32), _mm512_loadu_ps(from + 48),
              x, y, z);
  }
  static void store_rows(float* to, Pack x, Pack y, Pack z) {
    const __m512 zero = _mm512_setzero_ps();
    const __m512 xy_low = _mm512_unpacklo_ps(x.lanes, y.lanes);
    const __m512 xy_high = _mm512_unpackhi_ps(x.lanes, y.lanes);
    const __m512 z_low = _mm512_unpacklo_ps(z.lanes, zero);
    const __m512 z_high = _mm512_unpackhi_ps(z.lanes, zero);
    _mm512_storeu_ps(to, pairs_low(xy_low, z_low));
    _mm512_storeu_ps(to + 16, pairs_high(xy_low, z_low));
    _mm512_storeu_ps(to + 32, pairs_low(xy_high, z_high));
    _mm512_storeu_ps(to + 48, pairs_high(xy_high, z_high));
  }
  static void gather(const float* from, const std::uint32_t* offsets, Pack& x, Pack& y, Pack& z) {
    transpose(four(from, offsets), four(from, offsets + 4), four(from, offsets + 8), four(from, offsets + 12), x, y, z);
  }
  friend Pack where_positive(Pack a, Pack value) {
    const __mmask16 positive = _mm512_cmp_ps_mask(a.lanes, _mm512_setzero_ps(), _CMP_GT_OQ);
    return {_mm512_maskz_mov_ps(positive, value.lanes)};
  }
  friend Pack largest(Pack most, Pack a) { return {_mm512_max_ps(_mm512_abs_ps(a.lanes), most.lanes)}; }

 private:
  static __m512 four(const float* from, const std::uint32_t* offsets) {
    const __m512 first = _mm512_castps128_ps512(_mm_loadu_ps(from + offsets[0]));
    const __m512 second = _mm512_insertf32x4(first, _mm_loadu_ps(from + offsets[1]), 1);
    const __m512 third = _mm512_insertf32x4(second, _mm_loadu_ps(from + offsets[2]), 2);
    return _mm512_insertf32x4(third, _mm_loadu_ps(from + offsets[3]), 3);
  }
  static __m512 pairs_low(__m512 a, __m512 b) {
    return _mm512_castpd_ps(_mm512_unpacklo_pd(_mm512_castps_pd(a), _mm512_castps_pd(b)));
  }
  static __m512 pairs_high(__m512 a, __m512 b) {
    return _mm512_castpd_ps(_mm512_unpackhi_pd(_mm512_castps_pd(a), _mm512_castps_pd(b)));
  }
  static void transpose(__m512 a, __m512 b, __m512 c, __m512 d, Pack& x, Pack& y, Pack& z) {
    const __m512 xy_ab = _mm512_unpacklo_ps(a, b);
    const __m512 xy_cd = _mm512_unpacklo_ps(c, d);
    x.lanes = pairs_low(xy_ab, xy_cd);
    y.lanes = pairs_high(xy_ab, xy_cd);
    z.lanes = pairs_low(_mm512_unpackhi_ps(a, b), _mm512_unpackhi_ps(c, d));
  }
};

template <>
struct Pack<double, 8> {
  using Real = double;
  static constexpr std::size_t width = 8;
  static constexpr std::size_t slots_per_ms = 100'000;
  static constexpr std::size_t slot_of_lane(std::size_t lane) { return 4 * (lane / 4) + 2 * (lane % 2) + lane / 2 % 2; }

  __m512d lanes;

  PNEUMA_PACK_OPERATIONS(Pack, _mm512, pd)

  static void load_rows(const double* from, Pack& x, Pack& y, Pack& z) {
    transpose(_mm512_loadu_pd(from), _mm512_loadu_pd(from + 8), _mm512_loadu_pd(from + 16), _mm512_loadu_pd(from + 24),
              x, y, z);
  }
  static void store_rows(double* to, Pack x, Pack y, Pack z) {
    const __m512d zero = _mm512_setzero_pd();
    const __m512d xy_even = _mm512_unpacklo_pd(x.lanes, y.lanes);  // slots 0, 1, 4, 5
    const __m512d xy_odd = _mm512_unpackhi_pd(x.lanes, y.lanes);   // slots 2, 3, 6, 7
    const __m512d z_even = _mm512_unpacklo_pd(z.lanes, zero);
    const __m512d z_odd = _mm512_unpackhi_pd(z.lanes, zero);
    _mm512_storeu_pd(to, halves_low(xy_even, z_even));
    _mm512_storeu_pd(to + 8, halves_low(xy_odd, z_odd));
    _mm512_storeu_pd(to + 16, halves_high(xy_even, z_even));
    _mm512_storeu_pd(to + 24, halves_high(xy_odd, z_odd));
  }
  static void gather(const double* from, const std::uint32_t* offsets, Pack& x, Pack& y, Pack& z) {
    transpose(two(from, offsets), two(from, offsets + 2), two(from, offsets + 4), two(from, offsets + 6), x, y, z);
  }
  friend Pack where_positive(Pack a, Pack value) {
    const __mmask8 positive = _mm512_cmp_pd_mask(a.lanes, _mm512_setzero_pd(), _CMP_GT_OQ);
    return {_mm512_maskz_mov_pd(positive, value.lanes)};
  }
  friend Pack choose(Pack a, Pack value, Pack other) {
    const __mmask8 positive = _mm512_cmp_pd_mask(a.lanes, _mm512_setzero_pd(), _CMP_GT_OQ);
    return {_mm512_mask_mov_pd(other.lanes, positive, value.lanes)};
  }
  friend std::uint32_t at_most(Pack a, Pack b) { return _mm512_cmp_pd_mask(a.lanes, b.lanes, _CMP_LE_OQ); }
  friend Pack largest(Pack most, Pack a) { return {_mm512_max_pd(_mm512_abs_pd(a.lanes), most.lanes)}; }

 private:
  static __m512d two(const double* from, const std::uint32_t* offsets) {
    return _mm512_insertf64x4(_mm512_castpd256_pd512(_mm256_loadu_pd(from + offsets[0])),
                              _mm256_loadu_pd(from + offsets[1]), 1);
  }
  // Of a = [a0 a1 a2 a3] and b in quarters: [a0 b0 a1 b1] and [a2 b2 a3 b3].
  static __m512d halves_low(__m512d a, __m512d b) {
    return _mm512_permutex2var_pd(a, _mm512_setr_epi64(0, 1, 8, 9, 2, 3, 10, 11), b);
  }
  static __m512d halves_high(__m512d a, __m512d b) {
    return _mm512_permutex2var_pd(a, _mm512_setr_epi64(4, 5, 12, 13, 6, 7, 14, 15), b);
  }
  static void transpose(__m512d a, __m512d b, __m512d c, __m512d d, Pack& x, Pack& y, Pack& z) {
    const __m512d xz_ab = _mm512_unpacklo_pd(a, b);
    const __m512d xz_cd = _mm512_unpacklo_pd(c, d);
    x.lanes = _mm512_shuffle_f64x2(xz_ab, xz_cd, 0x88);
    z.lanes = _mm512_shuffle_f64x2(xz_ab, xz_cd, 0xdd);
    y.lanes = _mm512_shuffle_f64x2(_mm512_unpackhi_pd(a, b), _mm512_unpackhi_pd(c, d), 0x88);
  }
};

#elif defined(__AVX2__) && defined(__FMA__)

template <>
struct Pack<float, 8> {
  using Real = float;
  static constexpr std::size_t width = 8;
  static constexpr std::size_t slots_per_ms = 130'000;
  static constexpr std::size_t slot_of_lane(std::size_t lane) { return 2 * (lane % 4) + lane / 4; }

  __m256 lanes;

  PNEUMA_PACK_OPERATIONS(Pack, _mm256, ps)

  static void load_rows(const float* from, Pack& x, Pack& y, Pack& z) {
    transpose(_mm256_loadu_ps(from), _mm256_loadu_ps(from + 8), _mm256_loadu_ps(from + 16), _mm256_loadu_ps(from + 24),
              x, y, z);
  }
  static void store_rows(float* to, Pack x, Pack y, Pack z) {
    const __m256 zero = _mm256_setzero_ps();
    const __m256 xy_low = _mm256_unpacklo_ps(x.lanes, y.lanes);
    const __m256 xy_high = _mm256_unpackhi_ps(x.lanes, y.lanes);
    const __m256 z_low = _mm256_unpacklo_ps(z.lanes, zero);
    const __m256 z_high = _mm256_unpackhi_ps(z.lanes, zero);
    _mm256_storeu_ps(to, pairs_low(xy_low, z_low));
    _mm256_storeu_ps(to + 8, pairs_high(xy_low, z_low));
    _mm256_storeu_ps(to + 16, pairs_low(xy_high, z_high));
    _mm256_storeu_ps(to + 24, pairs_high(xy_high, z_high));
  }
  static void gather(const float* from, const std::uint32_t* offsets, Pack& x, Pack& y, Pack& z) {
    transpose(two(from, offsets), two(from, offsets + 2), two(from, offsets + 4), two(from, offsets + 6), x, y, z);
  }
  friend Pack where_positive(Pack a, Pack value) {
    return {_mm256_and_ps(_mm256_cmp_ps(a.lanes, _mm256_setzero_ps(), _CMP_GT_OQ), value.lanes)};
  }
  friend Pack largest(Pack most, Pack a) {
    return {_mm256_max_ps(_mm256_andnot_ps(_mm256_set1_ps(-0.0F), a.lanes), most.lanes)};
  }

 private:
  static __m256 two(const float* from, const std::uint32_t* offsets) {
    return _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_loadu_ps(from + offsets[0])),
                                _mm_loadu_ps(from + offsets[1]), 1);
  }
  static __m256 pairs_low(__m256 a, __m256 b) {
    return _mm256_castpd_ps(_mm256_unpacklo_pd(_mm256_castps_pd(a), _mm256_castps_pd(b)));
  }
  static __m256 pairs_high(__m256 a, __m256 b) {
    return _mm256_castpd_ps(_mm256_unpackhi_pd(_mm256_castps_pd(a), _mm256_castps_pd(b)));
  }
  static void transpose(__m256 a, __m256 b, __m256 c, __m256 d, Pack& x, Pack& y, Pack& z) {
    const __m256 xy_ab = _mm256_unpacklo_ps(a, b);
    const __m256 xy_cd = _mm256_unpacklo_ps(c, d);
    x.lanes = pairs_low(xy_ab, xy_cd);
    y.lanes = pairs_high(xy_ab, xy_cd);
    z.lanes = pairs_low(_mm256_unpackhi_ps(a, b), _mm256_unpackhi_ps(c, d));
  }
};

template <>
struct Pack<double, 4> {
  using Real = double;
  static constexpr std::size_t width = 4;
  static constexpr std::size_t slots_per_ms = 60'000;
  static constexpr std::size_t slot_of_lane(std::size_t lane) { return lane; }

  __m256d lanes;

  PNEUMA_PACK_OPERATIONS(Pack, _mm256, pd)

  static void load_rows(const double* from, Pack& x, Pack& y, Pack& z) {
    transpose(_mm256_loadu_pd(from), _mm256_loadu_pd(from + 4), _mm256_loadu_pd(from + 8), _mm256_loadu_pd(from + 12),
              x, y, z);
  }
  static void store_rows(double* to, Pack x, Pack y, Pack z) {
    const __m256d zero = _mm256_setzero_pd();
    const __m256d xy_even = _mm256_unpacklo_pd(x.lanes, y.lanes);
    const __m256d xy_odd = _mm256_unpackhi_pd(x.lanes, y.lanes);
    const __m256d z_even = _mm256_unpacklo_pd(z.lanes, zero);
    const __m256d z_odd = _mm256_unpackhi_pd(z.lanes, zero);
    _mm256_storeu_pd(to, _mm256_permute2f128_pd(xy_even, z_even, 0x20));
    _mm256_storeu_pd(to + 4, _mm256_permute2f128_pd(xy_odd, z_odd, 0x20));
    _mm256_storeu_pd(to + 8, _mm256_permute2f128_pd(xy_even, z_even, 0x31));
    _mm256_storeu_pd(to + 12, _mm256_permute2f128_pd(xy_odd, z_odd, 0x31));
  }
  static void gather(const double* from, const std::uint32_t* offsets, Pack& x, Pack& y, Pack& z) {
    transpose(_mm256_loadu_pd(from + offsets[0]), _mm256_loadu_pd(from + offsets[1]),
              _mm256_loadu_pd(from + offsets[2]), _mm256_loadu_pd(from + offsets[3]), x, y, z);
  }
  friend Pack where_positive(Pack a, Pack value) {
    return {_mm256_and_pd(_mm256_cmp_pd(a.lanes, _mm256_setzero_pd(), _CMP_GT_OQ), value.lanes)};
  }
  friend Pack choose(Pack a, Pack value, Pack other) {
    return {_mm256_blendv_pd(other.lanes, value.lanes, _mm256_cmp_pd(a.lanes, _mm256_setzero_pd(), _CMP_GT_OQ))};
  }
  friend std::uint32_t at_most(Pack a, Pack b) {
    return static_cast<std::uint32_t>(_mm256_movemask_pd(_mm256_cmp_pd(a.lanes, b.lanes, _CMP_LE_OQ)));
  }
  friend Pack largest(Pack most, Pack a) {
    return {_mm256_max_pd(_mm256_andnot_pd(_mm256_set1_pd(-0.0), a.lanes), most.lanes)};
  }

 private:
  static void transpose(__m256d a, __m256d b, __m256d c, __m256d d, Pack& x, Pack& y, Pack& z) {
    const __m256d xz_ab = _mm256_unpacklo_pd(a, b);
    const __m256d xz_cd = _mm256_unpacklo_pd(c, d);
    x.lanes = _mm256_permute2f128_pd(xz_ab, xz_cd, 0x20);
    z.lanes = _mm256_permute2f128_pd(xz_ab, xz_cd, 0x31);
    y.lanes = _mm256_permute2f128_pd(_mm256_unpackhi_pd(a, b), _mm256_unpackhi_pd(c, d), 0x20);
  }
};

#endif

#undef PNEUMA_PACK_OPERATIONS

}  // namespace PNEUMA_LANES
}  // namespace pneuma::physics
