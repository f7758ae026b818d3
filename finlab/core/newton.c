/* Newton's method on the dual, for one target.

       max over l of  g(l) = l.w - sum c*(B'l),   with gradient  w - sum B y(B'l)

   g is concave, its Hessian is -G with G = sum B (dy/ds) B'. Where actuators are at their limits G loses rank:
   a ridge mu tr(G) M, with M the Hessian of quadratic costs over its mean, keeps the step finite and is
   adapted to what a step brought (Levenberg, Marquardt; Nielsen's growth where steps are refused). */
#include "inner.h"

#define SATURATED R(1e-2) /* ridge to begin with where an actuator may be at its limit; NEARLY elsewhere */

/* Scaled wrench in the basis. */
void to_basis(const real *block, const real *wrench, real *target) {
  const fl_head *h = HEAD(block);
  for (int j = 0; j < RANGE(block); j++) {
    target[j] = 0;
    for (int k = 0; k < 6; k++) target[j] += h->basis[k][j] * (wrench[k] / h->scale[k]);
  }
}

/* How much of a scaled wrench lies beside the range, and its size. */
real beside_range(const real *block, const real *wrench, const real *target, real *size) {
  const fl_head *h = HEAD(block);
  real rest = 0, all = 0;
  for (int k = 0; k < 6; k++) {
    real scaled = wrench[k] / h->scale[k], left = scaled - dot(h->basis[k], target, RANGE(block));
    rest += left * left, all += scaled * scaled;
  }
  *size = SQRT(all);
  return SQRT(rest);
}

/* The wrench [N, N m] of forces. */
void wrench_of(const real *block, real force[][2], real *wrench) {
  const fl_head *h = HEAD(block);
  real given[6] = {0};
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    for (int q = 0; q < (int)a->rows; q++)
      for (int j = 0; j < RANGE(block); j++) given[j] += force[i][q] * a->matrix[q][j];
  }
  for (int k = 0; k < 6; k++) wrench[k] = h->scale[k] * dot(h->basis[k], given, RANGE(block));
}

static void add_square(real h[6][6], const real *row, real weight, int r) {
  for (int j = 0; j < r; j++)
    for (int k = 0; k <= j; k++) h[j][k] += weight * row[j] * row[k];
}

int fl_prepare(const real *block, fl_work *work) {
  int n = COUNT(block), r = RANGE(block);
  real h[6][6] = {{0}}, trace = 0;
  for (int i = 0; i < n; i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    limit(block, i, work->set + i, a->least, a->high, a->middle, a->half);
    for (int q = 0; q < (int)a->rows; q++) add_square(h, a->matrix[q], a->gain[q], r);
  }
  for (int j = 0; j < r; j++) trace += h[j][j];
  for (int j = 0; j < r; j++)
    for (int k = 0; k <= j; k++)
      work->metric[j][k] = work->metric[k][j] = h[j][k] * r / trace + (j == k ? NEARLY : 0);
  for (int j = 0; j < r; j++) h[j][j] += NOTHING * trace;
  work->least_trace = NEARLY * trace, work->enough = TOLERANCE;
  sums_of(block, work);
  return cholesky(h, work->factor, r) ? 0 : FL_BAD_NUMBER;
}

/* What follows from all sets. */
void sums_of(const real *block, fl_work *work) {
  work->most_cost = 0, work->quick = 1, work->torn = work->drags = 0;
  for (int i = 0; i < COUNT(block); i++) {
    const fl_set *s = work->set + i;
    work->most_cost += MAX(MAX(s->low_cost, s->high_cost), s->reverse > 0 ? s->reverse_cost : 0);
    if (s->forked || s->reverse > 0) work->torn = 1;
    if (ACTUATOR(block, i)->speed > 0) work->drags = 1;
    if (s->forked || s->reverse > 0 || ACTUATOR(block, i)->band > 0 || ACTUATOR(block, i)->speed > 0) work->quick = 0;
  }
}

void take_sets(const real *block, fl_work *work, const fl_set *set) {
  memcpy(work->set, set, sizeof work->set);
  sums_of(block, work);
}

/* What prices give for a target in the basis. */
void look(const real *block, const fl_work *work, const real *target, const real *price, fl_state *state) {
  int n = COUNT(block), r = RANGE(block);
  real given[6] = {0}, conjugate = 0, (*h)[6] = state->hessian;
  memset(state->hessian, 0, sizeof state->hessian);
  for (int i = 0; i < n; i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    const real *first = a->matrix[0], *second = a->matrix[1];
    int two = a->rows == 2;
    real own[2];
    own_price(block, i, price, own);
    reply o = reply_of(block, i, work->set + i, own);
    state->force[i][0] = o.force[0], state->force[i][1] = o.force[1];
    conjugate += o.conjugate;
    for (int j = 0; j < r; j++) {
      real u = o.xx * first[j], v = 0;
      given[j] += o.force[0] * first[j];
      if (two) {
        given[j] += o.force[1] * second[j];
        u += o.xy * second[j], v = o.xy * first[j] + o.yy * second[j];
        for (int k = 0; k <= j; k++) h[j][k] += u * first[k] + v * second[k];
      } else if (u != 0)
        for (int k = 0; k <= j; k++) h[j][k] += u * first[k];
    }
  }
  state->trace = 0;
  for (int j = 0; j < r; j++) {
    state->price[j] = price[j];
    state->residual[j] = target[j] - given[j];
    state->trace += h[j][j];
  }
  state->value = dot(price, target, r) - conjugate;
  state->size = SQRT(dot(state->residual, state->residual, r));
}

/* Has Newton's method be at prices. */
void stand_at(const real *block, fl_work *work, const real *target, const real *price) {
  work->now = work->state;
  look(block, work, target, price, work->state);
}

/* Prices to begin with: those that come nearest to the marginal costs of the forces of quadratic costs,
   weighted by what costs ~ T^1.5 would answer. */
void first_price(const real *block, const fl_work *work, const real *target, real *price, real *ridge) {
  int n = COUNT(block), r = RANGE(block);
  real even[6], h[6][6] = {{0}}, right[6] = {0}, factor[6][6], trace = 0;
  solve((real(*)[6])work->factor, target, even, r);
  *ridge = NEARLY;
  for (int i = 0; i < n; i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    int plane = is_plane(a);
    real force[2];
    own_price(block, i, even, force);
    for (int q = 0; q < 2; q++) force[q] *= a->gain[q];
    real size = plane ? size_of(force) : FABS(force[0]);
    real share = size / a->most[0], within = MIN(size, R(0.97) * a->most[0]), paid, per;
    if (share > R(0.8)) *ridge = SATURATED;
    per = a->share / a->worth;
    marginal(block + (int)(!plane && force[0] < 0 && a->back > 0 ? a->back : a->ahead), within / a->share, &paid);
    paid /= per * MAX(size, TINY);
    real weight = SQRT(CLIP(share, R(1e-4), 1));
    for (int q = 0; q < (int)a->rows; q++) {
      add_square(h, a->matrix[q], weight * a->gain[q], r);
      for (int j = 0; j < r; j++) right[j] += a->matrix[q][j] * weight * a->gain[q] * paid * force[q];
    }
  }
  for (int j = 0; j < r; j++) trace += h[j][j];
  for (int j = 0; j < r; j++) h[j][j] += NOTHING * trace;
  /* Where lift drags, forces of quadratic costs say little of its marginal cost. */
  if (cholesky(h, factor, r))
    solve(factor, work->drags ? target : right, price, r);
  else
    for (int j = 0; j < r; j++) price[j] = target[j] / trace;
}

/* The step of the prices at a ridge; 0 where there is none. */
static int step_of(const fl_work *work, const fl_state *s, real ridge, int r, real *step) {
  real a[6][6], factor[6][6], added = ridge * MAX(s->trace, work->least_trace);
  for (int j = 0; j < r; j++)
    for (int k = 0; k <= j; k++) a[j][k] = s->hessian[j][k] + added * work->metric[j][k];
  if (!cholesky(a, factor, r)) return 0;
  solve(factor, s->residual, step, r);
  return 1;
}

/* Newton's method from prices on; work->now is what it comes to. */
int newton(const real *block, fl_work *work, const real *target, const real *price, int most_steps) {
  int r = RANGE(block);
  fl_state *s = work->state, *trial = work->state + 1;
  real first[6], step[6], next[6], ridge = NEARLY, growth = 2, most = work->most_cost * (1 + NOTHING) + NOTHING;
  if (!price) first_price(block, work, target, first, &ridge);
  stand_at(block, work, target, price ? price : first);
  real value = s->value, size = s->size; /* when it last got better by more than rounding */
  for (int k = 0, idle = 0;; k++) {
    if (s->size <= work->enough) return FL_MET;
    if (s->value > most) return FL_BEYOND;
    if (s->value > value + ROUNDING * FABS(value) || s->size < R(0.9) * size)
      value = s->value, size = s->size, idle = 0;
    if (k >= most_steps || idle++ > IDLE || !(ridge <= 1 / ROUNDING)) return s->size <= ENOUGH ? FL_MET : FL_STUCK;
    work->steps++;
    if (!step_of(work, s, ridge, r, step)) {
      ridge *= 10;
      continue;
    }
    for (int j = 0; j < r; j++) next[j] = s->price[j] + step[j];
    look(block, work, target, next, trial);
    /* A step is kept that ends uphill, or where the value rose, or is the same and the residual fell. */
    real change = dot(step, trial->residual, r) / MAX(dot(step, s->residual, r), TINY);
    real rose = trial->value - s->value, slack = ROUNDING * FABS(s->value);
    int good = change >= 0 || rose > 0 || (rose > -slack && trial->size < R(0.9) * s->size);
    if (good) {
      real kept = FABS(change) < R(0.5) ? R(0.1) : change > R(0.5) ? R(0.3) : 1;
      ridge = MAX(ridge * kept, ROUNDING), growth = 2;
      fl_state *other = s;
      s = trial, trial = other;
    } else {
      real grown = MIN(-change, 10);
      ridge = MAX(ridge * MAX(growth, grown), ROUNDING), growth *= 2;
    }
    work->now = s;
  }
}
