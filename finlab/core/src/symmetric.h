/* Symmetric 6 x 6 matrices that are summed of few vectors and then solved with, as in each step of
   Newton's method. */
#ifndef FL_SYMMETRIC_H
#define FL_SYMMETRIC_H
#include "pairs.h"

#ifdef HAS_PAIRS

/* Rows in pairs of columns, from the pair with the diagonal on. */
typedef struct {
  pair row[6][3];
} symmetric;

static inline symmetric no_matrix(void) {
  const symmetric zero = {{{{0}}}};
  return zero;
}

/* Adds x y', which is symmetric, or in the sum with another one. Written out, so that compilers
   keep a sum of many in registers. */
static inline void add_product(symmetric *H, const pair *x, const pair *y) {
  H->row[0][0] += both(x[0][0]) * y[0];
  H->row[0][1] += both(x[0][0]) * y[1];
  H->row[0][2] += both(x[0][0]) * y[2];
  H->row[1][0] += both(x[0][1]) * y[0];
  H->row[1][1] += both(x[0][1]) * y[1];
  H->row[1][2] += both(x[0][1]) * y[2];
  H->row[2][1] += both(x[1][0]) * y[1];
  H->row[2][2] += both(x[1][0]) * y[2];
  H->row[3][1] += both(x[1][1]) * y[1];
  H->row[3][2] += both(x[1][1]) * y[2];
  H->row[4][2] += both(x[2][0]) * y[2];
  H->row[5][2] += both(x[2][1]) * y[2];
}

/* Adds weight b b'. */
static inline void add_square(symmetric *H, const real *b, real weight) {
  const pair x[3] = {pair_at(b), pair_at(b + 2), pair_at(b + 4)};
  const pair weights = both(weight);
  const pair weighted[3] = {weights * x[0], weights * x[1], weights * x[2]};
  add_product(H, weighted, x);
}

/* A pair of a column of B D: x times bx and y times by. */
static inline pair mixed_pair(real x, pair bx, real y, pair by) {
  return both(x) * bx + both(y) * by;
}

/* Adds B D B', of a plane: B = (bx, by), D = (xx, xy; xy, yy). */
static inline void add_plane(symmetric *H, const real *bx, const real *by, real xx, real xy,
                             real yy) {
  const pair x[3] = {pair_at(bx), pair_at(bx + 2), pair_at(bx + 4)};
  const pair y[3] = {pair_at(by), pair_at(by + 2), pair_at(by + 4)};
  const pair DBx[3] = {mixed_pair(xx, x[0], xy, y[0]), mixed_pair(xx, x[1], xy, y[1]),
                       mixed_pair(xx, x[2], xy, y[2])};
  const pair DBy[3] = {mixed_pair(xy, x[0], yy, y[0]), mixed_pair(xy, x[1], yy, y[1]),
                       mixed_pair(xy, x[2], yy, y[2])};
  add_product(H, DBx, x);
  add_product(H, DBy, y);
}

/* Adds weight M, of a matrix both of whose triangles are stored. */
static inline void add_matrix(symmetric *H, const real M[6][6], real weight) {
  for (int i = 0; i < 6; i++) {
    for (int p = i / 2; p < 3; p++) H->row[i][p] += both(weight) * pair_at(M[i] + 2 * p);
  }
}

static inline void add_to_diagonal(symmetric *H, real x) {
  for (int i = 0; i < 6; i++) H->row[i][i / 2][i % 2] += x;
}

static inline real trace_of(const symmetric *H) {
  real sum = 0;
  for (int i = 0; i < 6; i++) sum += H->row[i][i / 2][i % 2];
  return sum;
}

/* The lower triangle, as linear_algebra.c takes it. */
static inline void lower_triangle(const symmetric *H, real to[6][6]) {
  for (int i = 0; i < 6; i++) {
    for (int j = 0; j <= i; j++) to[i][j] = H->row[j][i / 2][i % 2];
  }
}

/* Takes a share of row U from a row, from a pair of columns on. */
static inline __attribute__((always_inline)) void take_off(pair *row, const pair *U, real share,
                                                           int first) {
  if (first <= 0) row[0] -= both(share) * U[0];
  if (first <= 1) row[1] -= both(share) * U[1];
  row[2] -= both(share) * U[2];
}

/* Takes row k of H from those below it, and from the right side r, so that they have no column k
   any more: H = L D L', of which row k now is that of D L'. Returns 1 / D of it, 0 where H is
   singular to rounding. Written out for the same reason as add_product. */
static inline __attribute__((always_inline)) real eliminate(symmetric *H, pair *r, int k) {
  const pair *U = H->row[k];
  const real pivot = U[k / 2][k % 2];
  if (!(pivot > 0)) return 0;
  const real inverse = 1 / pivot;
  const real right = r[k / 2][k % 2];
  pair L[3]; /* column k of L, but for zeros and ones above */
  L[0] = both(inverse) * U[0];
  L[1] = both(inverse) * U[1];
  L[2] = both(inverse) * U[2];
  if (k < 1) take_off(H->row[1], U, L[0][1], 0);
  if (k < 2) take_off(H->row[2], U, L[1][0], 1);
  if (k < 3) take_off(H->row[3], U, L[1][1], 1);
  if (k < 4) take_off(H->row[4], U, L[2][0], 2);
  if (k < 5) take_off(H->row[5], U, L[2][1], 2);
  if (k < 1) r[0][1] -= L[0][1] * right;
  if (k < 3) {
    if (k < 2) r[1][0] -= L[1][0] * right;
    r[1][1] -= L[1][1] * right;
  }
  if (k < 5) {
    if (k < 4) r[2][0] -= L[2][0] * right;
    r[2][1] -= L[2][1] * right;
  }
  return inverse;
}

/* Number k of the solution, from those behind it. */
static inline __attribute__((always_inline)) real substitute(const symmetric *H, const pair *r,
                                                             real inverse, const real *x, int k) {
  const pair *U = H->row[k];
  real sum = r[k / 2][k % 2];
  if (k < 1) sum -= U[0][1] * x[1];
  if (k < 2) sum -= U[1][0] * x[2];
  if (k < 3) sum -= U[1][1] * x[3];
  if (k < 4) sum -= U[2][0] * x[4];
  if (k < 5) sum -= U[2][1] * x[5];
  return inverse * sum;
}

/* Solves H x = right; 0 where H is singular to rounding. H is used up. */
static inline int solve_symmetric(symmetric *H, const real *right, real *x) {
  pair r[3] = {pair_at(right), pair_at(right + 2), pair_at(right + 4)};
  real inverse[6];
  inverse[0] = eliminate(H, r, 0);
  inverse[1] = eliminate(H, r, 1);
  inverse[2] = eliminate(H, r, 2);
  inverse[3] = eliminate(H, r, 3);
  inverse[4] = eliminate(H, r, 4);
  inverse[5] = eliminate(H, r, 5);
  for (int k = 0; k < 6; k++) {
    if (!(inverse[k] > 0)) return 0;
  }
  x[5] = substitute(H, r, inverse[5], x, 5);
  x[4] = substitute(H, r, inverse[4], x, 4);
  x[3] = substitute(H, r, inverse[3], x, 3);
  x[2] = substitute(H, r, inverse[2], x, 2);
  x[1] = substitute(H, r, inverse[1], x, 1);
  x[0] = substitute(H, r, inverse[0], x, 0);
  return 1;
}

#else

/* The lower triangle, as linear_algebra.c takes it. */
typedef struct {
  real row[6][6];
} symmetric;

static inline symmetric no_matrix(void) {
  const symmetric zero = {{{0}}};
  return zero;
}

static inline void add_square(symmetric *H, const real *b, real weight) {
  fl_add_square(H->row, b, weight);
}

static inline void add_plane(symmetric *H, const real *bx, const real *by, real xx, real xy,
                             real yy) {
  for (int i = 0; i < 6; i++) {
    const real DBx = xx * bx[i] + xy * by[i];
    const real DBy = xy * bx[i] + yy * by[i];
    for (int j = 0; j <= i; j++) H->row[i][j] += DBx * bx[j] + DBy * by[j];
  }
}

static inline void add_matrix(symmetric *H, const real M[6][6], real weight) {
  for (int i = 0; i < 6; i++) {
    for (int j = 0; j <= i; j++) H->row[i][j] += weight * M[i][j];
  }
}

static inline void add_to_diagonal(symmetric *H, real x) {
  for (int i = 0; i < 6; i++) H->row[i][i] += x;
}

static inline real trace_of(const symmetric *H) {
  real sum = 0;
  for (int i = 0; i < 6; i++) sum += H->row[i][i];
  return sum;
}

static inline void lower_triangle(const symmetric *H, real to[6][6]) {
  memcpy(to, H->row, sizeof H->row);
}

static inline int solve_symmetric(symmetric *H, const real *right, real *x) {
  if (!fl_factor(H->row)) return 0;
  fl_solve(H->row, right, x);
  return 1;
}

#endif
#endif
