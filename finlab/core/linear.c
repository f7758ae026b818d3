/* Small dense systems, and the affine combination of few points that comes nearest to another. */
#include "inner.h"

real wrapped(real angle) { return angle - 2 * PI * FLOOR((angle + PI) / (2 * PI)); }

/* Cholesky factor of the lower triangle of a (n x n), its diagonal inverted; 0 where a is singular to rounding. */
int cholesky(real a[6][6], real factor[6][6], int n) {
  for (int i = 0; i < n; i++)
    for (int j = 0; j <= i; j++) {
      real sum = a[i][j] - dot(factor[i], factor[j], j);
      if (i > j)
        factor[i][j] = sum * factor[j][j];
      else if (sum > 0)
        factor[i][i] = 1 / SQRT(sum);
      else
        return 0;
    }
  return 1;
}

void solve(real factor[6][6], const real *right, real *x, int n) {
  for (int i = 0; i < n; i++) x[i] = (right[i] - dot(factor[i], x, i)) * factor[i][i];
  for (int i = n - 1; i >= 0; i--) {
    real sum = x[i];
    for (int k = i + 1; k < n; k++) sum -= factor[k][i] * x[k];
    x[i] = sum * factor[i][i];
  }
}

/* Shares, which add up to 1, of points that come nearest to a target; a point that depends on those before it
   gets 0. By Gram-Schmidt, twice, as points near to each other are nearly dependent. */
void affine(real point[][6], int count, const real *target, real *share) {
  real q[FL_POINTS][6], r[FL_POINTS][FL_POINTS], right[FL_POINTS], rest[6];
  for (int k = 0; k < 6; k++) rest[k] = target[k] - point[0][k];
  for (int j = 1; j < count; j++) {
    real size = 0;
    for (int k = 0; k < 6; k++) q[j][k] = point[j][k] - point[0][k];
    size = SQRT(dot(q[j], q[j], 6));
    for (int i = 1; i < j; i++) r[i][j] = 0;
    for (int twice = 0; twice < 2; twice++)
      for (int i = 1; i < j; i++) {
        real part = dot(q[i], q[j], 6);
        r[i][j] += part;
        for (int k = 0; k < 6; k++) q[j][k] -= part * q[i][k];
      }
    r[j][j] = SQRT(dot(q[j], q[j], 6));
    int dependent = r[j][j] <= ROUNDING * size;
    if (dependent) r[j][j] = 0;
    for (int k = 0; k < 6; k++) q[j][k] = dependent ? 0 : q[j][k] / r[j][j];
    right[j] = dot(q[j], rest, 6);
    for (int k = 0; k < 6; k++) rest[k] -= right[j] * q[j][k];
  }
  share[0] = 1;
  for (int j = count - 1; j > 0; j--) {
    real sum = right[j];
    for (int k = j + 1; k < count; k++) sum -= r[j][k] * share[k];
    share[j] = r[j][j] > 0 ? sum / r[j][j] : 0;
    share[0] -= share[j];
  }
}
