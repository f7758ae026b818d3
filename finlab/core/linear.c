/* Small dense systems. */
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
