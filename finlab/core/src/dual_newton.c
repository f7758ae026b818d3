/* Newton's method on the dual, for one target.

       max over l of  g(l) = l.w - sum c*(B'l),   with gradient  w - sum B y(B'l)

   g is concave, its Hessian is -G with G = sum B (dy/ds) B'. Where actuators are at their limits G loses rank:
   a ridge mu (S + c tr(G) M) keeps the step finite and is adapted to what a step brought (Levenberg, Marquardt).
   S = sum B (|y|/|s|) B' is the same as G, but of forces over prices, which limits leave as they are, and M the Hessian
   of quadratic costs over its mean; where foils drag, S is left out and c is 1. Vectors in the basis have 6 numbers,
   those behind its range are 0. */
#include "internal.h"

#define SATURATED R(1e-1) /* share c of M, and ridge to begin with where an actuator may be at its limit; NEARLY elsewhere */

/* Scaled wrench in the basis. */
void fl_reduce_wrench(const fl_work *work, const real *wrench, real *target) {
  const fl_span *span = &work->span;
  for (int j = 0; j < 6; j++) {
    target[j] = 0;
    for (int k = 0; k < 6; k++) target[j] += span->basis[k][j] * (wrench[k] / span->scale[k]);
  }
}

/* Prices in the basis of those of the wrench. */
void fl_reduce_lambda(const fl_work *work, const real *price, real *inner) {
  const fl_span *span = &work->span;
  for (int j = 0; j < 6; j++) {
    inner[j] = 0;
    for (int k = 0; k < 6; k++) inner[j] += span->basis[k][j] * span->scale[k] * price[k];
  }
}

/* Whether a wrench lies in the range but for rounding. */
int fl_is_in_range(const fl_work *work, const real *wrench, const real *target) {
  const fl_span *span = &work->span;
  real rest = 0, all = 0;
  for (int k = 0; k < 6; k++) {
    real scaled = wrench[k] / span->scale[k], left = scaled - dot(span->basis[k], target, 6);
    rest += left * left, all += scaled * scaled;
  }
  return SQRT(rest) <= MAX(NEARLY, 10 * ROUNDING) * (R(1e-3) + SQRT(all));
}

/* The wrench [N, N m] of forces. */
void fl_wrench_of_forces(const real *block, const fl_work *work, real force[][2], real *wrench) {
  const fl_span *span = &work->span;
  real given[6] = {0};
  for (int i = 0; i < COUNT(block); i++)
    for (int q = 0; q < (int)ACTUATOR(block, i)->rows; q++)
      for (int j = 0; j < span->range; j++) given[j] += force[i][q] * span->matrix[i][q][j];
  for (int k = 0; k < 6; k++) wrench[k] = span->scale[k] * dot(span->basis[k], given, 6);
}

/* What follows from all sets. */
void fl_prepare_sets(const real *block, fl_work *work) {
  work->most_cost = 0, work->quick = 1, work->torn = work->drags = work->turns = 0;
  for (int i = 0; i < COUNT(block); i++) {
    const fl_set *s = work->set + i;
    work->most_cost += MAX(MAX(s->low_cost, s->high_cost), s->reverse > 0 ? s->reverse_cost : 0);
    if (s->turn > 0) {
      const real farthest = MIN(FABS(s->middle - s->at) + s->half, PI);
      work->most_cost += s->turn / 2 * farthest * farthest;
      work->turns = 1;
    }
    work->torn |= s->forked || s->reverse > 0;
    work->drags |= ACTUATOR(block, i)->speed > 0 && !work->span.lost[i];
    if (work->torn || work->drags || work->turns || ACTUATOR(block, i)->band > 0) work->quick = 0;
  }
}

void fl_restore_sets(const real *block, fl_work *work, const fl_set *set) {
  memcpy(work->set, set, sizeof work->set);
  fl_prepare_sets(block, work);
}

/* What prices give for a target in the basis. */
void fl_dual_at(const real *block, const fl_work *work, const real *target, const real *price, fl_state *state) {
  real given[6] = {0}, conjugate = 0;
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    real own[2], *slope = state->slope[i];
    own_price(work, i, price, own);
    response o = fl_response(block, i, work->set + i, own);
    state->force[i][0] = o.force[0], state->force[i][1] = o.force[1];
    slope[0] = o.xx, slope[1] = o.xy, slope[2] = o.yy;
    state->angle[i] = o.angle;
    int line = a->rows == 1;
    real paid = line ? FABS(own[0]) : size_of(own), size = line ? FABS(o.force[0]) : size_of(o.force);
    slope[3] = work->drags ? 0 : size / MAX(paid, a->most[0] / a->gain[0]);
    conjugate += o.conjugate;
    const real(*matrix)[6] = work->span.matrix[i];
    for (int j = 0; j < 6; j++) given[j] += o.force[0] * matrix[0][j] + o.force[1] * matrix[1][j];
  }
  for (int j = 0; j < 6; j++) state->price[j] = price[j], state->residual[j] = target[j] - given[j];
  state->value = dot(price, target, 6) - conjugate;
  state->size = SQRT(dot(state->residual, state->residual, 6));
}

/* Has Newton's method be at prices. */
void fl_dual_start(const real *block, fl_work *work, const real *target, const real *price) {
  work->now = work->state;
  fl_dual_at(block, work, target, price, work->state);
}

/* Prices to begin with: those at which actuators whose costs are ~ T^1.5 give a target, each with its force over price
   at what it gives where costs are quadratic. */
void fl_first_lambda(const real *block, const fl_work *work, const real *target, real *price, real *ridge) {
  real even[6], h[6][6] = {{0}}, trace;
  fl_solve((real(*)[6])work->factor, target, even);
  *ridge = NEARLY;
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    real own[2], most = a->most[0], gain[2] = {a->gain[0], a->gain[1]};
    own_price(work, i, even, own);
    real size = a->gain[0] * (is_plane(a) ? size_of(own) : FABS(own[0]));
    if (a->rows == 1) {
      const real *table = block + (int)(own[0] < 0 && a->back > 0 ? a->back : a->ahead);
      most = a->share * table[3 + 3 * (int)table[1]];
      gain[0] = most * a->share / (table[0] * a->worth);
    }
    real share = size / most;
    if (share > R(0.8)) *ridge = SATURATED;
    real weight = share > 1 && !work->drags ? 1 / share : SQRT(CLIP(share, CLOSE, 1));
    for (int q = 0; q < (int)a->rows; q++) fl_add_square(h, work->span.matrix[i][q], weight * gain[q]);
  }
  trace = fl_trace(h);
  for (int j = 0; j < 6; j++) h[j][j] += NOTHING * trace;
  if (fl_factor(h))
    fl_solve(h, target, price);
  else
    for (int j = 0; j < 6; j++) price[j] = target[j] / trace;
}

/* The step of the prices at a ridge; 0 where there is none. */
static int step_of(const real *block, const fl_work *work, const fl_state *s, real ridge, real *step) {
  real h[6][6] = {{0}};
  for (int i = 0; i < COUNT(block); i++) {
    const real *b = work->span.matrix[i][0], *c = work->span.matrix[i][1], *slope = s->slope[i];
    real xx = slope[0] + ridge * slope[3], xy = slope[1], yy = slope[2] + ridge * slope[3];
    if (ACTUATOR(block, i)->rows == 1) {
      if (xx > 0) fl_add_square(h, b, xx);
      continue;
    }
    for (int j = 0; j < 6; j++) {
      real u = xx * b[j] + xy * c[j], v = xy * b[j] + yy * c[j];
      for (int k = 0; k <= j; k++) h[j][k] += u * b[k] + v * c[k];
    }
  }
  real added = (work->drags ? 1 : SATURATED) * ridge * MAX(fl_trace(h), work->least_trace);
  for (int j = 0; j < 6; j++)
    for (int k = 0; k <= j; k++) h[j][k] += added * work->metric[j][k];
  if (!fl_factor(h)) return 0;
  fl_solve(h, s->residual, step);
  return 1;
}

#define JUMPS 4 /* looks at which an answer jumps, after which Newton's method stands still */

/* How many answers jump between two states a step apart; where wanted they are marked as what is to be cut. */
static int jumps_between(const real *block, fl_work *work, const fl_state *one, const fl_state *other,
                         const real *step, int marked) {
  const real full = NOTHING * work->most_cost; /* in a hole around rest prices go to 0 */
  const real square = dot(step, step, 6);
  const real all = dot(one->price, one->price, 6) + 100 * work->most_cost * full;
  int jumps = 0;
  if (!(square < R(1e-3) * all)) return 0;
  for (int i = 0; i < COUNT(block); i++) {
    fl_set *set = work->set + i;
    real own[2];
    if (!(set->turn > 0)) continue;
    own_price(work, i, step, own);
    if (!fl_has_jumped(block, i, set, one, other, own, square < R(1e-7) * all)) continue;
    jumps++;
    if (marked) fl_mark_jump(set, one->angle[i], other->angle[i]);
  }
  return jumps;
}

/* Newton's method from prices on; work->now is what it comes to. */
int fl_dual_newton(const real *block, fl_work *work, const real *target, const real *price, int most_steps) {
  fl_state *s = work->state, *trial = work->state + 1;
  real first[6], step[6], next[6], ridge = NEARLY, growth = 2, most = work->most_cost * (1 + NOTHING) + NOTHING;
  if (!price) fl_first_lambda(block, work, target, first, &ridge);
  fl_dual_start(block, work, target, price ? price : first);
  real value = s->value, size = s->size; /* when it last got better by more than rounding */
  for (int i = 0; work->turns && i < COUNT(block); i++) work->set[i].jumps = 0;
  for (int k = 0, idle = 0, jumps = 0;; k++) {
    if (s->size <= TOLERANCE) return FL_MET;
    if (s->value > most) return FL_BEYOND;
    if (s->value > value + ROUNDING * FABS(value) || s->size < R(0.9) * size)
      value = s->value, size = s->size, idle = 0;
    if (k >= most_steps || idle++ > IDLE || !(ridge <= 1 / ROUNDING)) return s->size <= ENOUGH ? FL_MET : FL_STUCK;
    work->steps++;
    if (!step_of(block, work, s, ridge, step)) {
      ridge *= 10;
      continue;
    }
    for (int j = 0; j < 6; j++) next[j] = s->price[j] + step[j];
    fl_dual_at(block, work, target, next, trial);
    if (work->turns && jumps_between(block, work, s, trial, step, 0) && ++jumps >= JUMPS) {
      jumps_between(block, work, s, trial, step, 1);
      return FL_STUCK;
    }
    /* A step is kept that ends uphill, or where the value rose, or is the same and the residual fell. */
    real slope = dot(step, s->residual, 6), end = dot(step, trial->residual, 6), change = end / MAX(slope, TINY);
    real rose = trial->value - s->value, slack = ROUNDING * FABS(s->value);
    if (change >= 0 || rose > 0 || (rose > -slack && trial->size < R(0.9) * s->size)) {
      real left = FABS(change);
      ridge = MAX(ridge * (change > R(0.5) ? R(0.3) : CLIP(left / 2, R(0.05), 1)), ROUNDING), growth = 2;
      work->now = trial, trial = s, s = work->now;
    } else {
      /* Where the cubic along the step, of both values and slopes, is largest. */
      real square = 3 * (slope + end - 2 * rose), line = end - slope - square, root = line * line - 4 * square * slope;
      real share = root > 0 ? 2 * slope / (SQRT(root) - line) : R(0.5);
      ridge = MAX(ridge * MAX(growth, 1 / CLIP(share, R(1e-3), R(0.7))), ROUNDING), growth *= 2;
      idle--; /* refused steps are not those that gain nothing but rounding: their ridge grows to an end of its own */
    }
  }
}
