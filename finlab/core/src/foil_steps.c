/* Steps on the commands of a robot whose foils drag: to a wrench, and then to less power at that
   wrench, by sequential quadratic programming.

   A step is the dual's answer where the curve of each foil is its tangent, curved as much as the
   cost less the worth of the force, whatever the sign; all other sets are whole. It begins at the
   multipliers at which the commands would be cheapest for what they give, so that Newton's method
   has little left to do. Levenberg-Marquardt steps make it exact, and it is kept where it is
   cheaper. Costs of commands are compared by the Lagrangian: what commands leave of the wrench,
   up to EXACT, counts at its multipliers. */
#include "internal.h"

#define APPROACH_STEPS 24 /* steps on commands from a start towards a wrench, at most */
#define APPROACH_ROUND 6  /* the same in a row, which have to halve the error */
#define EXACT_STEPS 24    /* steps that end them, to rounding */
/* share of the cost below which a gain ends the steps */
#define CHEAPER larger(R(0.1) * NOTHING, ROUNDING)
/* Gain over that of the tangents from which the curvature is taken to be of the other sign. */
#define MORE_THAN_EXPECTED R(1.2)
#define STEP_LONGER 2        /* a step after one that is cheaper is longer by this */
#define STEP_SHORTER R(0.25) /* a step that is no cheaper is shortened to this share */

static int has_gap(const fl_actuator *a, const fl_set *set) {
  if (is_plane(a)) return set->is_forked || set->force_max_reverse > 0;
  return a->dead_band > 0;
}

/* Whether the set of an actuator has a gap that commands have to leave on one side. */
static int any_gap(const real *block, const fl_work *work) {
  for (int i = 0; i < COUNT(block); i++) {
    if (has_gap(ACTUATOR(block, i), work->set + i)) return 1;
  }
  return 0;
}

/* Narrows sets and limits of other actuators to the side of a gap on which their forces are. */
static void take_sides(const real *block, fl_work *work, fl_box *box, real command[][3],
                       real force[][2]) {
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    fl_set *set = work->set + i;
    if (has_gap(a, set)) {
      fl_narrow_set(block, i, set, force[i], fl_nearer_side(block, i, set, force[i]));
    }
    const int k = fl_form_of(a)->force_number;
    const int has_dead_band = k != NO_NUMBER && a->dead_band > 0;
    if (!has_dead_band || fl_aims_force(a)) continue;
    real low = set->force_min;
    real high = set->force_max;
    if (!(a->command_sign > 0)) {
      low = -set->force_max;
      high = -set->force_min;
    }
    box->command_min[i][k] = larger(box->command_min[i][k], low);
    box->command_max[i][k] = smaller(box->command_max[i][k], high);
    command[i][k] = fl_clip_number(box, i, k, NO_NUMBER, command[i][k]);
  }
}

/* Makes commands those that a share of the step from forces to the dual's answer leads to. */
static void take_step(const real *block, const fl_work *work, const fl_box *box, real force[][2],
                      real share, real command[][3]) {
  for (int i = 0; i < COUNT(block); i++) {
    if (work->span.is_lost[i]) continue;
    const real *answer = work->state_found->force[i];
    const real change[2] = {share * (answer[0] - force[i][0]), share * (answer[1] - force[i][1])};
    if (is_foil(ACTUATOR(block, i))) { /* the angle whose tangent comes nearest to the change */
      const real *slope = work->tangent[i].force_slope;
      const real turn = dot(change, slope, 2) / larger(dot(slope, slope, 2), TINY);
      command[i][0] = fl_clip_number(box, i, 0, NO_NUMBER, command[i][0] + turn);
      continue;
    }
    const real wanted[2] = {force[i][0] + change[0], force[i][1] + change[1]};
    fl_command_for_force(block, i, box, wanted, command[i], command[i]);
  }
}

/* Whether commands within a box are fewer than the directions in which the robot drives:
   what they give is a sheet, and that of the tables lies beside that of the laws, by FINE at
   most. A wrench on the one is then met by no commands of the other. */
static int are_few(const real *block, const fl_work *work, const fl_box *box) {
  int free = 0;
  for (int i = 0; i < COUNT(block); i++) {
    if (work->span.is_lost[i]) continue;
    for (int c = 0; c < 3; c++) free += box->command_max[i][c] > box->command_min[i][c];
  }
  return free < work->span.rank;
}

/* Steps towards work->wrench_wanted, of which so many in a row have to halve the error: most starts
   end soon. The error over the wrench scale that is left. */
real fl_approach(const real *block, fl_work *work, const fl_box *box, real command[][3]) {
  real error = LARGEST_NUMBER;
  for (int k = 0; k < APPROACH_STEPS; k += APPROACH_ROUND) {
    const real before = error;
    error = fl_refine_commands(block, work, box, work->wrench_wanted, command, APPROACH_ROUND);
    if (error <= EXACT || error > before / 2) break;
  }
  return error;
}

/* Whether so many Levenberg-Marquardt steps make commands within a box give work->wrench_wanted,
   to an error over the wrench scale and to rounding. Where that is what tables leave, steps on
   their error end soon. */
int fl_come_to_give(const real *block, fl_work *work, const fl_box *box, real command[][3],
                    int steps, real most_error) {
  real size = 0;
  for (int k = 0; k < 6; k++) size += FABS(work->wrench_wanted[k]) / HEAD(block)->wrench_scale[k];
  real error;
  if (most_error > EXACT)
    error = fl_approach(block, work, box, command);
  else
    error = fl_refine_commands(block, work, box, work->wrench_wanted, command, steps);
  return error <= most_error + ROUNDING * size;
}

/* Largest error over the wrench scale of commands that are said to give a wrench: what tables
   leave where these are few. */
real fl_error_allowed(const real *block, const fl_work *work, const fl_box *box) {
  if (are_few(block, work, box)) return FINE;
  return EXACT;
}

/* Sets of a step: of each foil its tangent at its command. */
static void draw_tangents(const real *block, fl_work *work, const fl_box *box, const real *lambda,
                          real command[][3]) {
  for (int i = 0; i < COUNT(block); i++) {
    if (!is_foil(ACTUATOR(block, i)) || work->span.is_lost[i]) continue;
    real s[2];
    actuator_price(work, i, lambda, s);
    fl_draw_tangent(block, i, box, command[i][0], s, work->tangent + i, work->set + i);
  }
}

/* Adds to the normal equations H lambda = right that a line or a plane has the price of its force,
   where this may still move, and that a plane has none across it. */
static void add_price_of_force(const real *block, const fl_work *work, int i, const real *force,
                               real H[6][6], real *right) {
  const fl_actuator *a = ACTUATOR(block, i);
  const fl_set *set = work->set + i;
  const real(*B)[6] = work->span.effectiveness_reduced[i];
  real size = force[0];
  if (is_plane(a)) size = size_of(force);
  if (!(size > set->force_min && size < set->force_max) || size == 0) return;
  real price;
  fl_power_and_price(block, i, size, &price);
  if (size < 0) price = -price;
  const real slope = fl_limited_response(block, a, set, !is_plane(a), price).slope;
  if (!is_plane(a)) {
    fl_add_equation(H, right, B[0], slope, price);
    return;
  }
  const real x = force[0] / size;
  const real y = force[1] / size;
  real ahead[6];
  real across[6];
  for (int j = 0; j < 6; j++) {
    ahead[j] = x * B[0][j] + y * B[1][j];
    across[j] = x * B[1][j] - y * B[0][j];
  }
  fl_add_equation(H, right, ahead, slope, price);
  fl_add_equation(H, right, across, size / larger(price, TINY), 0);
}

/* Makes multipliers those at which commands are cheapest for what they give, by least squares:
   each actuator that is not at a limit has the price of its force there, a foil that of its
   tangent. */
static void multipliers_at(const real *block, const fl_work *work, real force[][2], real *lambda) {
  real H[6][6] = {{0}};
  real right[6] = {0};
  for (int i = 0; i < COUNT(block); i++) {
    const fl_set *set = work->set + i;
    if (work->span.is_lost[i]) continue;
    if (!is_foil(ACTUATOR(block, i))) {
      add_price_of_force(block, work, i, force[i], H, right);
      continue;
    }
    const fl_tangent *tangent = work->tangent + i;
    const real(*B)[6] = work->span.effectiveness_reduced[i];
    real wrench_slope[6]; /* by the angle */
    if (!(set->force_min < 0 && set->force_max > 0)) continue;
    for (int j = 0; j < 6; j++) {
      wrench_slope[j] = tangent->force_slope[0] * B[0][j] + tangent->force_slope[1] * B[1][j];
    }
    fl_add_equation(H, right, wrench_slope, 1 / tangent->curvature, tangent->cost_slope);
  }
  const real ridge = NOTHING * fl_trace(H) + TINY;
  for (int j = 0; j < 6; j++) {
    H[j][j] += ridge;
    right[j] += ridge * lambda[j];
  }
  if (fl_factor(H)) fl_solve(H, right, lambda);
}

/* What commands of a cost [W] would cost if their forces left nothing of the target: the Lagrangian
   at multipliers in the basis. In a dead band there is no force. */
static real lagrangian(const real *block, const fl_work *work, const real *target_reduced,
                       const real *lambda, real cost, real command[][3], real force[][2]) {
  real left[6];
  memcpy(left, target_reduced, sizeof left);
  for (int i = 0; i < COUNT(block); i++) {
    const real(*B)[6] = work->span.effectiveness_reduced[i];
    if (fl_is_in_dead_band(ACTUATOR(block, i), command[i])) continue;
    for (int j = 0; j < 6; j++) left[j] -= force[i][0] * B[0][j] + force[i][1] * B[1][j];
  }
  return cost + dot(lambda, left, 6);
}

/* What costs of commands are compared by: the Lagrangian, or the cost itself where tables leave
   more than can be made up for. */
static real compared_cost(const real *block, const fl_work *work, const real *target_reduced,
                          real most_error, const real *lambda, real cost, real command[][3],
                          real force[][2]) {
  if (most_error > EXACT) return cost;
  return lagrangian(block, work, target_reduced, lambda, cost, command, force);
}

/* Finds the step from commands, their forces and cost [W] on: work->state_found becomes the dual of
   their tangents, from multipliers on, which become its own where it meets the target. Returns by
   how much a whole step may lower the Lagrangian at most, as the tangents tell: the duality gap. */
static real find_step(const real *block, fl_work *work, const fl_box *box,
                      const real *target_reduced, real cost, int is_first, real *lambda,
                      real command[][3], real force[][2]) {
  draw_tangents(block, work, box, lambda, command);
  fl_prepare_sets(block, work);
  if (is_first) multipliers_at(block, work, force, lambda);
  fl_dual_start(block, work, target_reduced, lambda);
  real exact_cost = lagrangian(block, work, target_reduced, lambda, cost, command, force);
  const real gap = exact_cost - work->state_found->dual_value;
  if (gap <= CHEAPER * cost) return gap;
  const int status = fl_dual_newton(block, work, target_reduced, lambda, FL_STEPS_AT_KINK);
  const fl_state *state = work->state_found;
  if (status == FL_BEYOND) return LARGEST_NUMBER; /* the tangents do not reach the target */
  if (status == FL_MET) memcpy(lambda, state->lambda_reduced, sizeof state->lambda_reduced);
  exact_cost = lagrangian(block, work, target_reduced, state->lambda_reduced, cost, command, force);
  return exact_cost - state->dual_value;
}

/* Makes commands cheaper, from their forces and cost [W] on, by steps that keep giving
   work->wrench_wanted; `lambda` becomes that of the last step, and work->state_found the dual of
   its tangents. Their cost, as it is compared. */
static real cheapen(const real *block, fl_work *work, const fl_box *box, const real *target_reduced,
                    real most_error, real cost, real *lambda, real command[][3], real force[][2]) {
  real exact_cost = cost;
  real expected = 0; /* gain of a whole step */
  real share = 1;    /* of a step that is taken */
  int has_moved = 1;
  for (int k = 0; k < FL_FOIL_STEPS; k++) {
    if (has_moved) {
      expected = find_step(block, work, box, target_reduced, cost, k == 0, lambda, command, force);
      exact_cost =
          compared_cost(block, work, target_reduced, most_error, lambda, cost, command, force);
      if (expected <= CHEAPER * cost) break;
    }
    real stepped[FL_MOST][3];
    real force_stepped[FL_MOST][2];
    copy_commands(block, command, stepped);
    take_step(block, work, box, force, share, stepped);
    real cost_stepped = 0;
    real gain = -INFEASIBLE_COST;
    if (fl_come_to_give(block, work, box, stepped, EXACT_STEPS, most_error)) {
      cost_stepped = fl_power_of_commands(block, work, stepped, force_stepped);
      gain = exact_cost - compared_cost(block, work, target_reduced, most_error, lambda,
                                        cost_stepped, stepped, force_stepped);
    }
    has_moved = gain > 0;
    if (has_moved) {
      copy_commands(block, stepped, command);
      copy_forces(block, force_stepped, force);
      cost = cost_stepped;
      exact_cost -= gain;
      share *= STEP_LONGER;
      if (!(gain > MORE_THAN_EXPECTED * expected)) share = smaller(share, 1);
    } else {
      share *= STEP_SHORTER;
    }
    if (FABS(gain) <= CHEAPER * cost) break;
  }
  return exact_cost;
}

/* Makes commands give work->wrench_wanted, in the basis `target_reduced`, to an error over the
   wrench scale, and then cheaper; `lambda` becomes that of the last step. Their forces along the
   rows, and their cost [W], but for what they leave; INFEASIBLE_COST where they do not come to give
   it. */
real fl_meet_and_cheapen(const real *block, fl_work *work, const real *target_reduced,
                         real most_error, real *lambda, real command[][3], real force[][2]) {
  fl_box box = work->box;
  fl_set before[FL_MOST];
  copy_sets(block, work->set, before);
  if (any_gap(block, work)) {
    fl_power_of_commands(block, work, command, force);
    take_sides(block, work, &box, command, force);
  }
  real cost = INFEASIBLE_COST;
  if (fl_come_to_give(block, work, &box, command, EXACT_STEPS, most_error)) {
    cost = fl_power_of_commands(block, work, command, force);
    cost = cheapen(block, work, &box, target_reduced, most_error, cost, lambda, command, force);
  }
  fl_restore_sets(block, work, before);
  return cost;
}
