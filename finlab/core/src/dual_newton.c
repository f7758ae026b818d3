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
#include "internal.h"

#define OVERSHOT R(-0.3)     /* share of the slope below which a kept step went too far, too */
#define SEARCH_STEPS 12      /* of the search for where a step that went too far is to end */
#define SLOPE_ENOUGH R(0.05) /* share of the slope that it may leave */
#define HALVED 4             /* of so many steps of it one is by halves */
#define JUMPS 4              /* trials with a jump after which Newton's method stands still */
#define JUMP_STEP R(1e-3)    /* squared step, over squared multipliers, too long to judge */
#define SHORT_STEP R(1e-7)   /* the same, in which any large change of a force is a jump */
/* What squared multipliers count at least in these two, over NOTHING and the squared cost C. */
#define MULTIPLIERS_MIN 100

/* Scaled wrench in the basis. */
void fl_reduce_wrench(const fl_work *work, const real *wrench, real *target_reduced) {
  const fl_span *span = &work->span;
  for (int j = 0; j < 6; j++) {
    target_reduced[j] = 0;
    for (int k = 0; k < 6; k++)
      target_reduced[j] += span->basis[k][j] * (wrench[k] / span->axis_scale[k]);
  }
}

/* Multipliers in the basis [W] of those of the wrench [W/N, W/(N m)]. */
void fl_reduce_lambda(const fl_work *work, const real *lambda, real *lambda_reduced) {
  const fl_span *span = &work->span;
  for (int j = 0; j < 6; j++) {
    lambda_reduced[j] = 0;
    for (int k = 0; k < 6; k++) {
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
      for (int j = 0; j < span->rank; j++)
        reduced[j] += force[i][row] * span->effectiveness_reduced[i][row][j];
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
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
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

/* Adds B D B' to the lower triangle of H, of a plane: B = (bx, by), D = (xx, xy; xy, yy). */
static void add_plane(real H[6][6], const real *bx, const real *by, real xx, real xy, real yy) {
  for (int row = 0; row < 6; row++) {
    const real DBx = xx * bx[row] + xy * by[row];
    const real DBy = xy * bx[row] + yy * by[row];
    for (int col = 0; col <= row; col++) H[row][col] += DBx * bx[col] + DBy * by[col];
  }
}

/* Solves (G_mu + mu c max(tr G_mu, tau) M) step = r with G_mu = G + mu S, Eq. 8; 0 where that is
   singular to rounding. Also max(tr G_mu, tau). */
static int newton_step(const real *block, const fl_work *work, const fl_state *at, real mu,
                       real *step, real *trace) {
  real H[6][6] = {{0}}; /* G_mu */
  for (int i = 0; i < COUNT(block); i++) {
    const real(*B)[6] = work->span.effectiveness_reduced[i];
    const real *dy_ds = at->dy_ds[i];
    const real xx = dy_ds[0] + mu * at->secant[i];
    const real xy = dy_ds[1];
    real yy = dy_ds[2];
    if (is_plane(ACTUATOR(block, i))) yy += mu * at->secant[i];
    if (ACTUATOR(block, i)->rows != 1)
      add_plane(H, B[0], B[1], xx, xy, yy);
    else if (xx > 0)
      fl_add_square(H, B[0], xx);
  }
  *trace = larger(fl_trace(H), work->trace_min);
  const real weight = SATURATED * mu * *trace; /* of M */
  for (int row = 0; row < 6; row++) {
    for (int col = 0; col <= row; col++) H[row][col] += weight * work->metric[row][col];
  }
  if (!fl_factor(H)) return 0;
  fl_solve(H, at->residual, step);
  return 1;
}

/* d'(S + c max(tr G_mu, tau) M) d of a step d: what mu weighs in the curvature along it. */
static real damping_along(const real *block, const fl_work *work, const fl_state *at, real trace,
                          const real *step) {
  real sum = 0;
  for (int i = 0; i < COUNT(block); i++) {
    real s[2];
    actuator_price(work, i, step, s);
    sum += at->secant[i] * (s[0] * s[0] + s[1] * s[1]);
  }
  real of_metric = 0;
  for (int row = 0; row < 6; row++) {
    of_metric += work->metric[row][row] * step[row] * step[row];
    for (int col = 0; col < row; col++) {
      of_metric += 2 * work->metric[row][col] * step[row] * step[col];
    }
  }
  return sum + SATURATED * trace * of_metric;
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

/* What a trial step brought: slopes of the dual value along it at both of its ends, and its
   rise [W]. */
typedef struct {
  real slope_begin, slope_end, rise;
  real slope_left; /* l, Eq. 10 */
} step_result;

static step_result judged_step(const real *step, const fl_state *from, const fl_state *to) {
  step_result result;
  result.slope_begin = dot(step, from->residual, 6);
  result.slope_end = dot(step, to->residual, 6);
  result.slope_left = result.slope_end / larger(result.slope_begin, TINY);
  result.rise = to->dual_value - from->dual_value;
  return result;
}

/* A step is kept that ends uphill, or where the value rose, or is the same and the residual
   fell: with saturated actuators the residual may fall while the value does, too. */
static int is_kept(const step_result *result, const fl_state *from, const fl_state *to) {
  const real slack = ROUNDING * FABS(from->dual_value);
  if (result->slope_left >= 0 || result->rise > 0) return 1;
  return result->rise > -slack && to->residual_size < FELL * from->residual_size;
}

static real mu_after_kept(real mu, const step_result *result) {
  real factor = clipped(FABS(result->slope_left) / 2, MU_KEPT_LEAST, 1);
  if (result->slope_left > R(0.5)) factor = MU_KEPT_EARLY;
  return larger(mu * factor, ROUNDING);
}

/* The mu at which the share of a step is tried at which the cubic along it, of both values and
   slopes, is largest. `damping` is what mu weighs in the curvature along the step: with it the mu
   is the one at which the step would be that share of itself, were it as long as its curvature
   says. Where it is not known (0), as sets have kinks and steps of other mu other directions, mu is
   divided by the share. */
static real mu_after_refused(real mu, real nu, const step_result *result, real damping) {
  const real a = 3 * (result->slope_begin + result->slope_end - 2 * result->rise);
  const real b = result->slope_end - result->slope_begin - a;
  const real discriminant = b * b - 4 * a * result->slope_begin;
  real share = R(0.5);
  if (discriminant > 0) share = 2 * result->slope_begin / (SQRT(discriminant) - b);
  if (!(damping > 0)) {
    const real factor = larger(nu, 1 / clipped(share, SHARE_LEAST_AT_KINK, SHARE_MOST));
    return larger(mu * factor, ROUNDING);
  }
  const real shorter = 1 / clipped(share, SHARE_LEAST, SHARE_MOST);
  /* Along the step its curvature is its slope at the beginning. */
  const real more = (shorter - 1) * result->slope_begin / damping;
  return larger(larger(mu * nu, mu + more), ROUNDING);
}

/* Where a foil responds at the middle of a jump along a step of multipliers, as a share of it: the
   lift of one whose drag is welcome jumps between its ends, where the price of lift and drag along
   its chord is that of its power. LARGEST_NUMBER where it does not jump. */
static real share_at_jump(const real *block, const fl_work *work, int i, const real *step,
                          const fl_state *from, const fl_state *to) {
  const fl_actuator *a = ACTUATOR(block, i);
  const fl_set *set = work->set + i;
  const real range = set->force_max - set->force_min;
  const real change = to->force[i][0] - from->force[i][0];
  if (!is_foil(a) || set->tangent || !(FABS(change) > range / 2)) return LARGEST_NUMBER;
  const real power_slope = (set->cost_at_max - set->cost_at_min) / range; /* of the chord */
  const real drag_slope = power_slope / a->flow_speed;
  real s[2];
  real ds[2];
  actuator_price(work, i, from->lambda_reduced, s);
  actuator_price(work, i, step, ds);
  const real price = s[0] + drag_slope * s[1] - power_slope; /* of lift, along the chord */
  return -price / (ds[0] + drag_slope * ds[1]);
}

/* The share of a step (0 to 1) at which the dual value is largest, where that is at the jump of a
   foil; 0 where it is not. Each jump takes from the slope along the step what it changes. */
static real share_to_jump(const real *block, const fl_work *work, const real *step,
                          const step_result *result, const fl_state *from, const fl_state *to) {
  real slope = result->slope_begin;
  real last_share = 0;
  while (slope > 0) {
    real share = 1; /* of the next jump */
    real drop = 0;  /* of the slope there */
    for (int i = 0; i < COUNT(block); i++) {
      const real jump_share = share_at_jump(block, work, i, step, from, to);
      if (!(jump_share > last_share && jump_share < share)) continue;
      real ds[2];
      actuator_price(work, i, step, ds);
      const real d_lift = to->force[i][0] - from->force[i][0];
      const real d_drag = to->force[i][1] - from->force[i][1];
      share = jump_share;
      drop = ds[0] * d_lift + ds[1] * d_drag;
    }
    if (!(share < 1)) return 0;
    slope -= drop;
    last_share = share;
  }
  return last_share;
}

/* Makes a trial that was refused the dual at the jump of a foil along its step, where the value is
   largest there. Returns whether it is kept. */
static int is_kept_at_jump(const real *block, const fl_work *work, const real *target_reduced,
                           const real *step, const step_result *result, const fl_state *at,
                           fl_state *trial) {
  const real share = share_to_jump(block, work, step, result, at, trial);
  if (!(share > 0)) return 0;
  real shorter[6];
  real lambda[6];
  for (int j = 0; j < 6; j++) {
    shorter[j] = share * step[j];
    lambda[j] = at->lambda_reduced[j] + shorter[j];
  }
  fl_dual_at(block, work, target_reduced, lambda, trial);
  const step_result of_shorter = judged_step(shorter, at, trial);
  return is_kept(&of_shorter, at, trial);
}

/* The slope of the dual value along a step of multipliers, at a share of it: step.r. */
static real slope_at(const real *block, const fl_work *work, const real *target_reduced,
                     const real *step, const fl_state *from, real share) {
  real slope = dot(step, target_reduced, 6);
  for (int i = 0; i < COUNT(block); i++) {
    real s[2];
    real ds[2];
    actuator_price(work, i, from->lambda_reduced, s);
    actuator_price(work, i, step, ds);
    for (int row = 0; row < 2; row++) s[row] += share * ds[row];
    const response y = fl_response(block, i, work->set + i, s);
    slope -= dot(ds, y.force, 2);
  }
  return slope;
}

/* The share of a step, between 0 and 1, at which the dual value is largest, where its slope is above
   0 at the beginning and below at the end: by secants of the slope, of which one whose end stays
   counts half (Illinois), and now and then by halves. */
static real best_share(const real *block, const fl_work *work, const real *target_reduced,
                       const real *step, const step_result *result, const fl_state *from) {
  const real enough = SLOPE_ENOUGH * result->slope_begin;
  real low = 0;
  real high = 1;
  real slope_low = result->slope_begin;
  real slope_high = result->slope_end;
  real share = 0;
  int last_side = 0;
  for (int k = 0; k < SEARCH_STEPS; k++) {
    share = (slope_low * high - slope_high * low) / (slope_low - slope_high);
    if (k % HALVED == HALVED - 1) share = (low + high) / 2;
    const real slope = slope_at(block, work, target_reduced, step, from, share);
    if (FABS(slope) <= enough) break;
    if (slope > 0) {
      low = share;
      slope_low = slope;
      if (last_side > 0) slope_high /= 2;
      last_side = 1;
    } else {
      high = share;
      slope_high = slope;
      if (last_side < 0) slope_low /= 2;
      last_side = -1;
    }
  }
  return share;
}

/* Makes a trial that went too far the dual where its value is largest along the step. Returns
   whether it is kept. */
static int is_kept_at_best(const real *block, const fl_work *work, const real *target_reduced,
                           const real *step, const step_result *result, const fl_state *at,
                           fl_state *trial) {
  if (!(result->slope_begin > 0 && result->slope_end < 0)) return 0;
  const real share = best_share(block, work, target_reduced, step, result, at);
  real shorter[6];
  real lambda[6];
  for (int j = 0; j < 6; j++) {
    shorter[j] = share * step[j];
    lambda[j] = at->lambda_reduced[j] + shorter[j];
  }
  fl_dual_at(block, work, target_reduced, lambda, trial);
  const step_result of_shorter = judged_step(shorter, at, trial);
  return is_kept(&of_shorter, at, trial);
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
  for (int i = 0; work->has_turn_cost && i < COUNT(block); i++) work->set[i].has_jumped = 0;
  for (int k = 0;; k++) {
    if (at->residual_size <= work->residual_enough) return FL_MET;
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
    real trace;
    if (!newton_step(block, work, at, mu, step, &trace)) {
      mu *= MU_SINGULAR;
      continue;
    }
    real lambda_next[6];
    for (int j = 0; j < 6; j++) lambda_next[j] = at->lambda_reduced[j] + step[j];
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
    if (!work->has_kinks && (!is_next || result.slope_left < OVERSHOT)) {
      is_next = is_kept_at_best(block, work, target_reduced, step, &result, at, trial);
      if (is_next) mu = larger(mu * MU_KEPT_EARLY, ROUNDING);
    } else if (is_next) {
      mu = mu_after_kept(mu, &result);
    } else if (work->has_drag) {
      is_next = is_kept_at_jump(block, work, target_reduced, step, &result, at, trial);
    }
    if (is_next) {
      nu = 2;
      work->state_found = trial;
      trial = at;
      at = work->state_found;
    } else {
      real damping = 0;
      if (!work->has_kinks) damping = damping_along(block, work, at, trace, step);
      mu = mu_after_refused(mu, nu, &result, damping);
      nu *= 2;
      /* A refused step does not count as idle: its growing mu ends the loop. */
      idle--;
    }
  }
}
