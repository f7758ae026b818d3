/* A Kalman filter whose measurements are single numbers of its state, each with noise of its own;
   called by finlab/swim/control/observer.py. */
#include "internal.h"

enum { MOST_STATES = 16 };

void fl_kalman_predict(const real *transition, const real *noise, int size, real *covariance) {
  const size_t n = (size_t)size;
  real product[MOST_STATES * MOST_STATES]; /* F P */
  for (size_t i = 0; i < n; i++) {
    real *row = product + i * n;
    for (size_t j = 0; j < n; j++) row[j] = 0;
    for (size_t k = 0; k < n; k++) {
      const real factor = transition[i * n + k];
      if (factor == 0) continue;
      for (size_t j = 0; j < n; j++) row[j] += factor * covariance[k * n + j];
    }
  }
  /* P <- F P F^T + Q */
  for (size_t i = 0; i < n; i++) {
    for (size_t j = 0; j < n; j++) {
      covariance[i * n + j] = dot(product + i * n, transition + j * n, size);
    }
    covariance[i * n + i] += noise[i];
  }
}

void fl_kalman_correct(const real *variance, const real *innovation, int first, int last, int size,
                       real *state, real *covariance) {
  const size_t n = (size_t)size;
  real change[MOST_STATES] = {0}; /* of the state, by the measurements so far */
  for (int k = first; k < last; k++) {
    /* One measurement after the other comes to the same as all at once, since their noise is
       independent: S = P_kk + R_k, K = P_k / S, x <- x + K (innovation), P <- P - K P_k^T. */
    real column[MOST_STATES];
    for (size_t i = 0; i < n; i++) column[i] = covariance[i * n + (size_t)k];
    const real S = column[k] + variance[k];
    const real left = innovation[k] - change[k];
    for (size_t i = 0; i < n; i++) {
      const real gain = column[i] / S;
      change[i] += gain * left;
      for (size_t j = 0; j < n; j++) covariance[i * n + j] -= gain * column[j];
    }
  }
  for (size_t i = 0; i < n; i++) state[i] += change[i];
}
