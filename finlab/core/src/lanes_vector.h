/* Vectors of LANES numbers, which the file that includes this one defines: what all widths write
   alike. No guard: each kernel has its own.

   A vector of one number is the number itself, so that one formula serves compilers without
   vectors, single precision, and what is asked for one by one. */
#ifndef FL_SINGLE
#define ROUNDER 0x1.8p52 /* 1.5 * 2^52: a number plus it, less it, is rounded to an integer */
#endif
#if LANES == 1
typedef real vector;

static inline vector lanes_of(real x) { return x; }

static inline vector root_of(vector x) { return SQRT(x); }

static inline vector larger_of(vector a, vector b) { return larger(a, b); }

static inline vector smaller_of(vector a, vector b) { return smaller(a, b); }

#else
typedef real vector __attribute__((vector_size(sizeof(real) * LANES)));
typedef long long mask __attribute__((vector_size(sizeof(real) * LANES))); /* -1 or 0 */

/* The same number in all lanes. */
static inline vector lanes_of(real x) { return x - (vector){0}; }

static inline void set_mask(mask *m, int lane, int is_set) { ((long long *)m)[lane] = -is_set; }

/* A number for each lane, by its index. */
static inline vector gather(const real *numbers, mask index) {
  vector gathered = {0};
  for (int l = 0; l < LANES; l++) gathered[l] = numbers[index[l]];
  return gathered;
}
#endif

/* Sets one lane of a vector that lies in memory: where compilers do not know the index,
   v[lane] = ... would select among all lanes. */
static inline void set_lane(vector *x, int lane, real number) { ((real *)x)[lane] = number; }
