/* How likely jumps of an actuator are, by what the filter of jump_filter.c has gathered, and of two
   losses at once and of a wrench that no fault explains; finlab/swim/control/hypotheses.py calls it
   and has the equations with their source. */
#include "internal.h"

enum { MOST_NUMBERS = 6, AXES = 6, OWN_COLUMNS = 3 };

#define FAR_BELOW R(40.0) /* logarithm by which an exponential is below another one and is 0 */

/* What a hypothesis says of an actuator, as a row of the pointer `targets`. */
typedef struct {
  real strength;          /* mean */
  real strength_variance; /* of it */
  real sticks;            /* 0: no; 1: as it was at the moment; 2: at anything */
} target_numbers;

/* An actuator, as a row of the pointer `actuators`. */
typedef struct {
  real count;    /* of its columns: its strength, and 0 to 2 of what it gives where it sticks */
  real held;     /* the first of its numbers of what it gives, among those of all */
  real is_angle; /* 1 where it sticks at an angle */
  real largest;  /* force [N]; 1 of an angle */
} actuator_numbers;

/* How a jump is spread, as a row of the pointer `spread`. */
typedef struct {
  real near_share; /* a force sticks within this share of what it was */
  real near_floor; /* and of the largest one */
  real near_angle; /* cosine and sine of an angle that sticks */
  real far_share;  /* a force that sticks at anything, over the largest one */
  real far_angle;  /* cosine and sine of any angle */
  real nothing;    /* share of the largest force below which what sticks is lost */
} spread_numbers;

/* A jump of k numbers: its prior and what is known of it. */
typedef struct {
  int k;
  real Lambda[MOST_NUMBERS][MOST_NUMBERS];
  real eta[MOST_NUMBERS];
  real mean[MOST_NUMBERS];
  real variance[MOST_NUMBERS];
} jump;

static jump jump_of_columns(const real *Lambda, const real *eta, int c, const int *columns, int k) {
  jump j;
  j.k = k;
  for (int row = 0; row < k; row++) {
    j.eta[row] = eta[columns[row]];
    for (int col = 0; col < k; col++) {
      j.Lambda[row][col] = Lambda[columns[row] * c + columns[col]];
    }
  }
  return j;
}

/* Logarithm of the likelihood ratio of a jump with the prior N(m, C), C diagonal, to none:

     eta^T m - m^T Lambda m / 2 + r^T (1 + C Lambda)^-1 C r / 2 - log det(1 + C Lambda) / 2

   with r = eta - Lambda m; by 1 + D Lambda D = L diag(pivots) L^T, D D = C. */
static real log_ratio(const jump *j) {
  real linear = 0;
  real D[MOST_NUMBERS];
  real y[MOST_NUMBERS]; /* D r, then L^-1 D r */
  real A[MOST_NUMBERS][MOST_NUMBERS];
  int in_doubt[MOST_NUMBERS];
  int count = 0;
  for (int row = 0; row < j->k; row++) {
    const real of_mean = dot(j->Lambda[row], j->mean, j->k);
    linear += (j->eta[row] - R(0.5) * of_mean) * j->mean[row];
    if (!(j->variance[row] > 0)) continue; /* known exactly */
    in_doubt[count] = row;
    D[count] = SQRT(j->variance[row]);
    y[count] = D[count] * (j->eta[row] - of_mean);
    count++;
  }
  real quadratic = 0;
  real determinant = 1;
  for (int row = 0; row < count; row++) {
    const real *Lambda = j->Lambda[in_doubt[row]];
    real L_pivots[MOST_NUMBERS]; /* row of L times the pivots */
    real pivot = 1 + D[row] * Lambda[in_doubt[row]] * D[row];
    for (int col = 0; col < row; col++) {
      real sum = D[row] * Lambda[in_doubt[col]] * D[col];
      for (int l = 0; l < col; l++) sum -= L_pivots[l] * A[col][l];
      L_pivots[col] = sum;
      A[row][col] = sum / A[col][col];
      pivot -= sum * A[row][col];
      y[row] -= A[row][col] * y[col];
    }
    A[row][row] = pivot;
    quadratic += y[row] * y[row] / pivot;
    determinant *= pivot;
  }
  return linear + R(0.5) * (quadratic - LOG(determinant));
}

/* The prior of a jump of an actuator by a target: what it may become less what is believed of it,
   `held` and `moved` of what it gives where it sticks and what it would give. */
static void set_prior(const target_numbers *target, const actuator_numbers *actuator,
                      const spread_numbers *spread, real strength, const real *held,
                      const real *moved, jump *j) {
  j->mean[0] = target->strength - strength;
  j->variance[0] = target->strength_variance;
  for (int l = 1; l < j->k; l++) {
    j->mean[l] = -held[l - 1];
    real deviation = 0;
    if (target->sticks == 1) {
      const real share = spread->near_share * FABS(moved[l - 1]);
      const real of_force = share + spread->near_floor * actuator->largest;
      deviation = actuator->is_angle > 0 ? spread->near_angle : of_force;
      j->mean[l] += moved[l - 1];
    } else if (target->sticks == 2) {
      const real of_force = spread->far_share * actuator->largest;
      deviation = actuator->is_angle > 0 ? spread->far_angle : of_force;
    }
    j->variance[l] = deviation * deviation;
  }
}

void fl_jumps_of_actuators(const fl_real *information, const fl_real *score, const int *slots,
                           int count, int c, const fl_real *actuators, int n, int h,
                           const fl_real *targets, int kinds, const fl_real *spread,
                           const fl_real *strength, const fl_real *held, const fl_real *moved,
                           const fl_real *prior, const fl_real *span, fl_real temper,
                           fl_real *log_odds, fl_real *mean, fl_real *variance) {
  const actuator_numbers *actuator = (const actuator_numbers *)actuators;
  const target_numbers *target = (const target_numbers *)targets;
  const spread_numbers *numbers = (const spread_numbers *)spread;
  for (int o = 0; o < count; o++) {
    const size_t slot = (size_t)slots[o];
    const real *Lambda = information + slot * (size_t)(c * c);
    const real *eta = score + slot * (size_t)c;
    for (int i = 0; i < n; i++) {
      const int first = (int)actuator[i].held;
      const int columns[OWN_COLUMNS] = {i, n + first, n + first + 1};
      jump j = jump_of_columns(Lambda, eta, c, columns, (int)actuator[i].count);
      const real *held_now = held + slot * (size_t)h + first;
      const real *moved_now = moved + slot * (size_t)h + first;
      const real least = numbers->nothing * actuator[i].largest;
      for (int t = 0; t < kinds; t++) {
        real *odds = log_odds + (o * n + i) * kinds + t;
        *odds = prior[i * kinds + t];
        if (*odds == -INFINITY) continue;
        const int keeps_force = target[t].sticks == 1 && !(actuator[i].is_angle > 0);
        if (keeps_force && FABS(moved_now[0]) < least) {
          *odds = -INFINITY;
          continue;
        }
        set_prior(&target[t], &actuator[i], numbers, strength[slot * (size_t)n + (size_t)i],
                  held_now, moved_now, &j);
        *odds += log_ratio(&j) / temper + span[o];
        const size_t offset = (size_t)((o * n + i) * kinds + t) * OWN_COLUMNS;
        memcpy(mean + offset, j.mean, (size_t)j.k * sizeof(real));
        memcpy(variance + offset, j.variance, (size_t)j.k * sizeof(real));
      }
    }
  }
}

void fl_jumps_of_pairs(const fl_real *information, const fl_real *score, const int *slots,
                       int count, int c, int n, const fl_real *strength, const int *works,
                       const fl_real *span, fl_real log_rate, fl_real temper, fl_real *log_odds) {
  for (int o = 0; o < count; o++) {
    const size_t slot = (size_t)slots[o];
    const real *Lambda = information + slot * (size_t)(c * c);
    const real *eta = score + slot * (size_t)c;
    const real *lost = strength + slot * (size_t)n; /* the jump of each is -lost */
    real *odds = log_odds + (size_t)o * (size_t)(n * n);
    for (int i = 0; i < n * n; i++) odds[i] = -INFINITY;
    for (int i = 0; i < n; i++) {
      if (!works[i]) continue;
      const real first = lost[i] * (-eta[i] - R(0.5) * lost[i] * Lambda[i * c + i]);
      for (int k = i + 1; k < n; k++) {
        if (!works[k]) continue;
        const real second = lost[k] * (-eta[k] - R(0.5) * lost[k] * Lambda[k * c + k]);
        const real ratio = first + second - lost[i] * lost[k] * Lambda[i * c + k];
        odds[i * n + k] = ratio / temper + log_rate + span[o];
      }
    }
  }
}

void fl_jumps_of_wrench(const fl_real *information, const fl_real *score, const int *slots,
                        int count, int c, const fl_real *variance, const fl_real *span,
                        fl_real log_rate, fl_real temper, fl_real *log_odds) {
  int columns[AXES];
  for (int k = 0; k < AXES; k++) columns[k] = c - AXES + k;
  for (int o = 0; o < count; o++) {
    const size_t slot = (size_t)slots[o];
    const real *Lambda = information + slot * (size_t)(c * c);
    jump j = jump_of_columns(Lambda, score + slot * (size_t)c, c, columns, AXES);
    for (int k = 0; k < AXES; k++) {
      j.mean[k] = 0;
      j.variance[k] = variance[k];
    }
    log_odds[o] = log_ratio(&j) / temper + log_rate + span[o];
  }
}

void fl_log_sums(const fl_real *values, int rows, int width, const int *groups, int count,
                 fl_real *tops, fl_real *sums) {
  for (int g = 0; g < count; g++) {
    tops[g] = -INFINITY;
    sums[g] = 0;
  }
  for (int row = 0; row < rows; row++) {
    for (int j = 0; j < width; j++) {
      const int g = groups[j];
      tops[g] = larger(tops[g], values[row * width + j]);
    }
  }
  for (int row = 0; row < rows; row++) {
    for (int j = 0; j < width; j++) {
      const int g = groups[j];
      const real below = values[row * width + j] - tops[g];
      if (below > -FAR_BELOW) sums[g] += EXP(below);
    }
  }
  for (int g = 0; g < count; g++) {
    if (tops[g] > -INFINITY) sums[g] = tops[g] + LOG(sums[g]);
    if (!(tops[g] > -INFINITY)) sums[g] = -INFINITY;
  }
}
