/* What may be given now: commands within limits and rates, and the forces that these give.

   A tick is the same question as any other, asked of smaller sets: a command changes by its rate times the period at
   most, which leaves a box around the command before, and what forces the box gives is the actuator's set. Limits,
   losses and rates are all sets; nothing else of the core knows of them. */
#include "inner.h"

#define LEAST_POWER R(1e-3) /* of full power, that counts as the mean power of the commands before, for turning */

int is_known(const real *command) {
  return command[0] == command[0] && command[1] == command[1] && command[2] == command[2];
}

/* The limits of all commands of an actuator. */
static void whole_box(const real *block, fl_box *box, int i) {
  const fl_actuator *a = ACTUATOR(block, i);
  memcpy(box->low[i], a->lower, sizeof a->lower);
  memcpy(box->high[i], a->upper, sizeof a->upper);
  box->free[i] = a->turns != 0;
}

/* The commands of an actuator that may follow one before; an angle that turns freely is counted from there. */
static void box_after(const real *block, fl_box *box, int i, const real *before) {
  const fl_actuator *a = ACTUATOR(block, i);
  for (int k = 0; k < 3; k++) {
    const int turns = k == angle_of(a) && a->turns != 0;
    if (turns && !(a->step[k] < PI)) continue;
    if (turns) {
      box->low[i][k] = before[k] - a->step[k];
      box->high[i][k] = before[k] + a->step[k];
      box->free[i] = 0;
      continue;
    }
    const real middle = (a->lower[k] + a->upper[k]) / 2;
    real center = before[k];
    if (k == angle_of(a)) center = middle + wrapped(center - middle); /* an arc may be told a turn off */
    center = CLIP(center, a->lower[k], a->upper[k]);
    box->low[i][k] = MAX(center - a->step[k], a->lower[k]);
    box->high[i][k] = MIN(center + a->step[k], a->upper[k]);
  }
}

/* Commands in the box of a tick, their angles within the limits of the actuators: the last look at all that leaves. */
void into_box(const real *block, const fl_box *box, real command[][3]) {
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    const int angle = angle_of(a);
    for (int k = 0; k < 3; k++) {
      real value = command[i][k];
      if (!(k == angle && box->free[i])) value = held_in(box, i, k, angle, value);
      if (k == angle) {
        const real middle = (a->lower[k] + a->upper[k]) / 2;
        value = middle + wrapped(value - middle);
      }
      command[i][k] = CLIP(value, a->lower[k], a->upper[k]);
    }
  }
}

/* Power [W] of an actuator at a command. */
static real power_at(const real *block, int i, const real *command) {
  const fl_actuator *a = ACTUATOR(block, i);
  real force[3];
  force_of(block, i, command, force, 0);
  real size = a->sign * force[0];
  if (is_plane(a)) size = size_of(force + 1);
  if (a->form == FL_POD && command[1] < 0) size = -size;
  if (a->gauge > 0) size /= gauge_at(block + (int)a->gauge, ATAN2(force[2], force[1]));
  return cost_at(block, i, CLIP(size, a->low, a->high));
}

/* Mean power [W] of the actuators at the commands before, and a little of full power, as there is none at rest. */
static real mean_power(const real *block, const fl_work *work, const real *previous) {
  real power = 0;
  real full = 0;
  int count = 0;
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    if (work->span.lost[i]) continue;
    count++;
    full += MAX(cost_at(block, i, a->high), cost_at(block, i, a->low));
    if (is_known(previous + 3 * i)) power += power_at(block, i, previous + 3 * i);
  }
  return MAX(power, LEAST_POWER * full) / MAX(count, 1);
}

/* Whether rates leave a number of a command all of its range. */
static int is_free(const real *block, const fl_box *box, int i, int k) {
  const fl_actuator *a = ACTUATOR(block, i);
  return box->low[i][k] <= a->lower[k] && box->high[i][k] >= a->upper[k];
}

/* The set of an actuator in a tick, and what turning costs there. */
static void tick_set(const real *block, fl_work *work, int i, const real *before, real kappa) {
  const fl_actuator *a = ACTUATOR(block, i);
  fl_set *set = work->set + i;
  const int all_sizes = is_free(block, &work->box, i, 0) && is_free(block, &work->box, i, 1);
  const int all_angles = is_free(block, &work->box, i, 2);
  reach own = reach_of(block, i, &work->box);
  if (a->form == FL_FIN && all_sizes) {
    own.low = a->low;
    own.high = a->high;
  }
  if (all_sizes && all_angles && !(kappa > 0)) own = (reach){a->least, a->high, a->middle, a->half};
  const real low = CLIP(own.low, a->low, a->high);
  const real high = CLIP(own.high, a->low, a->high);
  limit(block, i, set, low, high, own.middle, own.half);
  if (!(kappa > 0)) return;
  const real at = before[0] + (set->flipped ? PI : 0);
  set->turn = kappa;
  set->at = set->middle + wrapped(at - set->middle);
}

/* Limits of commands and sets of forces outside of ticks. */
void whole_limits(const real *block, fl_work *work) {
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    whole_box(block, &work->box, i);
    if (work->span.lost[i])
      leave_out(block, i, work->set + i);
    else
      limit(block, i, work->set + i, a->least, a->high, a->middle, a->half);
  }
  work->is_whole = 1;
  sums_of(block, work);
}

/* The same of a tick after the previous commands (n, 3) of a question, of which rows may be NaN. Turning of a pod costs
   kappa = calm P / step, with P the mean power of the commands before and `step` the largest turn of a tick. Fins turn
   through a right angle in a few ticks, and one that points away gives little: with such a cost it would stay for ever, and
   leave its work to others at a fifth more power. */
void tick_limits(const real *block, fl_work *work, const fl_question *q) {
  real power = 0;
  whole_limits(block, work);
  if (q->calm > 0) power = mean_power(block, work, q->previous);
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    const real *before = q->previous + 3 * i;
    real kappa = 0;
    if (work->span.lost[i] || !is_known(before)) continue;
    if (a->form == FL_POD && a->step[0] > 0 && a->step[0] < R(1e6)) kappa = q->calm * power / a->step[0];
    box_after(block, &work->box, i, before);
    tick_set(block, work, i, before, kappa);
  }
  work->is_whole = 0;
  sums_of(block, work);
}

/* Prepares the work area for what a question says that holds now; 0 where its numbers are out of range. */
int stand_as(const real *block, fl_work *work, const fl_question *q) {
  if (!span_now(block, work, q->lost, q->free)) return 0;
  if (q->previous)
    tick_limits(block, work, q);
  else if (!work->is_whole)
    whole_limits(block, work);
  return 1;
}
