/* Lanes of AVX2: vectors of four numbers. */
#include "lanes.h"

#ifdef HAS_X86_LANES
#include <immintrin.h>
#ifdef __clang__
#pragma clang attribute push(__attribute__((target("avx2"))), apply_to = function)
#else
#pragma GCC push_options
#pragma GCC target("avx2")
#endif

#define LANES LANES_AVX2
#include "lanes_vector.h"

static inline vector select_lanes(mask m, vector yes, vector no) {
  return (vector)_mm256_blendv_pd((__m256d)no, (__m256d)yes, (__m256d)m);
}

static inline vector root_of(vector x) { return (vector)_mm256_sqrt_pd((__m256d)x); }

static inline vector larger_of(vector a, vector b) {
  return (vector)_mm256_max_pd((__m256d)a, (__m256d)b);
}

static inline vector smaller_of(vector a, vector b) {
  return (vector)_mm256_min_pd((__m256d)a, (__m256d)b);
}

/* A bit for each lane, that of the first one the lowest. */
static inline int bits_of(mask m) { return _mm256_movemask_pd((__m256d)m); }

/* Four numbers in a row for each lane, from its index on: a row of each lane is loaded, and the
   square of them is transposed. */
static inline void gather_four(const real *numbers, mask index, vector *gathered) {
  const __m256d row_0 = _mm256_loadu_pd(numbers + index[0]);
  const __m256d row_1 = _mm256_loadu_pd(numbers + index[1]);
  const __m256d row_2 = _mm256_loadu_pd(numbers + index[2]);
  const __m256d row_3 = _mm256_loadu_pd(numbers + index[3]);
  const __m256d even_01 = _mm256_unpacklo_pd(row_0, row_1); /* numbers 0 and 2 of these rows */
  const __m256d even_23 = _mm256_unpacklo_pd(row_2, row_3);
  const __m256d odd_01 = _mm256_unpackhi_pd(row_0, row_1);
  const __m256d odd_23 = _mm256_unpackhi_pd(row_2, row_3);
  gathered[0] = (vector)_mm256_permute2f128_pd(even_01, even_23, 0x20);
  gathered[1] = (vector)_mm256_permute2f128_pd(odd_01, odd_23, 0x20);
  gathered[2] = (vector)_mm256_permute2f128_pd(even_01, even_23, 0x31);
  gathered[3] = (vector)_mm256_permute2f128_pd(odd_01, odd_23, 0x31);
}

#include "lanes_kernel.h"
#include "interaction_kernel.h"

void fl_lanes_avx2(const lanes_robot *robot, const lanes_batch *batch) {
  answer_in_lanes(robot, batch);
}

void fl_interaction_avx2(const interaction_model *model, const real *force,
                         interaction_effect *effect) {
  add_interaction(model, force, effect);
}

#ifdef __clang__
#pragma clang attribute pop
#else
#pragma GCC pop_options
#endif
#endif
