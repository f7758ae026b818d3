/* What may be given now: commands within limits and rates, and the forces that these give.

   A tick is the same question as any other, asked of smaller sets: a command changes by its rate times the period at
   most, which leaves a box around the command before, and what forces the box gives is the actuator's set. Limits,
   losses and rates are all sets; nothing else of the core knows of them. */
#include "internal.h"

#define LEAST_POWER R(1e-3) /* of full power, that counts as the mean power of the commands before, for turning */
#define ACROSS R(0.01)     /* weight of a pod's price across its force over that along it, where prices before are found */

/* The limits of all commands of an actuator. */
static void whole_box(const real *block, fl_box *box, int i) {
  const fl_actuator *a = ACTUATOR(block, i);
  memcpy(box->low[i], a->lower, sizeof a->lower);
  memcpy(box->high[i], a->upper, sizeof a->upper);
  box->free[i] = a->turns != 0;
}

/* The commands of an actuator that may follow one before after so many ticks; an angle that turns freely is counted from
   there. */
static void box_after(const real *block, fl_box *box, int i, const real *before, real ticks) {
  const fl_actuator *a = ACTUATOR(block, i);
  for (int k = 0; k < 3; k++) {
    const int turns = k == fl_angle_number(a) && a->turns != 0;
    const real step = a->step[k] * ticks;
    if (turns && !(step < PI)) continue;
    if (turns) {
      box->low[i][k] = before[k] - step;
      box->high[i][k] = before[k] + step;
      box->free[i] = 0;
      continue;
    }
    const real middle = (a->lower[k] + a->upper[k]) / 2;
    real center = before[k];
    if (k == fl_angle_number(a)) center = middle + fl_wrap_angle(center - middle); /* an arc may be told a turn off */
    center = CLIP(center, a->lower[k], a->upper[k]);
    box->low[i][k] = MAX(center - step, a->lower[k]);
    box->high[i][k] = MIN(center + step, a->upper[k]);
  }
}

/* Power [W] of an actuator at a command, and the price [W/N] of its force ahead at which it gives that. */
static real power_at(const real *block, int i, const real *command, real *price) {
  const fl_actuator *a = ACTUATOR(block, i);
  real force[3];
  fl_force_of_command(block, i, command, force, 0);
  real size = a->sign * force[0];
  if (is_plane(a)) size = size_of(force + 1);
  if (a->form == FL_POD && command[1] < 0) size = -size;
  if (a->gauge > 0) size /= fl_gauge_radius(block + (int)a->gauge, ATAN2(force[2], force[1]));
  const real power = fl_power_and_price(block, i, CLIP(size, a->low, a->high), price);
  if (size < 0) *price = -*price;
  return power;
}

/* Mean power [W] of the actuators at the commands before, and a little of full power, as there is none at rest; and the
   price of each (n,) there [W/N]. */
static real mean_power(const real *block, const fl_work *work, const real *previous, real *price) {
  real power = 0;
  real full = 0;
  int count = 0;
  for (int i = 0; i < COUNT(block); i++) {
    price[i] = 0;
    if (work->span.lost[i]) continue;
    count++;
    full += work->full_power[i];
    if (fl_is_known_command(previous + 3 * i)) power += power_at(block, i, previous + 3 * i, price + i);
  }
  return MAX(power, LEAST_POWER * full) / (real)MAX(count, 1);
}

/* Adds to a least-squares system that a newton along a direction (6,) in the basis has a price. */
static void add_price(real h[6][6], real *right, const real *direction, real weight, real price) {
  fl_add_square(h, direction, weight);
  for (int j = 0; j < 6; j++) right[j] += weight * price * direction[j];
}

/* Prices of the wrench in the basis at which the actuators gave what they did before: along its force each had its own
   price (n,), and across it a pod that stood still had none. Newton's method begins there in a tick. A tick is a small
   step, and its narrow arcs make prices that a whole robot would have for the wrench a poor guess. */
static void begin_as_before(const real *block, fl_work *work, const real *previous, const real *price) {
  real h[6][6] = {{0}};
  real right[6] = {0};
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    const fl_span *span = &work->span;
    const real(*matrix)[6] = span->matrix[i];
    const real *before = previous + 3 * i;
    if (work->span.lost[i] || !fl_is_known_command(before) || fl_force_number(a) < 0) continue;
    const real angle = a->form == FL_POD ? before[0] : 0; /* a thruster has no second row */
    const real c = COS(angle);
    const real s = SIN(angle);
    real ahead[6];
    real across[6];
    for (int j = 0; j < 6; j++) {
      ahead[j] = c * matrix[0][j] + s * matrix[1][j];
      across[j] = c * matrix[1][j] - s * matrix[0][j];
    }
    add_price(h, right, ahead, a->gain[0], price[i]);
    add_price(h, right, across, ACROSS * a->gain[0], 0);
  }
  const real trace = fl_trace(h);
  for (int j = 0; j < 6; j++) h[j][j] += NOTHING * trace + TINY;
  const int is_at_rest = !(dot(right, right, 6) > 0); /* prices of 0 tell Newton's method nothing */
  if (is_at_rest || !fl_factor(h)) return;
  fl_solve(h, right, work->begin);
  work->begins = 1;
}

/* Whether rates leave a number of a command all of its range. */
static int is_free(const real *block, const fl_box *box, int i, int k) {
  const fl_actuator *a = ACTUATOR(block, i);
  return box->low[i][k] <= a->lower[k] && box->high[i][k] >= a->upper[k];
}

/* The set of an actuator in a tick, and what turning from an angle costs there. */
static void tick_set(const real *block, fl_work *work, int i, real angle, real kappa) {
  const fl_actuator *a = ACTUATOR(block, i);
  fl_set *set = work->set + i;
  const int all_sizes = is_free(block, &work->box, i, 0) && is_free(block, &work->box, i, 1);
  const int all_angles = is_free(block, &work->box, i, 2);
  force_range own = fl_force_range(block, i, &work->box);
  if (a->form == FL_FIN && all_sizes) {
    own.low = a->low;
    own.high = a->high;
  }
  if (all_sizes && all_angles && !(kappa > 0)) own = (force_range){a->least, a->high, a->middle, a->half};
  const real low = CLIP(own.low, a->low, a->high);
  const real high = CLIP(own.high, a->low, a->high);
  fl_limit_set(block, i, set, low, high, own.middle, own.half);
  if (!(kappa > 0)) return;
  const real at = angle + (set->flipped ? PI : 0);
  set->turn = kappa;
  set->steepest = work->steepest[i];
  set->at = set->middle + fl_wrap_angle(at - set->middle);
}

/* The set of an actuator outside of ticks. */
static void whole_set(const real *block, fl_work *work, int i) {
  const fl_actuator *a = ACTUATOR(block, i);
  if (work->span.lost[i])
    fl_empty_set(block, i, work->set + i);
  else
    fl_limit_set(block, i, work->set + i, a->least, a->high, a->middle, a->half);
}

/* Limits of commands and sets of forces outside of ticks. */
void fl_limits_without_tick(const real *block, fl_work *work) {
  for (int i = 0; i < COUNT(block); i++) {
    whole_box(block, &work->box, i);
    whole_set(block, work, i);
  }
  work->is_whole = 1;
  fl_prepare_sets(block, work);
}

/* The same of a tick after the previous commands (n, 3) of a question, of which rows may be NaN. Turning of a pod costs
   kappa = calm P / step, with P the mean power of the commands before and `step` the largest turn until the commands
   asked for: of one tick, or of several. It costs from the angle before, or from one that is wanted. Fins turn
   through a right angle in a few ticks, and one that points away gives little: with such a cost it would stay for ever, and
   leave its work to others at a fifth more power. */
void fl_limits_of_tick(const real *block, fl_work *work, const fl_question *q) {
  real power = 0;
  real ticks = 1;
  real price[FL_MOST];
  if (q->ticks > 1) ticks = (real)q->ticks;
  if (q->calm > 0) power = mean_power(block, work, q->previous, price);
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    const real *before = q->previous + 3 * i;
    real kappa = 0;
    real angle = before[0];
    whole_box(block, &work->box, i);
    if (work->span.lost[i] || !fl_is_known_command(before)) {
      whole_set(block, work, i);
      continue;
    }
    const int is_costly = a->form == FL_POD && a->step[0] > 0 && a->step[0] < R(1e6);
    if (is_costly) kappa = q->calm * power / (a->step[0] * ticks);
    if (q->toward && q->toward[i] == q->toward[i]) angle = q->toward[i];
    box_after(block, &work->box, i, before, ticks);
    tick_set(block, work, i, angle, kappa);
  }
  work->is_whole = 0;
  fl_prepare_sets(block, work);
  if (work->turns) begin_as_before(block, work, q->previous, price);
}

/* Prepares the work area for what a question says that holds now; 0 where its numbers are out of range. */
int fl_prepare_question(const real *block, fl_work *work, const fl_question *q) {
  if (!fl_span_of_question(block, work, q->lost, q->free)) return 0;
  work->begins = 0;
  if (q->previous)
    fl_limits_of_tick(block, work, q);
  else if (!work->is_whole)
    fl_limits_without_tick(block, work);
  return 1;
}

/* Prepares a work area for the whole robot; an error code. */
int fl_prepare(const real *block, fl_work *work) {
  memset(&work->span, 0, sizeof work->span);
  work->ray = 0;
  work->refined = 0;
  fl_usual_settings(&work->settings);
  work->begins = 0;
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    work->steepest[i] = 0;
    if (a->form == FL_POD) work->steepest[i] = fl_largest_slope(block, i);
    work->full_power[i] = MAX(fl_power_of_force(block, i, a->high), fl_power_of_force(block, i, a->low));
  }
  for (int k = 0; k < 6; k++) work->span.counts[k] = HEAD(block)->counts[k] != 0;
  if (!fl_prepare_span(block, work, 1)) return FL_BAD_NUMBER;
  fl_limits_without_tick(block, work);
  return 0;
}

void fl_usual_settings(fl_settings *settings) {
  settings->most_parts = FL_PARTS;
  settings->tick_parts = TICK_PARTS;
  settings->command_steps = LAST_STEPS;
}

int fl_use_settings(fl_work *work, const fl_settings *settings) {
  if (settings->most_parts < 0 || settings->tick_parts < 0 || settings->command_steps < 0) return FL_BAD_ARGUMENT;
  work->settings = *settings;
  return FL_OK;
}
