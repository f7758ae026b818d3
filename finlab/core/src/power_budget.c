/* The most wrench that power budgets allow, and the least power within them (Eqs. 28 and 29).

   A budget P_b limits the power of the actuators of a bus b. With its multiplier zeta_b their costs
   are mu_b = 1 + zeta_b times as much, and the dual of Eq. 3 is

       max over lambda and mu >= 1 of  g = lambda.w - sum mu_b c*(B'lambda / mu_b) - h(lambda)
                                           - sum (mu_b - 1) P_b
       with gradients                  r = w - sum B y - h'(lambda)  and  q_b = sum c(y) - P_b

   where h is the conjugate of the cost of what is missing: K |W m|^2 / 2 of a miss m along some
   axes, or K m^2 / 2 of a share m of the ray of w. g is concave in (lambda, mu) together, and
   Newton's method on both is that of dual_newton.c with a border: with v = B'lambda / mu, the price
   that an actuator sees, and D = dy/ds there

       G = sum B D B' / mu + h''    c_b = -sum B D v / mu    d_b = sum v'D v / mu

   Buses with mu_b = 1 that take less than they have are left out of a step. */
#include "step_control.h"
#include "symmetric.h"

#define MISS_COST R(1e6)      /* K over the robot's largest power, of a miss of the wrench scale */
#define HELD_AXIS R(1e4)      /* weight of axes that are served over those that follow */
#define ACROSS_RAY 100        /* weight of what is across a ray over what is along it */
#define BUDGET_KEPT TOLERANCE /* share of a budget by which a power may be off */
#define BUDGET_STEPS FL_STEPS /* of Newton's method for one target */
#define DEAR 100              /* multiple of a usual price that only what is missing explains */
#define SHORT_SHARE R(0.1)    /* of a step, from which on mu falls */
#define BUDGET_SLOPE_ENOUGH R(0.3) /* share of the slope that a search along a step may leave */
#define SHARES 40                  /* that are tried of the forces without budgets */
#define BUDGET_IDLE 12             /* steps without progress after which it ends */
/* There, of TOLERANCE, what may be left: rounding where multipliers lie far apart. */
#define STANDSTILL 100
/* The cost of a miss with which the way along costs begins, over MISS_COST, and its steps. */
#define COST_BEGIN R(1e-6)
#define COST_TIMES 10
#define COST_FIRST R(1e-4) /* cost of a miss, over MISS_COST, from which multipliers are told */
#define COST_STEP R(1e-3)  /* share by which it changes, to find how they change with it */
#define EXPONENT_GUESS (R(2.0) / 3) /* of forces over powers, to begin with: costs ~ T^1.5 */

enum { NOTHING_MISSES, AXES_MISS = 1, RAY_MISSES = 2 }; /* or both: what is near to a ray */

/* Multipliers, and what they give. `state` has forces and their derivatives. */
typedef struct {
  real lambda[6];
  real factor[FL_BUSES + 1]; /* mu of each bus; the last one, of no bus, is 1 */
  real residual[6];          /* r */
  real power[FL_BUSES + 1];  /* of each bus [W] */
  real missing[6];           /* scaled wrench along axes */
  real missing_share;        /* of a ray */
  real value;                /* g [W] */
  real size;                 /* of residual and excess powers, over the budgets */
  fl_state *state;
} budget_point;

/* A target, and what may miss of it. */
typedef struct {
  const real *block;
  fl_work *work;
  const fl_budget *budget;
  int bus[FL_MOST];      /* of each actuator; budget->buses of one without */
  int misses;            /* NOTHING_MISSES ... */
  int is_in_axes;        /* whether multipliers are those of axes; else of the basis */
  int keeps_budgets;     /* whether budgets count, or the least power is wanted */
  unsigned char axis[6]; /* axes that are asked for */
  real target[6];        /* scaled wrench, along axes or in the basis */
  real looseness[6];     /* h'' of axes: scaled wrench that is missing over its price [1/W] */
  real miss_cost;        /* K of a miss of the wrench scale [W] */
  real ray_cost;         /* that of a ray [W] */
  real most_power;       /* no answer within the budgets takes more [W] */
  /* Actuators whose forces groups of axes before have left no choice of, and these. */
  int is_settled[FL_MOST];
  real settled_force[FL_MOST][2]; /* [N] */
  real settled_power[FL_MOST];    /* [W] */
  int is_open[FL_BUSES];          /* whether a bus feeds any that are not settled */
  int has_settled;                /* whether any is settled */
  int exceeds;                    /* whether a bus takes more whatever is given */
  /* What is found of sets with gaps. */
  int targets;             /* that were looked for */
  int begins_anew;         /* whether a target begins at a guess */
  int may_not_bind;        /* whether a bus may bind while another does not */
  budget_point part;       /* of the part that is looked at */
  budget_point part_begin; /* of all parts together */
  budget_point part_best;  /* of the best part */
  real force[FL_MOST][2];  /* that are in no gap [N] */
} budget_problem;

/* A step of all multipliers. */
typedef struct {
  real lambda[6];
  real factor[FL_BUSES];
} budget_step;

#define UNKNOWNS (6 + FL_BUSES)

/* Adds a vector (6,) times a number. */
static void add_to(real *sum, real times, const real *vector) {
  for (int j = 0; j < 6; j++) sum[j] += times * vector[j];
}

/* Multipliers in the basis. */
static void in_basis(const budget_problem *p, const real *lambda, real *lambda_reduced) {
  if (!p->is_in_axes) {
    memcpy(lambda_reduced, lambda, 6 * sizeof *lambda);
    return;
  }
  memset(lambda_reduced, 0, 6 * sizeof *lambda_reduced);
  for (int k = 0; k < 6; k++) {
    if (!p->axis[k]) continue;
    for (int j = 0; j < 6; j++) lambda_reduced[j] += p->work->span.basis[k][j] * lambda[k];
  }
}

/* A scaled wrench in the basis as one along the axes that are asked for. */
static void along_axes(const budget_problem *p, const real *reduced, real *wrench) {
  if (!p->is_in_axes) {
    memcpy(wrench, reduced, 6 * sizeof *reduced);
    return;
  }
  for (int k = 0; k < 6; k++) {
    wrench[k] = 0;
    if (p->axis[k]) wrench[k] = dot(p->work->span.basis[k], reduced, 6);
  }
}

/* What misses at the multipliers of a point; returns h(lambda) [W]. */
static real find_missing(const budget_problem *p, budget_point *at) {
  real conjugate = 0;
  at->missing_share = 0;
  memset(at->missing, 0, sizeof at->missing);
  if (p->misses & RAY_MISSES) {
    const real worth = dot(at->lambda, p->target, 6);
    const real share = clipped(worth / p->ray_cost, 0, 1);
    at->missing_share = share;
    conjugate += share * (worth - p->ray_cost * share / 2);
  }
  if (p->misses & AXES_MISS) {
    for (int k = 0; k < 6; k++) at->missing[k] = p->looseness[k] * at->lambda[k];
    conjugate += dot(at->missing, at->lambda, 6) / 2;
  }
  return conjugate;
}

/* By how much a bus takes more than it has, over that, or less where that costs it something. */
static real excess_of(const budget_problem *p, const budget_point *at, int bus) {
  if (!p->keeps_budgets || !p->is_open[bus]) return 0;
  const real excess = at->power[bus] / p->budget->watts[bus] - 1;
  if (at->factor[bus] > 1) return excess;
  return larger(excess, 0);
}

/* The response of an actuator at a price: of one that is settled its force, at any price. */
static response response_to(const budget_problem *p, int i, const real *v) {
  if (!p->is_settled[i]) return fl_response(p->block, i, p->work->set + i, v);
  response y = {{p->settled_force[i][0], p->settled_force[i][1]}, 0, 0, 0, 0, 0};
  y.conjugate = dot(v, y.force, 2) - p->settled_power[i];
  return y;
}

/* Evaluates the dual at the multipliers of a point. */
static void evaluate(const budget_problem *p, budget_point *at) {
  const fl_work *work = p->work;
  fl_state *state = at->state;
  real wrench[6] = {0}; /* sum B y, in the basis */
  real given[6];
  real conjugate = find_missing(p, at);
  in_basis(p, at->lambda, state->lambda_reduced);
  memset(at->power, 0, sizeof at->power);
  for (int i = 0; i < COUNT(p->block); i++) {
    const fl_actuator *a = ACTUATOR(p->block, i);
    const real factor = at->factor[p->bus[i]];
    const real over = 1 / factor;
    real v[2];
    actuator_price(work, i, state->lambda_reduced, v);
    v[0] *= over;
    v[1] *= over;
    const response y = response_to(p, i, v);
    state->force[i][0] = y.force[0];
    state->force[i][1] = y.force[1];
    state->dy_ds[i][0] = y.xx;
    state->dy_ds[i][1] = y.xy;
    state->dy_ds[i][2] = y.yy;
    const real price_quadratic = a->row_force_max[0] / a->secant[0];
    state->secant[i] = size_of(y.force) / larger(size_of(v), price_quadratic);
    if (p->is_settled[i]) state->secant[i] = 0;
    conjugate += factor * y.conjugate;
    at->power[p->bus[i]] += dot(v, y.force, 2) - y.conjugate;
    const real(*B)[6] = work->span.effectiveness_reduced[i];
    add_to(wrench, y.force[0], B[0]);
    if (a->rows != 1) add_to(wrench, y.force[1], B[1]);
  }
  along_axes(p, wrench, given);
  at->value = dot(at->lambda, p->target, 6) - conjugate;
  for (int j = 0; j < 6; j++) {
    const real missing = at->missing[j] + at->missing_share * p->target[j];
    at->residual[j] = p->target[j] - given[j] - missing;
  }
  real squared = dot(at->residual, at->residual, 6);
  for (int b = 0; b < p->budget->buses; b++) {
    const real excess = excess_of(p, at, b);
    squared += excess * excess;
    at->value -= (at->factor[b] - 1) * p->budget->watts[b];
  }
  at->size = SQRT(squared);
}

/* Solves H x = right of so many unknowns in place, by the factor L D L' of the lower triangle; 0
   where H is singular to rounding. */
static int solve_in_place(real H[UNKNOWNS][UNKNOWNS], int count, real *x) {
  for (int i = 0; i < count; i++) {
    real LD[UNKNOWNS]; /* row i of L D */
    real pivot = H[i][i];
    for (int j = 0; j < i; j++) LD[j] = H[i][j] - dot(LD, H[j], j);
    for (int j = 0; j < i; j++) {
      H[i][j] = LD[j] * H[j][j];
      pivot -= LD[j] * H[i][j];
      x[i] -= H[i][j] * x[j];
    }
    if (!(pivot > 0)) return 0;
    H[i][i] = 1 / pivot;
  }
  for (int i = count - 1; i >= 0; i--) {
    x[i] *= H[i][i];
    for (int k = i + 1; k < count; k++) x[i] -= H[k][i] * x[k];
  }
  return 1;
}

/* The Hessian of -g at a point, damped by mu as in Eq. 8. */
typedef struct {
  real G[6][6];                /* of lambda, lower triangle */
  real cross[FL_BUSES + 1][6]; /* c_b */
  real bend[FL_BUSES + 1];     /* d_b */
} budget_hessian;

/* Sum of B D B' / mu and its border, in the basis, with D + mu S in place of D. */
static void add_responses(const budget_problem *p, const budget_point *at, real mu,
                          budget_hessian *h) {
  const fl_work *work = p->work;
  const fl_state *state = at->state;
  symmetric sum = no_matrix();
  for (int i = 0; i < COUNT(p->block); i++) {
    const int bus = p->bus[i];
    const real over = 1 / at->factor[bus];
    const real(*B)[6] = work->span.effectiveness_reduced[i];
    const real *dy_ds = state->dy_ds[i];
    const real xx = (dy_ds[0] + mu * state->secant[i]) * over;
    real v[2];
    actuator_price(work, i, state->lambda_reduced, v);
    v[0] *= over;
    v[1] *= over;
    if (ACTUATOR(p->block, i)->rows == 1) {
      const real Dv = xx * v[0];
      add_square(&sum, B[0], xx);
      add_to(h->cross[bus], -Dv, B[0]);
      h->bend[bus] += Dv * v[0];
      continue;
    }
    const real xy = dy_ds[1] * over;
    const real yy = (dy_ds[2] + mu * state->secant[i]) * over;
    const real Dv[2] = {xx * v[0] + xy * v[1], xy * v[0] + yy * v[1]};
    add_plane(&sum, B[0], B[1], xx, xy, yy);
    add_to(h->cross[bus], -Dv[0], B[0]);
    add_to(h->cross[bus], -Dv[1], B[1]);
    h->bend[bus] += dot(Dv, v, 2);
  }
  lower_triangle(&sum, h->G);
}

/* Brings the Hessian from the basis to the axes that are asked for. */
static void turn_to_axes(const budget_problem *p, budget_hessian *h) {
  const fl_span *span = &p->work->span;
  real half[6][6]; /* T G */
  for (int k = 0; k < 6; k++) {
    for (int j = 0; j < 6; j++) {
      half[k][j] = 0;
      for (int l = 0; l < 6 && p->axis[k]; l++) {
        half[k][j] += span->basis[k][l] * h->G[l > j ? l : j][l > j ? j : l];
      }
    }
  }
  for (int k = 0; k < 6; k++) {
    for (int m = 0; m <= k; m++) {
      h->G[k][m] = 0;
      if (p->axis[m]) h->G[k][m] = dot(half[k], span->basis[m], 6);
    }
    if (!p->axis[k]) h->G[k][k] = 1; /* its multiplier stays 0 */
  }
  for (int b = 0; b < p->budget->buses; b++) {
    real cross[6];
    along_axes(p, h->cross[b], cross);
    memcpy(h->cross[b], cross, sizeof cross);
  }
}

static void find_hessian(const budget_problem *p, const budget_point *at, real mu,
                         budget_hessian *h) {
  memset(h, 0, sizeof *h);
  add_responses(p, at, mu, h);
  real least = p->work->trace_min;
  for (int b = 0; b < p->budget->buses; b++) {
    const real factor = at->factor[b];
    h->bend[b] += SATURATED * mu * p->budget->watts[b] / factor;
    least = smaller(least, p->work->trace_min / factor);
  }
  const real weight = SATURATED * mu * larger(fl_trace(h->G), least);
  for (int j = 0; j < 6; j++) {
    for (int k = 0; k <= j; k++) h->G[j][k] += weight * p->work->metric[j][k];
  }
  if (p->is_in_axes) turn_to_axes(p, h);
  if (p->misses & AXES_MISS) {
    for (int k = 0; k < 6; k++) h->G[k][k] += p->looseness[k];
  }
  const int is_share_free = at->missing_share > 0 && at->missing_share < 1;
  if (is_share_free) {
    fl_add_square(h->G, p->target, 1 / p->ray_cost);
  }
}

/* Newton's step from a point, of buses that bind or take too much; a multiplier that would fall
   below 1 becomes 1. Returns 0 where the Hessian is singular to rounding. */
static int find_step(const budget_problem *p, const budget_point *at, real mu, budget_step *step) {
  const int buses = p->budget->buses;
  budget_hessian h;
  int is_free[FL_BUSES];
  find_hessian(p, at, mu, &h);
  for (int b = 0; b < buses; b++) {
    step->factor[b] = 0;
    is_free[b] = excess_of(p, at, b) != 0 || at->factor[b] > 1;
  }
  for (;;) { /* each round holds one bus more */
    real H[UNKNOWNS][UNKNOWNS];
    real x[UNKNOWNS];
    int number[FL_BUSES]; /* of buses whose multipliers change freely */
    int count = 6;
    for (int j = 0; j < 6; j++) {
      memcpy(H[j], h.G[j], sizeof h.G[j]);
      x[j] = at->residual[j];
      for (int b = 0; b < buses; b++) x[j] -= h.cross[b][j] * step->factor[b];
    }
    for (int b = 0; b < buses; b++) {
      if (!is_free[b]) continue;
      memset(H[count], 0, sizeof H[count]);
      memcpy(H[count], h.cross[b], sizeof h.cross[b]);
      H[count][count] = h.bend[b];
      x[count] = at->power[b] - p->budget->watts[b];
      number[count - 6] = b;
      count++;
    }
    if (!solve_in_place(H, count, x)) return 0;
    memcpy(step->lambda, x, sizeof step->lambda);
    int is_done = 1;
    for (int k = 6; k < count; k++) {
      const int b = number[k - 6];
      step->factor[b] = 0;
      if (at->factor[b] + x[k] >= 1) continue;
      is_free[b] = 0;
      step->factor[b] = 1 - at->factor[b];
      is_done = 0;
    }
    if (is_done) {
      for (int k = 6; k < count; k++) step->factor[number[k - 6]] = x[k];
      return 1;
    }
  }
}

/* The slope of g along a step. */
static real slope_along(const budget_problem *p, const budget_point *at, const budget_step *step) {
  real slope = dot(step->lambda, at->residual, 6);
  for (int b = 0; b < p->budget->buses; b++) {
    slope += step->factor[b] * (at->power[b] - p->budget->watts[b]);
  }
  return slope;
}

/* The point after a share of a step. */
static void go_along(const budget_problem *p, const budget_point *from, const budget_step *step,
                     real share, budget_point *to) {
  for (int j = 0; j < 6; j++) to->lambda[j] = from->lambda[j] + share * step->lambda[j];
  for (int b = 0; b < p->budget->buses; b++) {
    to->factor[b] = larger(from->factor[b] + share * step->factor[b], 1);
  }
  to->factor[p->budget->buses] = 1;
  evaluate(p, to);
}

static step_result judged(const budget_problem *p, const budget_step *step,
                          const budget_point *from, const budget_point *to) {
  return step_result_of(slope_along(p, from, step), slope_along(p, to, step),
                        to->value - from->value);
}

/* Makes a trial that went too far along a step the point where g is largest along it, by secants
   and halves of the slope in turn. Returns the share of the step that is kept, 0 for none. */
static real share_kept_at_top(const budget_problem *p, const budget_step *step,
                              const step_result *result, const budget_point *at,
                              budget_point *trial) {
  real share = 0;
  real slope_low = result->slope_begin;
  real slope_high = result->slope_end;
  real low = 0;
  real high = 1;
  for (int k = 0; k < SEARCH_STEPS; k++) {
    real part = R(0.5); /* of the interval, from its low end */
    if (k % 2 == 0) part = slope_low / (slope_low - slope_high);
    share = low + part * (high - low);
    go_along(p, at, step, share, trial);
    const real slope = slope_along(p, trial, step);
    if (FABS(slope) <= BUDGET_SLOPE_ENOUGH * result->slope_begin) break;
    if (slope > 0) {
      low = share;
      slope_low = slope;
    } else {
      high = share;
      slope_high = slope;
    }
  }
  const step_result shorter = judged(p, step, at, trial);
  if (!is_step_kept(&shorter, at->value, at->size, trial->size)) return 0;
  return share;
}

/* Newton's method from the multipliers of a point, which becomes the one that it comes to. Returns
   FL_MET, FL_BEYOND where no answer keeps the budgets, or FL_NO_PROGRESS. */
static int find_optimum(const budget_problem *p, budget_point *at) {
  budget_point other;
  budget_point *from = at;
  budget_point *trial = &other;
  real mu = NEARLY;
  real nu = 2;
  int status = FL_NO_PROGRESS;
  from->state = p->work->state;
  trial->state = p->work->state + 1;
  from->factor[p->budget->buses] = 1;
  evaluate(p, from);
  real best_value = from->value; /* when it last got better by more than rounding */
  real best_size = from->size;
  int idle = 0;
  for (int k = 0; k < BUDGET_STEPS && mu <= 1 / ROUNDING; k++) {
    if (from->size <= TOLERANCE) {
      status = FL_MET;
      break;
    }
    const int has_risen = from->value > best_value + ROUNDING * FABS(best_value);
    if (has_risen || from->size < FELL * best_size) {
      best_value = from->value;
      best_size = from->size;
      idle = 0;
    }
    if (idle > BUDGET_IDLE) break;
    idle++;
    if (from->value > p->most_power) {
      status = FL_BEYOND;
      break;
    }
    p->work->newton_steps++;
    budget_step step;
    if (!find_step(p, from, mu, &step)) {
      mu *= MU_SINGULAR;
      continue;
    }
    go_along(p, from, &step, 1, trial);
    const step_result result = judged(p, &step, from, trial);
    int is_next = is_step_kept(&result, from->value, from->size, trial->size);
    real mu_next = mu_after_kept(mu, &result);
    if (result.slope_begin > 0 && (!is_next || result.slope_left < OVERSHOT)) {
      const real share = share_kept_at_top(p, &step, &result, from, trial);
      is_next = share > 0;
      mu_next = larger(mu * MU_KEPT_LEAST, ROUNDING);
      /* Where sets end, Newton's steps alone go from side to side. */
      if (share < SHORT_SHARE) mu_next = MU_SINGULAR * larger(mu, CLOSE);
    }
    if (is_next) {
      budget_point *before = from;
      mu = mu_next;
      nu = 2;
      from = trial;
      trial = before;
    } else {
      mu = mu_after_refused(mu, nu, &result);
      nu *= 2;
    }
  }
  if (status == FL_NO_PROGRESS && from->size <= STANDSTILL * TOLERANCE) status = FL_MET;
  if (from != at) *at = *from;
  p->work->state_found = at->state;
  return status;
}

/* Makes what is missing so many times as dear. */
static void make_dearer(budget_problem *p, real times) {
  for (int k = 0; k < 6; k++) p->looseness[k] /= times;
  p->ray_cost *= times;
}

/* Goes to where what is missing has become so many times as dear: all multipliers grow with that
   where the budgets bind, else they stay. */
static void follow_cost(const budget_problem *p, real times, budget_point *at) {
  budget_point grown = *at;
  at->state = p->work->state;
  evaluate(p, at);
  grown.state = p->work->state + 1;
  for (int j = 0; j < 6; j++) grown.lambda[j] *= times;
  for (int b = 0; b < p->budget->buses; b++) {
    if (grown.factor[b] > 1) grown.factor[b] *= times;
  }
  evaluate(p, &grown);
  if (grown.value > at->value) *at = grown;
}

/* Makes multipliers so many times as large, those of the budgets at least 1. */
static void scale_point(const budget_problem *p, real times, budget_point *at) {
  for (int j = 0; j < 6; j++) at->lambda[j] *= times;
  for (int b = 0; b < p->budget->buses; b++) at->factor[b] = larger(at->factor[b] * times, 1);
}

/* Newton's method from a point where one bus may not bind. At the whole cost K of what is missing
   its mu would have to fall from where the others are, K over the power, to 1. So K is small at
   first; and as multipliers are K l + m + O(1 / K), their slope there tells them at the whole
   one. */
static int find_by_small_cost(budget_problem *p, budget_point *at) {
  budget_step step;
  make_dearer(p, COST_FIRST);
  scale_point(p, COST_FIRST, at);
  int status = find_optimum(p, at);
  make_dearer(p, 1 + COST_STEP);
  if (status == FL_MET) {
    evaluate(p, at);
    if (find_step(p, at, ROUNDING, &step)) {
      const real times = (1 / COST_FIRST - 1) / COST_STEP;
      add_to(at->lambda, times, step.lambda);
      for (int b = 0; b < p->budget->buses; b++) {
        at->factor[b] = larger(at->factor[b] + times * step.factor[b], 1);
      }
    }
  }
  make_dearer(p, 1 / (COST_FIRST * (1 + COST_STEP)));
  if (status != FL_MET) return status;
  return find_optimum(p, at);
}

/* Newton's method where something may miss, from a point. Where it makes no progress, it begins
   anew at a cost of what is missing that saturates no actuator, and follows that cost up. */
static int find_best(budget_problem *p, budget_point *at) {
  const budget_point begin = *at;
  int status = FL_NO_PROGRESS;
  if (p->begins_anew && p->may_not_bind) status = find_by_small_cost(p, at);
  if (status == FL_MET) return status;
  *at = begin;
  status = find_optimum(p, at);
  if (status != FL_NO_PROGRESS) return status;
  real dearness = COST_BEGIN;
  *at = begin;
  make_dearer(p, dearness);
  real largest = 1;
  for (int b = 0; b < p->budget->buses; b++) largest = larger(largest, at->factor[b]);
  for (int j = 0; j < 6; j++) at->lambda[j] /= largest;
  for (int b = 0; b < p->budget->buses; b++) at->factor[b] = 1;
  for (;;) {
    status = find_optimum(p, at);
    if (dearness >= 1) return status;
    make_dearer(p, COST_TIMES);
    dearness *= COST_TIMES;
    follow_cost(p, COST_TIMES, at);
  }
}

/* Tells searches of gaps of what Newton's method came to. */
static void tell_point(const budget_problem *p, const budget_point *at) {
  at->state->dual_value = at->value;
  for (int i = 0; i < COUNT(p->block); i++) p->work->over_cost[i] = 1 / at->factor[p->bus[i]];
}

/* The least power of each bus [W]. */
static void find_least_power(const budget_problem *p, real *least) {
  const real nothing[2] = {0, 0};
  for (int b = 0; b <= p->budget->buses; b++) least[b] = 0;
  for (int i = 0; i < COUNT(p->block); i++)
    least[p->bus[i]] -= response_to(p, i, nothing).conjugate;
}

/* Whether the sets of forces leave a bus no answer within its budget. */
static int is_any_too_small(const budget_problem *p) {
  real least[FL_BUSES + 1];
  find_least_power(p, least);
  for (int b = 0; b < p->budget->buses; b++) {
    if (p->is_open[b] && !(least[b] < p->budget->watts[b])) return 1;
  }
  return 0;
}

/* Newton's method for one part of sets with gaps: fl_part_problem.solve. */
static int solve_part(void *data) {
  budget_problem *p = data;
  int status = FL_BEYOND;
  if (!is_any_too_small(p)) status = find_optimum(p, &p->part);
  if (status == FL_NO_PROGRESS) { /* from anew */
    p->part = p->part_begin;
    status = find_optimum(p, &p->part);
  }
  if (status == FL_MET) {
    tell_point(p, &p->part);
    return status;
  }
  tell_point(p, &p->part);
  const budget_point found = p->part;
  p->part = p->part_begin;
  p->part.state = found.state;
  return status;
}

/* What it has found is the best so far: fl_part_problem.keep. */
static void keep_part(void *data) {
  budget_problem *p = data;
  p->part_best = p->part;
}

/* Forces that are in no gap of their sets, and multipliers, of a problem from a point on; returns
   FL_MET ... */
static int find_forces_within(budget_problem *p, budget_point *at) {
  fl_work *work = p->work;
  int status;
  fl_budget_begin *begin = work->budget_begin + p->targets;
  if (p->targets < work->budget_begins) {
    memcpy(at->lambda, begin->lambda, sizeof begin->lambda);
    memcpy(at->factor, begin->factor, sizeof begin->factor);
    p->begins_anew = 0;
  }
  if (p->misses == NOTHING_MISSES) {
    status = find_optimum(p, at);
  } else {
    status = find_best(p, at);
  }
  memcpy(begin->lambda, at->lambda, sizeof begin->lambda);
  memcpy(begin->factor, at->factor, sizeof begin->factor);
  p->targets++;
  p->begins_anew = 0;
  work->budget_begins = p->targets;
  copy_forces(p->block, at->state->force, p->force);
  if (status == FL_BEYOND || !fl_may_have_gaps(p->block, work, p->force)) return status;
  tell_point(p, at);
  if (fl_worst_gap(p->block, work, p->force, at->state->lambda_reduced) < 0) return status;

  const fl_part_problem parts = {p->target, solve_part, keep_part, p};
  real bound;
  p->part = *at;
  p->part_begin = *at;
  if (!fl_search_parts(p->block, work, &parts, status, &bound)) return FL_NO_PROGRESS;
  copy_forces(p->block, work->best_force, p->force);
  *at = p->part_best;
  at->state = work->state;
  work->state_found = work->state;
  evaluate(p, at);
  return FL_MET;
}

/* Power [W] of a force (2,) of an actuator, by its tables. */
static real power_of(const real *block, const fl_work *work, int i, const real *force) {
  const fl_actuator *a = ACTUATOR(block, i);
  const fl_set *set = work->set + i;
  if (work->span.is_lost[i]) return 0;
  if (!is_plane(a)) return fl_power_of_force(block, i, force[0]);
  real size = size_of(force);
  const real along_middle = force[0] * set->cos_center + force[1] * set->sin_center;
  const int goes_either_way = set->force_max_reverse > 0;
  if (set->is_flipped || (goes_either_way && along_middle < 0)) {
    size = -size;
  } else {
    size /= fl_radius(block, i, ATAN2(force[1], force[0]));
  }
  return fl_power_of_force(block, i, clipped(size, a->force_min, a->force_max));
}

/* The number of the bus of an actuator; that behind the last one where none limits it. */
static int bus_of(const fl_budget *budget, int i) {
  if (budget->bus_of[i] == 0) return budget->buses;
  return budget->bus_of[i] - 1;
}

/* The share of forces that brings all buses to their budgets if costs are ~ T^1.5; 1 where none
   takes more than it has. */
static real share_within(const real *block, const fl_work *work, const fl_budget *budget,
                         real force[][2]) {
  real power[FL_BUSES + 1] = {0};
  for (int i = 0; i < COUNT(block); i++) {
    power[bus_of(budget, i)] += power_of(block, work, i, force[i]);
  }
  real share = 1;
  for (int b = 0; b < budget->buses; b++) {
    const real watts = budget->watts[b];
    if (!(power[b] > (1 + BUDGET_KEPT) * watts)) continue;
    share = smaller(share, POW(watts / power[b], EXPONENT_GUESS));
  }
  return share;
}

int fl_exceeds_budget(const real *block, const fl_work *work, const fl_budget *budget,
                      real force[][2]) {
  return share_within(block, work, budget, force) < 1;
}

/* Whether one bus feeds all actuators that work. */
static int feeds_all(const real *block, const fl_work *work, const fl_budget *budget) {
  for (int i = 0; i < COUNT(block); i++) {
    if (!work->span.is_lost[i] && budget->bus_of[i] != 1) return 0;
  }
  return budget->buses == 1;
}

/* The most that all actuators take within the budgets [W]. */
static real most_power_within(const budget_problem *p) {
  const int buses = p->budget->buses;
  real power[FL_BUSES + 1] = {0};
  for (int i = 0; i < COUNT(p->block); i++) {
    if (!p->work->span.is_lost[i]) power[p->bus[i]] += p->work->power_max[i];
  }
  real sum = power[buses];
  for (int b = 0; b < buses; b++) sum += smaller(power[b], p->budget->watts[b]);
  return sum * (1 + NOTHING) + NOTHING;
}

/* What to begin with: prices, and the scaled wrench that they give, both along the axes that are
   asked for or in the basis. */
typedef struct {
  real nu[6];    /* multipliers over mu [W] */
  real given[6]; /* [1] */
} budget_begin;

/* Begins at prices, with a scale mu of all multipliers at which those of what misses are the
   same. */
static void begin_at(budget_problem *p, const budget_begin *begin, budget_point *at) {
  real factor = 1;
  p->begins_anew = 1;
  if (p->misses & RAY_MISSES) {
    const real worth = dot(begin->nu, p->target, 6);
    const real share = dot(begin->given, p->target, 6) / dot(p->target, p->target, 6);
    if (worth > 0) factor = p->ray_cost * clipped(1 - share, 0, 1) / worth;
  } else if (p->misses & AXES_MISS) {
    real worth = 0;
    real squared = 0;
    for (int k = 0; k < 6; k++) {
      const real nu = begin->nu[k];
      worth += nu * (p->target[k] - begin->given[k]);
      squared += p->looseness[k] * nu * nu;
    }
    if (squared > 0) factor = worth / squared;
  }
  factor = larger(factor, 1);
  for (int j = 0; j < 6; j++) at->lambda[j] = factor * begin->nu[j];
  for (int b = 0; b < p->budget->buses; b++) at->factor[b] = p->is_open[b] ? factor : 1;
}

/* Asks for a wrench (6,) [N, N m] in axes of a weight above 0, of which nothing misses. */
static void ask_for_axes(budget_problem *p, const real *weight, const real *wrench) {
  const fl_span *span = &p->work->span;
  p->misses = NOTHING_MISSES;
  p->is_in_axes = 1;
  for (int k = 0; k < 6; k++) {
    p->axis[k] = span->axis_counts[k] && weight[k] > 0;
    p->target[k] = 0;
    p->looseness[k] = 0;
    if (p->axis[k]) p->target[k] = wrench[k] / span->axis_scale[k];
  }
}

/* The same of which any may miss, by the weights (6,) over the wrench scale. */
static void let_axes_miss(budget_problem *p, const real *weight, const real *wrench) {
  const real *sigma = HEAD(p->block)->wrench_scale;
  ask_for_axes(p, weight, wrench);
  p->misses = AXES_MISS;
  p->most_power = INFEASIBLE_COST;
  for (int k = 0; k < 6; k++) {
    if (!p->axis[k]) continue;
    const real scale = sigma[k] / (p->work->span.axis_scale[k] * weight[k]);
    p->looseness[k] = scale * scale / p->miss_cost;
  }
}

/* What the whole of a wrench costs that misses [W]. */
static real cost_of_ray(const budget_problem *p, const real *wrench) {
  real squared = 0;
  for (int k = 0; k < 6; k++) {
    const real normalized = wrench[k] / HEAD(p->block)->wrench_scale[k];
    squared += normalized * normalized;
  }
  return p->miss_cost * larger(squared, NOTHING);
}

/* Asks for a wrench of which a share may miss. */
static void let_ray_miss(budget_problem *p, const real *wrench) {
  p->misses = RAY_MISSES;
  p->is_in_axes = 0;
  p->most_power = INFEASIBLE_COST;
  p->ray_cost = cost_of_ray(p, wrench);
  fl_reduce_wrench(p->work, wrench, p->target);
}

/* Asks for a wrench of which a share may miss, and for more, any wrench across it. */
static void let_all_miss(budget_problem *p, const real *wrench) {
  const real weight[6] = {ACROSS_RAY, ACROSS_RAY, ACROSS_RAY, ACROSS_RAY, ACROSS_RAY, ACROSS_RAY};
  let_axes_miss(p, weight, wrench);
  p->misses = AXES_MISS | RAY_MISSES;
  p->ray_cost = cost_of_ray(p, wrench);
}

/* The least power for a wrench within the budgets, where that is not the least of all. */
static int meet_wrench(budget_problem *p, const real *wrench, const real *lambda_reduced,
                       budget_point *at) {
  p->misses = NOTHING_MISSES;
  p->is_in_axes = 0;
  p->most_power = most_power_within(p);
  fl_reduce_wrench(p->work, wrench, p->target);
  memcpy(at->lambda, lambda_reduced, sizeof at->lambda);
  for (int b = 0; b < p->budget->buses; b++) at->factor[b] = 1;
  return find_forces_within(p, at);
}

/* An answer without budgets, from which policies begin. */
typedef struct {
  real lambda_reduced[6]; /* [W] */
  real wrench[6];         /* scaled, in the basis */
  real share;             /* of it that may be within the budgets */
  int is_met;             /* whether it is what was asked for */
} budget_free_answer;

/* What to begin with where all axes are asked for alike. */
static void begin_with_share(const budget_problem *p, const budget_free_answer *before,
                             budget_begin *begin) {
  real given[6];
  real nu[6];
  real mu;
  for (int j = 0; j < 6; j++) given[j] = before->share * before->wrench[j];
  for (int j = 0; j < 6; j++) nu[j] = SQRT(before->share) * before->lambda_reduced[j];
  if (!before->is_met) fl_first_lambda(p->block, p->work, given, nu, &mu);
  along_axes(p, given, begin->given);
  along_axes(p, nu, begin->nu);
}

static int serve_closest(budget_problem *p, const fl_policy *policy, const real *wrench,
                         const budget_free_answer *before, budget_point *at) {
  real weight[6];
  budget_begin begin;
  for (int k = 0; k < 6; k++) weight[k] = larger(policy->axis_weight[k], CLOSE);
  let_axes_miss(p, weight, wrench);
  begin_with_share(p, before, &begin);
  begin_at(p, &begin, at);
  return find_forces_within(p, at);
}

/* Where actuators that cannot rest give no share of the wrench alone, what is nearest to one. */
static int serve_direction(budget_problem *p, const real *wrench, const budget_free_answer *before,
                           budget_point *at) {
  budget_begin begin;
  let_ray_miss(p, wrench);
  begin_with_share(p, before, &begin);
  begin_at(p, &begin, at);
  const int status = find_forces_within(p, at);
  if (status == FL_MET) return status;
  let_all_miss(p, wrench);
  begin_with_share(p, before, &begin);
  begin_at(p, &begin, at);
  return find_forces_within(p, at);
}

/* Weights of axes when a group is served: those of groups before it are held. Returns whether it
   has any. */
static int weigh_group(const fl_span *span, const unsigned char *group, real *weight) {
  int has_axes = 0;
  for (int k = 0; k < 6; k++) {
    if (weight[k] > 0) weight[k] = HELD_AXIS;
    if (!group[k] || !span->axis_counts[k]) continue;
    weight[k] = 1;
    has_axes = 1;
  }
  return has_axes;
}

/* Of one bus for all: the most groups that can be met together, from the first one on. `begin`
   becomes prices for these, and what they give; `power` what they take [W]. */
static int groups_within(budget_problem *p, const fl_policy *policy, const real *wrench,
                         const budget_free_answer *before, budget_begin *begin, real *power) {
  for (int groups = policy->group_count - 1; groups > 0; groups--) {
    real weight[6] = {0};
    budget_point at;
    for (int g = 0; g < groups; g++) weigh_group(&p->work->span, policy->group[g], weight);
    ask_for_axes(p, weight, wrench);
    p->most_power = p->budget->watts[0];
    p->keeps_budgets = 0;
    along_axes(p, before->lambda_reduced, at.lambda);
    at.factor[0] = 1;
    const int status = find_optimum(p, &at);
    p->keeps_budgets = 1;
    if (status != FL_MET || at.power[0] > p->budget->watts[0]) continue;
    memcpy(begin->nu, at.lambda, sizeof begin->nu);
    memcpy(begin->given, p->target, sizeof begin->given);
    *power = at.power[0];
    return groups;
  }
  return 0;
}

/* Has a group begin at the share of it that what others leave of the budget may give. */
static void begin_with_held(const budget_problem *p, const real *weight,
                            const budget_free_answer *before, const budget_begin *held,
                            real power_held, budget_begin *begin) {
  const real watts = p->budget->watts[0];
  const real power = watts / POW(before->share, 1 / EXPONENT_GUESS); /* of all groups */
  const real left = larger(watts - power_held, 0);
  const real share = POW(left / larger(power - power_held, TINY), EXPONENT_GUESS);
  const real times = smaller(share, 1) / before->share;
  for (int k = 0; k < 6; k++) {
    if (weight[k] > 1) {
      begin->nu[k] = held->nu[k];
      begin->given[k] = held->given[k];
    } else {
      begin->nu[k] *= SQRT(times);
      begin->given[k] *= times;
    }
  }
}

/* Whether what is missing leaves no choice of an actuator's force: that of a bus whose power is
   dear because of it, or one at a limit that a price holds there which is large because of it. */
static int has_no_choice(const budget_problem *p, const budget_point *at, int i) {
  const real factor = at->factor[p->bus[i]];
  const real usual = p->work->power_max[i] / ACTUATOR(p->block, i)->row_force_max[0]; /* [W/N] */
  real price[2];
  actuator_price(p->work, i, at->state->lambda_reduced, price);
  return factor >= DEAR || size_of(price) >= DEAR * factor * usual;
}

/* Leaves an actuator a force [N] and nothing else. */
static void settle_at(budget_problem *p, int i, const real *force) {
  p->settled_power[i] = power_of(p->block, p->work, i, force);
  p->settled_force[i][0] = force[0];
  p->settled_force[i][1] = force[1];
  p->is_settled[i] = 1;
  p->has_settled = 1;
  fl_fix_force(p->block, i, p->work->set + i, force);
}

/* Settles the forces of actuators of which what is missing leaves no choice. Returns whether that
   are all. */
static int settle(budget_problem *p, budget_point *at) {
  int has_choice = 0;
  int is_open[FL_BUSES + 1] = {0};
  for (int i = 0; i < COUNT(p->block); i++) {
    if (p->is_settled[i] || p->work->span.is_lost[i]) continue;
    const int goes_either_way = p->work->set[i].force_max_reverse > 0;
    if (goes_either_way || !has_no_choice(p, at, i)) {
      has_choice = 1;
      is_open[p->bus[i]] = 1;
      continue;
    }
    settle_at(p, i, p->force[i]);
  }
  for (int b = 0; b < p->budget->buses; b++) {
    p->is_open[b] = is_open[b];
    if (!is_open[b] && has_choice) at->factor[b] = 1;
  }
  return !has_choice;
}

/* Policy FL_PRIORITY: groups of axes in order, each as near as those before it allow. */
static int serve_groups(budget_problem *p, const fl_policy *policy, const real *wrench,
                        int is_bus_of_all, const budget_free_answer *before, budget_point *at) {
  const real *sigma = HEAD(p->block)->wrench_scale;
  const fl_span *span = &p->work->span;
  budget_begin held = {{0}, {0}};
  real power_held = 0;
  real wanted[6];
  real weight[6] = {0};
  int first = 0;
  int status = FL_NO_PROGRESS;
  memcpy(wanted, wrench, sizeof wanted);
  if (is_bus_of_all && before->is_met) {
    first = groups_within(p, policy, wrench, before, &held, &power_held);
  }
  for (int g = 0; g < policy->group_count; g++) {
    const unsigned char *group = policy->group[g];
    if (!weigh_group(span, group, weight) || g < first) continue;
    let_axes_miss(p, weight, wanted);
    if (status != FL_MET) { /* else where the groups before it ended */
      budget_begin begin;
      begin_with_share(p, before, &begin);
      if (first > 0) begin_with_held(p, weight, before, &held, power_held, &begin);
      begin_at(p, &begin, at);
    }
    status = find_forces_within(p, at);
    if (status != FL_MET) return status;
    real missed = 0;
    int binds = 0;
    for (int b = 0; b < p->budget->buses; b++) binds |= at->factor[b] > 1;
    for (int k = 0; k < 6; k++) {
      const real missing = at->missing[k] * span->axis_scale[k];
      if (group[k] && p->axis[k]) missed = larger(missed, FABS(missing) / sigma[k]);
    }
    if (missed <= CLOSE && !binds) continue; /* what is missing is what a miss costs too little */
    for (int k = 0; k < 6; k++) {
      if (group[k] && p->axis[k]) wanted[k] -= at->missing[k] * span->axis_scale[k];
    }
    if (missed > NEARLY && settle(p, at)) break; /* all that follows has no choice left */
  }
  return status;
}

/* Takes what was found, whose wrench is `out->wrench_served`, into an answer. */
static void take_point(budget_problem *p, const budget_point *at, fl_answer *out) {
  real weighted = 0;
  real sum = 0;
  for (int b = 0; b <= p->budget->buses; b++) {
    if (b < p->budget->buses) weighted += at->factor[b] * at->power[b];
    if (b < p->budget->buses) sum += at->power[b];
  }
  real mean = 1; /* the price of the power itself: buses share it by what they take */
  if (sum > 0) mean = weighted / sum;
  for (int j = 0; j < 6; j++) out->lambda_reduced[j] = at->state->lambda_reduced[j] / mean;
  for (int b = 0; b < p->budget->buses; b++) p->work->bus_binds[b] = at->factor[b] > 1;
  copy_forces(p->block, p->force, out->force);
  out->gap_power_bound = 0;
}

/* Has the actuators of a bus take as little as they can. */
static void close_bus(budget_problem *p, int bus) {
  const real nothing[2] = {0, 0};
  p->is_open[bus] = 0;
  for (int i = 0; i < COUNT(p->block); i++) {
    const fl_set *set = p->work->set + i;
    if (p->bus[i] != bus || p->work->span.is_lost[i]) continue;
    response y = response_to(p, i, nothing);
    if (is_plane(ACTUATOR(p->block, i)) && size_of(y.force) < set->force_min) {
      y.force[0] = set->force_min * set->cos_center;
      y.force[1] = set->force_min * set->sin_center;
    }
    settle_at(p, i, y.force);
  }
}

/* Closes buses that take more than they have whatever is given, as where rates hold their
   actuators. */
static void close_buses(budget_problem *p) {
  real least[FL_BUSES + 1];
  find_least_power(p, least);
  for (int b = 0; b < p->budget->buses; b++) {
    if (least[b] < p->budget->watts[b]) continue;
    p->exceeds |= least[b] > (1 + BUDGET_KEPT) * p->budget->watts[b];
    close_bus(p, b);
  }
}

/* Where Newton's method has found no answer within the budgets: a share of the forces without
   them. Returns whether there is one. */
static int take_share(budget_problem *p, fl_answer *out) {
  if (p->has_settled) return 0;
  for (int k = 0; k < SHARES; k++) {
    const real share = share_within(p->block, p->work, p->budget, out->force);
    if (!(share < 1)) {
      fl_wrench_of_forces(p->block, p->work, out->force, out->wrench_served);
      out->gap_power_bound = 0;
      return 1;
    }
    for (int i = 0; i < COUNT(p->block); i++) {
      out->force[i][0] *= share;
      out->force[i][1] *= share;
    }
  }
  return 0;
}

/* Where no answer was found within the budgets: least power of all that have one. */
static void take_least_power(budget_problem *p, fl_answer *out) {
  for (int b = 0; b < p->budget->buses; b++) close_bus(p, b);
  for (int i = 0; i < COUNT(p->block); i++) {
    if (!p->is_settled[i]) continue;
    out->force[i][0] = p->settled_force[i][0];
    out->force[i][1] = p->settled_force[i][1];
  }
  fl_wrench_of_forces(p->block, p->work, out->force, out->wrench_served);
  out->gap_power_bound = 0;
  p->exceeds = 1;
}

/* Prepares the problem of a question. */
static void begin_problem(const real *block, fl_work *work, const fl_budget *budget,
                          budget_problem *p) {
  p->block = block;
  p->work = work;
  p->budget = budget;
  p->keeps_budgets = 1;
  p->exceeds = 0;
  p->has_settled = 0;
  p->targets = 0;
  p->may_not_bind = !feeds_all(block, work, budget);
  p->miss_cost = 0;
  for (int b = 0; b < FL_BUSES; b++) p->is_open[b] = 1;
  for (int i = 0; i < COUNT(block); i++) {
    p->bus[i] = bus_of(budget, i);
    p->is_settled[i] = 0;
    p->miss_cost += MISS_COST * work->power_max[i];
  }
}

/* Finds forces for a wrench within the budgets, or for what a policy gives in its place; returns
   whether it has. */
static int find_within_budget(budget_problem *p, const real *wrench, const fl_policy *policy,
                              fl_answer *out) {
  const real *block = p->block;
  fl_work *work = p->work;
  const fl_budget *budget = p->budget;
  budget_point at;
  budget_free_answer before;
  close_buses(p);
  const int is_bus_of_all = feeds_all(block, work, budget);
  before.is_met = out->is_attainable;
  before.share = share_within(block, work, budget, out->force);
  if (before.is_met && !is_bus_of_all) {
    const int is_known = work->budget_begins > 0 && work->is_budget_too_small;
    if (is_known) {
      p->targets = 1;
    } else if (meet_wrench(p, wrench, out->lambda_reduced, &at) == FL_MET) {
      work->is_budget_too_small = 0;
      take_point(p, &at, out);
      return !p->exceeds;
    }
    work->is_budget_too_small = 1;
  }

  memcpy(before.lambda_reduced, out->lambda_reduced, sizeof before.lambda_reduced);
  fl_wrench_of_forces(block, work, out->force, out->wrench_served);
  fl_reduce_wrench(work, out->wrench_served, before.wrench);
  out->is_attainable = 0;
  int status;
  if (policy->kind == FL_DIRECTION) {
    status = serve_direction(p, wrench, &before, &at);
  } else if (policy->kind == FL_PRIORITY) {
    status = serve_groups(p, policy, wrench, is_bus_of_all, &before, &at);
  } else {
    status = serve_closest(p, policy, wrench, &before, &at);
  }
  if (status != FL_MET && policy->kind != FL_CLOSEST) {
    status = serve_closest(p, policy, wrench, &before, &at);
  }
  if (status != FL_MET) {
    if (take_share(p, out)) return 1;
    take_least_power(p, out);
    return 0;
  }
  if (p->misses == RAY_MISSES) {
    for (int k = 0; k < 6; k++) out->wrench_served[k] = (1 - at.missing_share) * wrench[k];
  } else {
    fl_wrench_of_forces(block, work, p->force, out->wrench_served);
  }
  take_point(p, &at, out);
  return !p->exceeds;
}

int fl_keep_budget(const real *block, fl_work *work, const real *wrench, const fl_policy *policy,
                   const fl_budget *budget, fl_answer *out) {
  budget_problem p;
  fl_set before[FL_MOST];
  if (work->has_turn_cost || work->has_drag || !policy) return 0;
  copy_sets(block, work->set, before);
  begin_problem(block, work, budget, &p);
  const int is_kept = find_within_budget(&p, wrench, policy, out);
  if (p.has_settled) fl_restore_sets(block, work, before);
  for (int i = 0; i < COUNT(block); i++) work->over_cost[i] = 1;
  return is_kept && !p.exceeds;
}
