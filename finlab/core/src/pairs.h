/* Pairs of numbers, with which compilers of the GNU family do the same arithmetic on two numbers at
   once, by SSE2 or NEON. All operations are those of IEEE 754 in one order, without contraction, so
   the bits are the same on all such machines. Other compilers and processors, single precision and
   -DFL_NO_PAIRS take the loops beside them. */
#ifndef FL_PAIRS_H
#define FL_PAIRS_H
#include "internal.h"

#ifdef FL_PAIRS_OF_LINES
#define HAS_PAIRS

typedef real pair __attribute__((vector_size(2 * sizeof(real))));

static inline pair both(real x) { return (pair){x, x}; }

static inline pair pair_at(const real *numbers) {
  pair p;
  memcpy(&p, numbers, sizeof p);
  return p;
}

static inline void write_pair(pair p, real *numbers) { memcpy(numbers, &p, sizeof p); }

static inline pair root_of_pair(pair p) { return (pair){SQRT(p[0]), SQRT(p[1])}; }

static inline real sum_of_pair(pair p) { return p[0] + p[1]; }

#endif
#endif
