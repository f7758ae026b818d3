/* An extended Kalman filter of a robot of which much is not known, with what jumps of its state at
   several moments of the past would have made of it; finlab/swim/control/hypotheses.py calls it and
   has the equations with their source.

   A state has d numbers, of which the first 9 move by themselves and the others only drift. Of the
   d numbers the first `active` are in doubt; those behind them are known exactly, and a jump of one
   of them stays as it is. A jump is of c columns: the number of the state of each. What a jump of 1
   of each column makes of the state is a matrix Sigma (d, c) of each moment, its information Lambda
   (c, c), its score eta (c,). The moments stand in slots, and `slots` names those that count. */
#include "internal.h"

enum { MOVING = 9, MOST_MEASURED = 12, MOST_STATES = 49 + 6 * FL_MOST, TILE = 300 };

typedef struct {
  const int *columns; /* numbers of the state that jump (c,) */
  int most;           /* slots that there are */
  int used;           /* how many of them, the first, may count */
  int d;
  int active;
  int c;
  real *state;       /* (d,) */
  real *covariance;  /* P (d, d) */
  real *sensitivity; /* Sigma (d, most, c) */
  real *information; /* Lambda (most, c, c) */
  real *score;       /* eta (most, c) */
} jump_filter;

typedef struct {
  const real *rows;       /* H (measured, d) */
  const real *innovation; /* (measured,) */
  const real *variance;   /* (measured,) */
  int measured;
  real most_distance;
} jump_sample;

/* row (width,) += a0 b0 + a1 b1 + a2 b2 + a3 b3, of rows b that are `stride` apart: four at a time,
   since a sum waits longer for its memory than for its products. */
static void add_four(const real *a, const real *b, int stride, int width, real *restrict row) {
  const real *restrict b0 = b;
  const real *restrict b1 = b + stride;
  const real *restrict b2 = b1 + stride;
  const real *restrict b3 = b2 + stride;
  for (int j = 0; j < width; j++) {
    row[j] = row[j] + a[0] * b0[j] + a[1] * b1[j] + a[2] * b2[j] + a[3] * b3[j];
  }
}

/* row (width,) += a b, of `count` rows b that are `stride` apart. */
static void add_rows(const real *a, int count, const real *b, int stride, int width, real *row) {
  int k = 0;
  for (; k + 4 <= count; k += 4) {
    if (a[k] == 0 && a[k + 1] == 0 && a[k + 2] == 0 && a[k + 3] == 0) continue;
    add_four(a + k, b + (size_t)k * (size_t)stride, stride, width, row);
  }
  for (; k < count; k++) {
    const real *restrict from = b + (size_t)k * (size_t)stride;
    if (a[k] == 0) continue;
    for (int j = 0; j < width; j++) row[j] += a[k] * from[j];
  }
}

/* product (rows, width) of M (rows, d) and of the columns of `right` from its pointer on, whose
   rows are `stride` apart. */
static void multiply_rows(const real *M, int rows, int d, int active, const real *right, int stride,
                          int width, real *product) {
  memset(product, 0, (size_t)(rows * width) * sizeof(real));
  for (int i = 0; i < rows; i++) {
    add_rows(M + i * d, active, right, stride, width, product + i * width);
  }
}

/* P <- F P F^T + Q, Q diagonal. */
static void predict_covariance(const real *F, const real *Q, int d, int active, real *P) {
  real FP[MOVING * MOST_STATES];
  multiply_rows(F, MOVING, d, active, P, d, active, FP);
  for (int i = 0; i < MOVING; i++) {
    for (int j = 0; j <= i; j++) {
      P[i * d + j] = dot(FP + i * active, F + j * d, active);
      P[j * d + i] = P[i * d + j];
    }
    for (int j = MOVING; j < active; j++) {
      P[i * d + j] = FP[i * active + j];
      P[j * d + i] = P[i * d + j];
    }
  }
  for (int i = 0; i < active; i++) P[i * d + i] += Q[i];
}

/* Scales rows and columns of P so that no variance is beyond its limit. */
static void limit_variance(const real *limit, int d, int active, real *P) {
  for (int i = 0; i < active; i++) {
    const real variance = P[i * d + i];
    if (!(variance > limit[i])) continue;
    const real scale = SQRT(limit[i] / variance);
    for (int j = 0; j < active; j++) {
      P[i * d + j] *= scale;
      P[j * d + i] *= scale;
    }
  }
}

/* Moments whose columns are moved at once: some hundred columns, which the nearest cache holds. */
static int moments_at_once(const jump_filter *all) {
  if (all->c > TILE) return 1;
  return TILE / all->c;
}

/* product (rows, moments c) of M (rows, d) and Sigma of moments from `first` on; what is known
   exactly has jumped by its own column alone. */
static void multiply_jumps(const jump_filter *all, const real *M, int rows, int first, int moments,
                           real *product) {
  const int c = all->c;
  const int width = moments * c;
  const real *Sigma = all->sensitivity + first * c;
  multiply_rows(M, rows, all->d, all->active, Sigma, all->most * c, width, product);
  for (int j = 0; j < c; j++) {
    const int number = all->columns[j];
    if (number < all->active) continue;
    for (int i = 0; i < rows; i++) {
      for (int o = 0; o < moments; o++) product[i * width + o * c + j] += M[i * all->d + number];
    }
  }
}

/* Turns the lower triangle of S (m, m) into L of S = L L^T; 0 where S is not positive definite. */
static int factor_cholesky(real S[MOST_MEASURED][MOST_MEASURED], int m) {
  for (int i = 0; i < m; i++) {
    for (int j = 0; j < i; j++) S[i][j] = (S[i][j] - dot(S[i], S[j], j)) / S[j][j];
    const real pivot = S[i][i] - dot(S[i], S[i], i);
    if (!(pivot > 0)) return 0;
    S[i][i] = SQRT(pivot);
  }
  return 1;
}

/* rows (m, width) <- L^-1 rows. */
static void whiten_rows(real L[MOST_MEASURED][MOST_MEASURED], int m, int width, real *rows) {
  for (int i = 0; i < m; i++) {
    real *row = rows + i * width;
    for (int k = 0; k < i; k++) {
      const real factor = L[i][k];
      const real *before = rows + k * width;
      for (int j = 0; j < width; j++) row[j] -= factor * before[j];
    }
    const real over = 1 / L[i][i];
    for (int j = 0; j < width; j++) row[j] *= over;
  }
}

/* matrix (count, width) <- matrix - left^T right, of left (m, count) and right (m, width); rows of
   the matrix are `stride` apart. */
static void subtract_product(const real *left, const real *right, int m, int count, int width,
                             int stride, real *matrix) {
  for (int i = 0; i < count; i++) {
    real column[MOST_MEASURED];
    for (int r = 0; r < m; r++) column[r] = -left[r * count + i];
    add_rows(column, m, right, width, width, matrix + (size_t)i * (size_t)stride);
  }
}

/* Weighs the jumps of one moment: Lambda += V^T V, eta += V^T whitened. The rows of V (m, c) are
   `stride` apart. */
static void weigh_jump(const real *V, int stride, const real *whitened, int m, int c, real *Lambda,
                       real *eta) {
  for (int r = 0; r < m; r++) {
    const real *restrict of_row = V + r * stride;
    for (int j = 0; j < c; j++) eta[j] += whitened[r] * of_row[j];
    for (int i = 0; i < c; i++) {
      const real factor = of_row[i];
      real *restrict row = Lambda + i * c;
      for (int j = 0; j < c; j++) row[j] += factor * of_row[j];
    }
  }
}

static void predict_jumps(const jump_filter *all, const real *transition, const real *noise,
                          const real *limit) {
  const int c = all->c;
  const size_t stride = (size_t)(all->most * c);
  predict_covariance(transition, noise, all->d, all->active, all->covariance);
  limit_variance(limit, all->d, all->active, all->covariance);
  const int at_once = moments_at_once(all);
  for (int first = 0; first < all->used; first += at_once) {
    const int left = all->used - first;
    const int moments = left < at_once ? left : at_once;
    const int width = moments * c;
    real moved[MOVING * MOST_STATES];
    multiply_jumps(all, transition, MOVING, first, moments, moved);
    for (int i = 0; i < MOVING; i++) {
      real *row = all->sensitivity + (size_t)i * stride + first * c;
      memcpy(row, moved + i * width, (size_t)width * sizeof(real));
    }
  }
}

static real update_jumps(const jump_filter *all, const jump_sample *sample) {
  const int d = all->d;
  const int c = all->c;
  const int m = sample->measured;
  const int active = all->active;
  const real *rows = sample->rows;
  real gain[MOST_MEASURED * MOST_STATES]; /* G = L^-1 H P (m, active), K = G^T L^-1 */
  real S[MOST_MEASURED][MOST_MEASURED];
  real whitened[MOST_MEASURED];
  multiply_rows(rows, m, d, active, all->covariance, d, active, gain);
  for (int i = 0; i < m; i++) {
    for (int j = 0; j <= i; j++) S[i][j] = dot(gain + i * active, rows + j * d, active);
    S[i][i] += sample->variance[i];
    whitened[i] = sample->innovation[i];
  }
  if (!factor_cholesky(S, m)) return -1;
  whiten_rows(S, m, 1, whitened);
  const real distance = dot(whitened, whitened, m);
  if (!(distance < sample->most_distance)) return -1;
  whiten_rows(S, m, active, gain);
  for (int i = 0; i < active; i++) {
    for (int r = 0; r < m; r++) all->state[i] += gain[r * active + i] * whitened[r];
  }
  subtract_product(gain, gain, m, active, active, d, all->covariance);
  const int at_once = moments_at_once(all);
  for (int first = 0; first < all->used; first += at_once) {
    const int left = all->used - first;
    const int moments = left < at_once ? left : at_once;
    const int width = moments * c;
    real V[MOST_MEASURED * MOST_STATES]; /* L^-1 H Sigma (m, moments c) */
    multiply_jumps(all, rows, m, first, moments, V);
    whiten_rows(S, m, width, V);
    for (int o = 0; o < moments; o++) {
      const size_t slot = (size_t)(first + o);
      weigh_jump(V + o * c, width, whitened, m, c, all->information + slot * (size_t)(c * c),
                 all->score + slot * (size_t)c);
    }
    /* Sigma <- Sigma - G^T V */
    real *Sigma = all->sensitivity + first * c;
    subtract_product(gain, V, m, active, width, all->most * c, Sigma);
  }
  return distance;
}

void fl_jumps_predict(const fl_real *transition, const fl_real *noise, const fl_real *limit,
                      const int *columns, int most, int used, int d, int active, int c,
                      fl_real *covariance, fl_real *sensitivity) {
  const jump_filter all = {columns, most, used, d, active, c, 0, covariance, sensitivity, 0, 0};
  predict_jumps(&all, transition, noise, limit);
}

fl_real fl_jumps_update(const fl_real *rows, const fl_real *innovation, const fl_real *variance,
                        int measured, fl_real most_distance, const int *columns, int most, int used,
                        int d, int active, int c, fl_real *state, fl_real *covariance,
                        fl_real *sensitivity, fl_real *information, fl_real *score) {
  const jump_filter all = {columns, most,       used,        d,           active, c,
                           state,   covariance, sensitivity, information, score};
  const jump_sample sample = {rows, innovation, variance, measured, most_distance};
  return update_jumps(&all, &sample);
}
