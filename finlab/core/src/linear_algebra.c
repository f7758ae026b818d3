/* Small dense systems. */
#include "internal.h"

real fl_wrap_angle(real angle) { return angle - 2 * PI * FLOOR((angle + PI) / (2 * PI)); }

/* Adds b b' times a weight to a lower triangle. */
void fl_add_square(real h[6][6], const real *b, real weight) {
  for (int j = 0; j < 6; j++) {
    const real own = weight * b[j];
    for (int k = 0; k <= j; k++) h[j][k] += own * b[k];
  }
}

real fl_trace(real h[6][6]) {
  real sum = 0;
  for (int j = 0; j < 6; j++) sum += h[j][j];
  return sum;
}

/* Turns the lower triangle of a (6 x 6) into L and 1 / D of L D L'; 0 where a is singular to rounding. */
int fl_factor(real a[6][6]) {
  for (int i = 0; i < 6; i++) {
    real row[6], rest = a[i][i];
    for (int j = 0; j < i; j++) row[j] = a[i][j] - dot(row, a[j], j);
    for (int j = 0; j < i; j++) a[i][j] = row[j] * a[j][j], rest -= row[j] * a[i][j];
    if (!(rest > 0)) return 0;
    a[i][i] = 1 / rest;
  }
  return 1;
}

void fl_solve(real a[6][6], const real *right, real *x) {
  for (int i = 0; i < 6; i++) x[i] = right[i] - dot(a[i], x, i);
  for (int i = 5; i >= 0; i--) {
    x[i] *= a[i][i];
    for (int k = 5; k > i; k--) x[i] -= a[k][i] * x[k];
  }
}
