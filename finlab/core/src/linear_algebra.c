/* Small dense systems: symmetric 6 x 6 matrices, of which the lower triangle is stored. */
#include "internal.h"

/* The same angle [rad] within [-pi, pi). */
real fl_wrap_angle(real angle) { return angle - 2 * PI * FLOOR((angle + PI) / (2 * PI)); }

/* Adds weight b b' to the lower triangle of H. */
void fl_add_square(real H[6][6], const real *b, real weight) {
  for (int row = 0; row < 6; row++) {
    const real scaled = weight * b[row];
    for (int col = 0; col <= row; col++) H[row][col] += scaled * b[col];
  }
}

/* Adds b'x = value, with a weight, to the normal equations H x = right of least squares. */
void fl_add_equation(real H[6][6], real *right, const real *b, real weight, real value) {
  fl_add_square(H, b, weight);
  for (int j = 0; j < 6; j++) right[j] += weight * value * b[j];
}

real fl_trace(real H[6][6]) {
  real sum = 0;
  for (int k = 0; k < 6; k++) sum += H[k][k];
  return sum;
}

/* Turns the lower triangle of A into L and 1 / D of A = L D L'; 0 where A is singular to
   rounding. */
int fl_factor(real A[6][6]) {
  for (int i = 0; i < 6; i++) {
    real LD[6]; /* row i of L D */
    real pivot = A[i][i];
    for (int j = 0; j < i; j++) LD[j] = A[i][j] - dot(LD, A[j], j);
    for (int j = 0; j < i; j++) {
      A[i][j] = LD[j] * A[j][j];
      pivot -= LD[j] * A[i][j];
    }
    if (!(pivot > 0)) return 0;
    A[i][i] = 1 / pivot;
  }
  return 1;
}

/* Solves L D L' x = right for a factor of fl_factor: L first, then D and L' together, from
   the last row up. */
void fl_solve(real factor[6][6], const real *right, real *x) {
  for (int i = 0; i < 6; i++) x[i] = right[i] - dot(factor[i], x, i);
  for (int i = 5; i >= 0; i--) {
    x[i] *= factor[i][i];
    for (int k = 5; k > i; k--) x[i] -= factor[k][i] * x[k];
  }
}

/* Whether all values are finite and their sizes no larger than so much. */
int fl_are_within(const real *values, int count, real most) {
  for (int k = 0; k < count; k++) {
    if (!(FABS(values[k]) <= most)) return 0; /* NaN, too */
  }
  return 1;
}
