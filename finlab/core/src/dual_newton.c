/* Newton's method on the dual, for one target.

       max over lambda of  g(lambda) = lambda.w - sum c*(B'lambda)
       with gradient       r = w - sum B y(B'lambda)

   g is concave, its Hessian is -G with G = sum B (dy/ds) B'. Where actuators are at their
   limits G loses rank. A damping mu keeps the step finite, and is adapted to what a step
   brought (Levenberg, Marquardt):

       (G_mu + mu c max(tr G_mu, tau) M) step = r    with    G_mu = G + mu S

   S = sum B (|y|/|s|) B' is the same as G, but of forces over prices, which limits leave as
   they are; of a foil it is that of its lift. M is the Hessian of quadratic costs over its mean,
   and tau a millionth of that Hessian's trace (trace_min). c is SATURATED. A step that goes too
   far ends where the dual value is largest along it; where sets have kinks, only where that is at
   the jump of a foil's lift.
   Vectors in the basis have 6 numbers, those behind its range are 0.

       lambda  multipliers of the wrench, in the basis of driven directions [W]    Eq. 3
       s       price of one actuator's force, s = B' lambda [W/N]                  Eq. 4
       y       force with which it responds, y = grad c*(s) [N]                    Eq. 5
       r       residual, r = w - sum B y = grad g(lambda)                          Eq. 6
       G       sum B (dy/ds) B', minus the Hessian of g                            Eq. 7
       mu, nu  damping of the step; its growth after a refused one                 Eq. 8
       S       secants of the responses                                            Eq. 9
       l       share of the slope that is left at the end of a step                Eq. 10 */
#include "step_control.h"
#include "symmetric.h"

#define JUMPS 4            /* trials with a jump after which Newton's method stands still */
#define JUMP_STEP R(1e-3)  /* squared step, over squared multipliers, too long to judge */
#define SHORT_STEP R(1e-7) /* the same, in which any large change of a force is a jump */
/* What squared multipliers count at least in these two, over NOTHING and the squared cost C. */
#define MULTIPLIERS_MIN 100

/* Scaled wrench in the basis. */
void fl_reduce_wrench(const fl_work *work, const real *wrench, real *target_reduced) {
  const fl_span *span = &work->span;
  memset(target_reduced, 0, 6 * sizeof *target_reduced);
  for (int k = 0; k < 6; k++) {
    const real scaled = wrench[k] / span->axis_scale[k];
    for (int j = 0; j < 6; j++) target_reduced[j] += span->basis[k][j] * scaled;
  }
}

/* Multipliers in the basis [W] of those of the wrench [W/N, W/(N m)]. */
void fl_reduce_lambda(const fl_work *work, const real *lambda, real *lambda_reduced) {
  const fl_span *span = &work->span;
  memset(lambda_reduced, 0, 6 * sizeof *lambda_reduced);
  for (int k = 0; k < 6; k++) {
    for (int j = 0; j < 6; j++) {
      lambda_reduced[j] += span->basis[k][j] * span->axis_scale[k] * lambda[k];
    }
  }
}

/* Whether a wrench lies in the range of the effectiveness but for rounding. */
int fl_is_in_range(const fl_work *work, const real *wrench, const real *target_reduced) {
  const fl_span *span = &work->span;
  real outside_squared = 0;
  real size_squared = 0;
  for (int k = 0; k < 6; k++) {
    const real scaled = wrench[k] / span->axis_scale[k];
    const real outside = scaled - dot(span->basis[k], target_reduced, 6);
    outside_squared += outside * outside;
    size_squared += scaled * scaled;
  }
  const real rounding = larger(NEARLY, 10 * ROUNDING);
  return SQRT(outside_squared) <= rounding * (WRENCH_MIN + SQRT(size_squared));
}

/* The wrench [N, N m] of forces, sum B y. */
void fl_wrench_of_forces(const real *block, const fl_work *work, real force[][2], real *wrench) {
  const fl_span *span = &work->span;
  real reduced[6] = {0};
  for (int i = 0; i < COUNT(block); i++) {
    for (int row = 0; row < (int)ACTUATOR(block, i)->rows; row++) {
      /* all six, so that compilers know how many */
      for (int j = 0; j < 6; j++) {
        reduced[j] += force[i][row] * span->effectiveness_reduced[i][row][j];
      }
    }
  }
  for (int k = 0; k < 6; k++) wrench[k] = span->axis_scale[k] * dot(span->basis[k], reduced, 6);
}

/* The largest cost [W] within a set: C of Eq. 13 is the sum of all. */
static real largest_cost(const fl_set *set) {
  real reverse_cost = 0;
  if (set->force_max_reverse > 0) reverse_cost = set->cost_at_max_reverse;
  return larger(larger(set->cost_at_min, set->cost_at_max), reverse_cost);
}

/* Sets what follows from all sets: the largest cost, and which kinds of sets there are. */
void fl_prepare_sets(const real *block, fl_work *work) {
  work->power_cost_max = 0;
  work->is_convex = 1;
  work->has_forks = 0;
  work->has_zones = 0;
  work->has_drag = 0;
  work->has_turn_cost = 0;
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    const fl_set *set = work->set + i;
    work->power_cost_max += largest_cost(set);
    if (set->turn_cost > 0) {
      const real farthest =
          smaller(FABS(set->sector_center - set->turn_origin) + set->sector_half_angle, PI);
      work->power_cost_max += set->turn_cost / 2 * farthest * farthest;
      work->has_turn_cost = 1;
    }
    work->has_forks |= set->is_forked || set->force_max_reverse > 0;
    work->has_drag |= is_foil(a) && !work->span.is_lost[i];
    work->has_zones |= FL_ZONES > 0 && a->barred_count > 0;
    if (fl_has_barred_zone(a, set)) work->is_convex = 0;
    if (work->has_forks || work->has_drag || work->has_turn_cost || a->dead_band > 0)
      work->is_convex = 0;
  }
}

/* Sets whether the sets of a question have kinks: for all its parts, though a cut may leave
   none. */
void fl_find_kinks(const real *block, fl_work *work) {
  work->has_kinks = work->has_forks || work->has_drag || work->has_turn_cost;
  for (int i = 0; i < COUNT(block); i++) {
    work->has_kinks |= is_plane(ACTUATOR(block, i)) && work->set[i].force_min > 0;
  }
}

void fl_restore_sets(const real *block, fl_work *work, const fl_set *set) {
  copy_sets(block, set, work->set);
  fl_prepare_sets(block, work);
}

/* Size of a force, or of a price, along one direction or in a plane; of a foil that of its lift. */
static real length(const fl_actuator *a, const real *vector) {
  if (is_plane(a)) return size_of(vector);
  return FABS(vector[0]);
}

/* Evaluates the dual at multipliers, for a target in the basis: its value, its gradient and
   the responses. */
void fl_dual_at(const real *block, const fl_work *work, const real *target_reduced,
                const real *lambda, fl_state *state) {
  real wrench[6] = {0}; /* sum B y */
  real conjugate = 0;   /* sum c*(s) */
#ifdef HAS_PAIRS
  fl_add_lines(block, work, lambda, state, wrench, &conjugate);
  const int has_others = work->line_count < COUNT(block);
#else
  const int has_others = 1;
#endif
  for (int i = 0; has_others && i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
#ifdef HAS_PAIRS
    if (a->rows == 1) continue;
#endif
    real s[2];
    actuator_price(work, i, lambda, s);
    const response answer = fl_response(block, i, work->set + i, s); /* y, dy/ds, c*(s): Eq. 4, 5 */
    const real *y = answer.force;

    state->force[i][0] = y[0];
    state->force[i][1] = y[1];
    state->dy_ds[i][0] = answer.xx;
    state->dy_ds[i][1] = answer.xy;
    state->dy_ds[i][2] = answer.yy;
    state->push_angle[i] = answer.angle;
    const real size_s = length(a, s);
    const real size_y = length(a, y);
    /* |y| / |s| of S, Eq. 9; near rest that of quadratic costs */
    const real price_quadratic = a->row_force_max[0] / a->secant[0];
    state->secant[i] = size_y / larger(size_s, price_quadratic);
    conjugate += answer.conjugate;
    const real(*B)[6] = work->span.effectiveness_reduced[i];
    for (int j = 0; j < 6; j++) wrench[j] += y[0] * B[0][j] + y[1] * B[1][j];
  }
  for (int j = 0; j < 6; j++) {
    state->lambda_reduced[j] = lambda[j];
    state->residual[j] = target_reduced[j] - wrench[j]; /* Eq. 6 */
  }
  state->dual_value = dot(lambda, target_reduced, 6) - conjugate; /* Eq. 3 */
  state->residual_size = SQRT(dot(state->residual, state->residual, 6));
}

/* Starts Newton's method at given multipliers: work->state_found is the dual there. */
void fl_dual_start(const real *block, fl_work *work, const real *target_reduced,
                   const real *lambda) {
  work->state_found = work->state;
  fl_dual_at(block, work, target_reduced, lambda, work->state);
}

/* Solves (G_mu + mu c max(tr G_mu, tau) M) step = r with G_mu = G + mu S, Eq. 8; 0 where that is
   singular to rounding. */
static int newton_step(const real *block, const fl_work *work, const fl_state *at, real mu,
                       real *step) {
  symmetric sum = no_matrix(); /* G_mu */
  for (int i = 0; i < COUNT(block); i++) {
    const real(*B)[6] = work->span.effectiveness_reduced[i];
    const real *dy_ds = at->dy_ds[i];
    const real xx = dy_ds[0] + mu * at->secant[i];
    const real xy = dy_ds[1];
    real yy = dy_ds[2];
    if (is_plane(ACTUATOR(block, i))) yy += mu * at->secant[i];
    if (ACTUATOR(block, i)->rows != 1) {
      add_plane(&sum, B[0], B[1], xx, xy, yy);
    } else {
      add_square(&sum, B[0], xx);
    }
  }
  symmetric H = sum;
  const real trace = larger(trace_of(&H), work->trace_min);
  add_matrix(&H, work->metric, SATURATED * mu * trace);
  return solve_symmetric(&H, at->residual, step);
}

/* How many responses jump between two states a step apart; where wanted they are marked as
   what is to be cut. */
static int jumps_between(const real *block, fl_work *work, const fl_state *one,
                         const fl_state *other, const real *step, int marked) {
  const real full = NOTHING * work->power_cost_max; /* in a hole around rest multipliers go to 0 */
  const real step_squared = dot(step, step, 6);
  const real lambda_squared = dot(one->lambda_reduced, one->lambda_reduced, 6) +
                              MULTIPLIERS_MIN * work->power_cost_max * full;
  if (!(step_squared < JUMP_STEP * lambda_squared)) return 0;
  const int is_short = step_squared < SHORT_STEP * lambda_squared;
  int jumps = 0;
  for (int i = 0; i < COUNT(block); i++) {
    fl_set *set = work->set + i;
    if (!(set->turn_cost > 0)) continue;
    real s[2];
    actuator_price(work, i, step, s);
    if (!fl_has_jumped(block, i, set, one, other, s, is_short)) continue;
    jumps++;
    if (marked) fl_mark_jump(set, one->push_angle[i], other->push_angle[i]);
  }
  return jumps;
}

/* Multipliers at a share of a step. */
static void lambda_after(const fl_state *from, const real *step, real share, real *lambda) {
  for (int j = 0; j < 6; j++) lambda[j] = from->lambda_reduced[j] + share * step[j];
}

static step_result judged_step(const real *step, const fl_state *from, const fl_state *to) {
  return step_result_of(dot(step, from->residual, 6), dot(step, to->residual, 6),
                        to->dual_value - from->dual_value);
}

static int is_kept(const step_result *result, const fl_state *from, const fl_state *to) {
  return is_step_kept(result, from->dual_value, from->residual_size, to->residual_size);
}

/* Makes a trial that went too far along a step the dual where its value is largest: at the jump of
   a foil, or else where secants and halves of the slope, in turn, lead to. Where sets have kinks
   the slope does not tell. Returns whether the trial is kept. */
static int is_kept_at_top(const real *block, const fl_work *work, const real *target_reduced,
                          const real *step, const step_result *result, const fl_state *at,
                          fl_state *trial) {
  real slope_low = result->slope_begin;
  real slope_high = result->slope_end;
  real low = 0;
  real high = 1;
  int steps = SEARCH_STEPS;
  if (work->has_kinks) {
    if (!fl_go_to_jump(block, work, target_reduced, step, slope_low, at, trial)) return 0;
    steps = 0;
  }
  for (int k = 0; k < steps; k++) {
    real lambda[6];
    real part = R(0.5); /* of the interval, from its low end */
    if (k % 2 == 0) part = slope_low / (slope_low - slope_high);
    const real share = low + part * (high - low);
    lambda_after(at, step, share, lambda);
    fl_dual_at(block, work, target_reduced, lambda, trial);
    const real slope = dot(step, trial->residual, 6);
    if (FABS(slope) <= SLOPE_ENOUGH * result->slope_begin) break;
    if (slope > 0) {
      low = share;
      slope_low = slope;
    } else {
      high = share;
      slope_high = slope;
    }
  }
  const step_result shorter = judged_step(step, at, trial);
  return is_kept(&shorter, at, trial);
}

/* Newton's method from multipliers on, or from its own first ones where there are none.
   work->state_found is the dual at the multipliers that it comes to, however it ends. Returns
   FL_MET, FL_BEYOND (also where all answers take more than work->power_of_use) or
   FL_NO_PROGRESS. */
int fl_dual_newton(const real *block, fl_work *work, const real *target_reduced, const real *lambda,
                   int most_steps) {
  /* No forces cost more than C: a larger value proves that none add up to the target, Eq. 13. */
  const real most_power = work->power_cost_max * (1 + NOTHING) + NOTHING;
  const real beyond = smaller(most_power, work->power_of_use);
  real mu = NEARLY;
  real nu = 2; /* growth of mu after a refused step; doubles with each in a row (Nielsen) */
  real lambda_first[6];
  if (!lambda) {
    fl_first_lambda(block, work, target_reduced, lambda_first, &mu);
    lambda = lambda_first;
  }
  fl_dual_start(block, work, target_reduced, lambda);
  fl_state *at = work->state;
  fl_state *trial = work->state + 1;
  real best_value = at->dual_value; /* when it last got better by more than rounding */
  real best_size = at->residual_size;
  int idle = 0;
  int jumps = 0;
  int is_met = 0;
  for (int i = 0; work->has_turn_cost && i < COUNT(block); i++) work->set[i].has_jumped = 0;
  for (int k = 0;; k++) {
    if (at->residual_size <= work->residual_enough) {
      /* Near the rim multipliers magnify what is left: one step more makes it nothing. */
      const int is_rough = work->residual_enough > TOLERANCE;
      if (is_met || is_rough || at->residual_size <= SURE_SHARE * TOLERANCE) return FL_MET;
      is_met = 1;
    }
    if (at->dual_value > beyond) return FL_BEYOND;
    const int has_risen = at->dual_value > best_value + ROUNDING * FABS(best_value);
    if (has_risen || at->residual_size < FELL * best_size) {
      best_value = at->dual_value;
      best_size = at->residual_size;
      idle = 0;
    }
    const int has_diverged = !(mu <= 1 / ROUNDING); /* or is NaN */
    if (k >= most_steps || idle > IDLE || has_diverged) {
      if (at->residual_size <= ENOUGH) return FL_MET;
      return FL_NO_PROGRESS;
    }
    idle++;
    work->newton_steps++;

    real step[6];
    if (!newton_step(block, work, at, mu, step)) {
      mu *= MU_SINGULAR;
      continue;
    }
    real lambda_next[6];
    lambda_after(at, step, 1, lambda_next);
    fl_dual_at(block, work, target_reduced, lambda_next, trial);
    if (work->has_turn_cost && jumps_between(block, work, at, trial, step, 0)) {
      jumps++;
      if (jumps >= JUMPS) {
        jumps_between(block, work, at, trial, step, 1);
        return FL_NO_PROGRESS;
      }
    }
    const step_result result = judged_step(step, at, trial);
    int is_next = is_kept(&result, at, trial);
    real mu_next = mu_after_kept(mu, &result);
    if (!is_next || (!work->has_kinks && result.slope_left < OVERSHOT)) {
      is_next = is_kept_at_top(block, work, target_reduced, step, &result, at, trial);
      mu_next = larger(mu * MU_KEPT_LEAST, ROUNDING);
    }
    if (is_next) {
      mu = mu_next;
      nu = 2;
      work->state_found = trial;
      trial = at;
      at = work->state_found;
    } else {
      mu = mu_after_refused(mu, nu, &result);
      nu *= 2;
      /* A refused step does not count as idle: its growing mu ends the loop. */
      idle--;
    }
  }
}
