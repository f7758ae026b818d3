/* Lanes of AVX-512: vectors of eight numbers. */
#include "lanes.h"

#ifdef HAS_X86_LANES
#include <immintrin.h>
#ifdef __clang__
#pragma clang attribute push(__attribute__((target("avx512f,avx512dq"))), apply_to = function)
#else
#pragma GCC push_options
#pragma GCC target("avx512f,avx512dq")
#endif

#define LANES LANES_AVX512
#include "lanes_vector.h"

static inline vector select_lanes(mask m, vector yes, vector no) {
  const __mmask8 chosen = _mm512_movepi64_mask((__m512i)m);
  return (vector)_mm512_mask_blend_pd(chosen, (__m512d)no, (__m512d)yes);
}

static inline vector root_of(vector x) { return (vector)_mm512_sqrt_pd((__m512d)x); }

static inline vector larger_of(vector a, vector b) {
  return (vector)_mm512_max_pd((__m512d)a, (__m512d)b);
}

static inline vector smaller_of(vector a, vector b) {
  return (vector)_mm512_min_pd((__m512d)a, (__m512d)b);
}

/* A bit for each lane, that of the first one the lowest. */
static inline int bits_of(mask m) { return _mm512_movepi64_mask((__m512i)m); }

/* The rows of four numbers of two lanes. */
static inline __m512d rows_of(const real *numbers, long long low, long long high) {
  const __m512d rows = _mm512_castpd256_pd512(_mm256_loadu_pd(numbers + low));
  return _mm512_insertf64x4(rows, _mm256_loadu_pd(numbers + high), 1);
}

/* Four numbers in a row for each lane, from its index on: a row of each lane is loaded, and the
   squares of four of them are transposed. */
static inline void gather_four(const real *numbers, mask index, vector *gathered) {
  const __m512d row_04 = rows_of(numbers, index[0], index[4]);
  const __m512d row_15 = rows_of(numbers, index[1], index[5]);
  const __m512d row_26 = rows_of(numbers, index[2], index[6]);
  const __m512d row_37 = rows_of(numbers, index[3], index[7]);
  const __m512d even_01 = _mm512_unpacklo_pd(row_04, row_15); /* numbers 0 and 2 of these rows */
  const __m512d even_23 = _mm512_unpacklo_pd(row_26, row_37);
  const __m512d odd_01 = _mm512_unpackhi_pd(row_04, row_15);
  const __m512d odd_23 = _mm512_unpackhi_pd(row_26, row_37);
  const __m512i first = _mm512_setr_epi64(0, 1, 8, 9, 4, 5, 12, 13);
  const __m512i second = _mm512_setr_epi64(2, 3, 10, 11, 6, 7, 14, 15);
  gathered[0] = (vector)_mm512_permutex2var_pd(even_01, first, even_23);
  gathered[1] = (vector)_mm512_permutex2var_pd(odd_01, first, odd_23);
  gathered[2] = (vector)_mm512_permutex2var_pd(even_01, second, even_23);
  gathered[3] = (vector)_mm512_permutex2var_pd(odd_01, second, odd_23);
}

#include "lanes_kernel.h"
#include "interaction_kernel.h"

void fl_lanes_avx512(const lanes_robot *robot, const lanes_batch *batch) {
  answer_in_lanes(robot, batch);
}

void fl_interaction_avx512(const interaction_model *model, const real *force,
                           interaction_effect *effect) {
  add_interaction(model, force, effect);
}

#ifdef __clang__
#pragma clang attribute pop
#else
#pragma GCC pop_options
#endif
#endif
