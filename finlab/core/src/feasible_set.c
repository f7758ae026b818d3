/* What may be given now: commands within limits and rates, and the sets Y of forces that these
   give.

   A tick is the same question as any other, asked of smaller sets: a command changes by its rate
   times the period at most, which leaves a box around the command before, and what forces the box
   gives is the actuator's set. Limits, losses and rates are all sets; nothing else of the core
   knows of them. */
#include "internal.h"

/* Share of full power that counts at least as the mean power P of the commands before, Eq. 16. */
#define LEAST_POWER R(1e-3)
/* Weight of a pod's price across its force over that along it, where multipliers are fitted. */
#define ACROSS R(0.01)
#define QUICK R(1e6) /* change of an angle in a tick [rad] from which turning has no rate */

/* Least thrust that is asked of an actuator whose box leaves low to high: no thrust astern of a
   propeller with a rudder in a flow from ahead, of which too little is known there. */
static real least_thrust(const fl_actuator *a, real low, real high) {
  const int is_in_flow = is_steered(a) && a->pressure_area > 0;
  if (is_in_flow && low < 0 && high >= 0) return 0;
  return low;
}

/* Makes a box of the limits of all commands of an actuator. */
static void whole_box(const real *block, fl_box *box, int i) {
  const fl_actuator *a = ACTUATOR(block, i);
  memcpy(box->command_min[i], a->command_min, sizeof a->command_min);
  memcpy(box->command_max[i], a->command_max, sizeof a->command_max);
  box->command_min[i][1] = least_thrust(a, a->command_min[1], a->command_max[1]);
  box->is_free_angle[i] = a->is_free_angle != 0;
}

/* Narrows a box to the commands (3,) of an actuator that may follow one before after so many ticks;
   an angle that turns freely is counted from there. */
static void box_after(const real *block, fl_box *box, int i, const real *before, real ticks) {
  const fl_actuator *a = ACTUATOR(block, i);
  for (int k = 0; k < 3; k++) {
    const int is_angle = k == fl_form_of(a)->angle_number;
    const real step = a->max_change[k] * ticks;
    if (is_angle && a->is_free_angle != 0) {
      if (!(step < PI)) continue; /* any angle is near enough */
      box->command_min[i][k] = before[k] - step;
      box->command_max[i][k] = before[k] + step;
      box->is_free_angle[i] = 0;
      continue;
    }
    const real middle = (a->command_min[k] + a->command_max[k]) / 2;
    real center = before[k];
    /* an angle of an arc may be told a whole turn off */
    if (is_angle) center = fl_leave_zone(a, middle + fl_wrap_angle(center - middle));
    center = clipped(center, a->command_min[k], a->command_max[k]);
    box->command_min[i][k] = larger(center - step, a->command_min[k]);
    box->command_max[i][k] = smaller(center + step, a->command_max[k]);
  }
  box->command_min[i][1] = least_thrust(a, box->command_min[i][1], box->command_max[i][1]);
  if (FL_ZONES > 0 && a->barred_count > 0) fl_trim_arc(a, box->command_min[i], box->command_max[i]);
}

/* Power [W] of an actuator at a command (3,), and the price [W/N] of its force ahead at which it
   gives that, below 0 in reverse. */
static real power_at(const real *block, int i, const real *command, real *price) {
  const fl_actuator *a = ACTUATOR(block, i);
  real force[3];
  fl_force_of_command(block, i, command, force, 0);
  real size = a->command_sign * force[0];
  if (is_plane(a)) size = size_of(force + 1);
  if (fl_is_in_reverse(a, command)) {
    size = -size;
  } else if (is_plane(a)) {
    size /= fl_radius(block, i, ATAN2(force[2], force[1]));
  }
  const real within = clipped(size, a->force_min, a->force_max);
  const real power = fl_power_and_price(block, i, within, price);
  if (size < 0) *price = -*price;
  return power;
}

/* Mean power P [W] of the actuators at the commands before (n, 3), or a little of full power, as
   there is none at rest; and the price (n,) of each there [W/N], 0 where it is not known. */
static real mean_power(const real *block, const fl_work *work, const real *previous, real *price) {
  real power = 0;
  real full = 0;
  int count = 0;
  for (int i = 0; i < COUNT(block); i++) {
    price[i] = 0;
    if (work->span.is_lost[i]) continue;
    count++;
    full += work->power_max[i];
    const real *before = previous + 3 * i;
    if (fl_is_known_command(before)) power += power_at(block, i, before, price + i);
  }
  if (count == 0) count = 1;
  return larger(power, LEAST_POWER * full) / (real)count;
}

/* Sets the multipliers in the basis [W] at which the actuators gave what they did before, by least
   squares: along its force each had its own price (n,), and across it a pod that stood still had
   none. Newton's method begins there in a tick. A tick is a small step, and its narrow arcs make
   multipliers that a whole robot would have for the wrench a poor guess. */
static void begin_as_before(const real *block, fl_work *work, const real *previous,
                            const real *price) {
  const fl_span *span = &work->span;
  real H[6][6] = {{0}};
  real right[6] = {0};
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    const real(*B)[6] = span->effectiveness_reduced[i];
    const real *before = previous + 3 * i;
    const int has_force = fl_form_of(a)->force_number != NO_NUMBER;
    if (span->is_lost[i] || !fl_is_known_command(before) || !has_force) continue;
    real alpha = 0; /* a thruster has no second row */
    if (fl_aims_force(a)) alpha = before[fl_form_of(a)->angle_number];
    const real c = COS(alpha);
    const real s = SIN(alpha);
    real ahead[6];
    real across[6];
    for (int j = 0; j < 6; j++) {
      ahead[j] = c * B[0][j] + s * B[1][j];
      across[j] = c * B[1][j] - s * B[0][j];
    }
    fl_add_equation(H, right, ahead, a->secant[0], price[i]);
    fl_add_equation(H, right, across, ACROSS * a->secant[0], 0);
  }
  const int is_at_rest = !(dot(right, right, 6) > 0);
  if (is_at_rest) return; /* multipliers of 0 tell Newton's method nothing */
  const real trace = fl_trace(H);
  for (int j = 0; j < 6; j++) H[j][j] += NOTHING * trace + TINY;
  if (!fl_factor(H)) return;
  fl_solve(H, right, work->lambda_begin);
  work->has_lambda_begin = 1;
}

/* Whether rates leave number k of a command all of its range; unused numbers always have it. */
static int has_full_range(const real *block, const fl_box *box, int i, int k) {
  const fl_actuator *a = ACTUATOR(block, i);
  real least = a->command_min[k];
  if (k == 1) least = least_thrust(a, least, a->command_max[k]);
  return box->command_min[i][k] <= least && box->command_max[i][k] >= a->command_max[k];
}

/* The forces that an actuator's box gives, within its limits. Where rates leave it all of its
   commands, or of a grid all but the angle that wraps, they are the robot's own, which the box
   gives but for rounding. */
static force_range range_of_tick(const real *block, const fl_work *work, int i, int is_costly) {
  const fl_actuator *a = ACTUATOR(block, i);
  const fl_box *box = &work->box;
  const command_form *form = fl_form_of(a);
  int has_full_angle = 1;   /* of the number that is an angle and wraps, if there is one */
  int has_full_numbers = 1; /* of all others */
  for (int k = 0; k < form->numbers; k++) {
    const int is_full = has_full_range(block, box, i, k);
    if (k == form->angle_number)
      has_full_angle = is_full;
    else
      has_full_numbers &= is_full;
  }
  if (has_full_numbers && has_full_angle && !is_costly) {
    const force_range whole = {a->force_min_needed, a->force_max, a->sector_center,
                               a->sector_half_angle};
    return whole;
  }
  force_range range = fl_force_range(block, i, box);
  if (form->has_law_grid && has_full_numbers) { /* of a grid only samples are known */
    range.low = a->force_min;
    range.high = a->force_max;
  }
  return range;
}

/* Makes the set of an actuator in a tick, where turning from an angle [rad] costs
   kappa / 2 [W/rad^2] of the squared turn, Eq. 16. */
static void tick_set(const real *block, fl_work *work, int i, real angle, real kappa) {
  const fl_actuator *a = ACTUATOR(block, i);
  fl_set *set = work->set + i;
  const int is_costly = kappa > 0;
  const force_range range = range_of_tick(block, work, i, is_costly);
  const real low = clipped(range.low, a->force_min, a->force_max);
  const real high = clipped(range.high, a->force_min, a->force_max);
  fl_limit_set(block, i, set, low, high, range.middle, range.half);
  if (!is_costly) return;
  real at = angle;
  if (set->is_flipped) at += PI;
  set->turn_cost = kappa;
  set->slope_max = work->slope_max[i];
  set->turn_origin = set->sector_center + fl_wrap_angle(at - set->sector_center);
}

/* Makes the set of an actuator outside of ticks. */
static void whole_set(const real *block, fl_work *work, int i) {
  const fl_actuator *a = ACTUATOR(block, i);
  if (work->span.is_lost[i]) {
    fl_empty_set(block, i, work->set + i);
  } else {
    fl_limit_set(block, i, work->set + i, a->force_min_needed, a->force_max, a->sector_center,
                 a->sector_half_angle);
  }
}

/* Sets limits of commands and sets of forces outside of ticks. */
void fl_limits_without_tick(const real *block, fl_work *work) {
  for (int i = 0; i < COUNT(block); i++) {
    whole_box(block, &work->box, i);
    whole_set(block, work, i);
  }
  work->is_whole = 1;
  fl_prepare_sets(block, work);
  fl_find_kinks(block, work);
}

/* kappa of an actuator [W/rad^2], Eq. 16: calm P / step, with `power` the mean power P of the
   commands before and `step` the largest turn until the commands asked for: of one tick, or of
   several. Of pods alone: fins turn through a right angle in a few ticks, and one that points away
   gives little. With such a cost it would stay for ever, and leave its work to others at a fifth
   more power. */
static real turning_cost_of(const fl_actuator *a, real calm, real power, real ticks) {
  if (!fl_aims_force(a)) return 0;
  const real rate = a->max_change[fl_form_of(a)->angle_number];
  const int has_rate = rate > 0 && rate < QUICK;
  if (!has_rate) return 0;
  return calm * power / (rate * ticks);
}

/* The same in a tick after the previous commands (n, 3) of a question, of which rows may be NaN.
   Turning costs from the angle before, or from one that is wanted. */
void fl_limits_of_tick(const real *block, fl_work *work, const fl_question *q) {
  real power = 0;
  real price[FL_MOST];
  if (q->calm > 0) power = mean_power(block, work, q->previous, price);
  real ticks = 1;
  if (q->ticks > 1) ticks = (real)q->ticks;
  for (int i = 0; i < COUNT(block); i++) {
    const real *before = q->previous + 3 * i;
    whole_box(block, &work->box, i);
    if (work->span.is_lost[i] || !fl_is_known_command(before)) {
      whole_set(block, work, i);
      continue;
    }
    const int angle_number = fl_form_of(ACTUATOR(block, i))->angle_number;
    real angle = 0; /* asked for by turning costs alone, which take a number that is an angle */
    if (angle_number != NO_NUMBER) angle = before[angle_number];
    const int is_wanted = q->angles_wanted &&
                          q->angles_wanted[i] == q->angles_wanted[i]; /* not NaN */
    if (is_wanted) angle = q->angles_wanted[i];
    box_after(block, &work->box, i, before, ticks);
    const real kappa = turning_cost_of(ACTUATOR(block, i), q->calm, power, ticks);
    tick_set(block, work, i, angle, kappa);
  }
  work->is_whole = 0;
  fl_prepare_sets(block, work);
  fl_find_kinks(block, work);
  if (work->has_turn_cost) begin_as_before(block, work, q->previous, price);
}

/* Prepares the work area for what a question says that holds now; 0 where its numbers are out of
   range. */
int fl_prepare_question(const real *block, fl_work *work, const fl_question *q) {
  if (!fl_span_of_question(block, work, q->lost, q->free)) return 0;
  work->has_lambda_begin = 0;
  if (q->previous) {
    fl_limits_of_tick(block, work, q);
  } else if (!work->is_whole) {
    fl_limits_without_tick(block, work);
  }
  return 1;
}

int fl_prepare(const real *block, fl_work *work) {
  memset(&work->span, 0, sizeof work->span);
  work->ray = 0;
#ifdef FL_WITH_POWER_SETS
  work->power_sets = 0;
#endif
  work->refine_steps = 0;
  work->has_lambda_begin = 0;
  work->law_power = 0;
  work->residual_enough = TOLERANCE;
  work->power_of_use = INFEASIBLE_COST;
  fl_usual_settings(&work->settings);
  fl_prepare_lines(block, work);
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    work->slope_max[i] = 0;
    work->over_cost[i] = 1;
    if (fl_aims_force(a)) work->slope_max[i] = fl_largest_slope(block, i);
    const real power_high = fl_power_of_force(block, i, a->force_max);
    const real power_low = fl_power_of_force(block, i, a->force_min);
    work->power_max[i] = larger(power_high, power_low);
  }
  for (int k = 0; k < 6; k++) work->span.axis_counts[k] = HEAD(block)->is_commanded[k] != 0;
  if (!fl_prepare_span(block, work, 1)) return FL_BAD_NUMBER;
  fl_limits_without_tick(block, work);
  return FL_OK;
}

void fl_usual_settings(fl_settings *settings) {
  settings->most_parts = FL_PARTS;
  settings->tick_parts = USUAL_TICK_PARTS;
  settings->command_steps = USUAL_COMMAND_STEPS;
}

int fl_use_settings(fl_work *work, const fl_settings *settings) {
  if (settings->most_parts < 0) return FL_BAD_ARGUMENT;
  if (settings->tick_parts < 0) return FL_BAD_ARGUMENT;
  if (settings->command_steps < 0) return FL_BAD_ARGUMENT;
  work->settings = *settings;
  return FL_OK;
}
