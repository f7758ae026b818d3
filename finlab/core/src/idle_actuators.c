/* Idle actuators in ticks: drives that pass through their dead bands, pods and fins that turn
   towards what they will give. */
#include "internal.h"

/* A drive that passes a dead band stays within it by this share of the band. */
#define INSIDE_BAND (1 - 10 * NEARLY)
/* Least share of what its drive allows by which an idle actuator turns where a wrench is missed. */
#define LEAST_TURN R(0.05)

/* Whether a command gives no force, or the least that its actuator can: it rests, is inside a dead
   band, or is the smallest beat of a fin. */
static int is_idle(const fl_actuator *a, const real *command) {
  const command_form *form = fl_form_of(a);
  const int force = form->force_number;
  if (!FL_AIMS) return fl_is_in_dead_band(a, command);
  if (force != NO_NUMBER) {
    const real rest = larger(a->dead_band, NEARLY * a->command_max[force]);
    return FABS(command[force]) <= rest * (1 - NEARLY);
  }
  if (form->angle_number == NO_NUMBER) return 0;
  for (int k = 0; k < 3; k++) {
    const real range = a->command_max[k] - a->command_min[k];
    if (k != form->angle_number && command[k] > a->command_min[k] + NEARLY * range) return 0;
  }
  return 1;
}

/* Whether a tick allows less of a number of a command than its actuator. */
static int is_limited_by_tick(const fl_actuator *a, const fl_box *box, int i, int k) {
  return box->command_min[i][k] > a->command_min[k] || box->command_max[i][k] < a->command_max[k];
}

/* How many ticks a question gives drives until its commands. */
static real ticks_of(const fl_question *q) {
  if (q->ticks > 1) return (real)q->ticks;
  return 1;
}

/* Share of what drives allow in a tick that commands have changed by since the last one: of the
   actuator that has changed most. */
static real activity(const real *block, const fl_work *work, const fl_question *q,
                     real command[][3]) {
  const real ticks = ticks_of(q);
  real most = 0;
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    const real *before = q->previous + 3 * i;
    if (work->span.is_lost[i] || !fl_is_known_command(before)) continue;
    for (int k = 0; k < 3; k++) {
      if (!(a->max_change[k] > 0)) continue;
      real change = command[i][k] - before[k];
      if (k == fl_form_of(a)->angle_number) change = fl_wrap_angle(change);
      most = larger(most, FABS(change) / (a->max_change[k] * ticks));
    }
  }
  return smaller(most, 1);
}

/* Whether a tick keeps an idle actuator from what it may give later: a drive that cannot leave its
   dead band at once, or that may have to pass it; or, where a wrench is missed, a pod or a fin that
   is turned elsewhere. */
int fl_may_give_later(const real *block, const fl_work *work, int has_missed, real command[][3]) {
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    const command_form *form = fl_form_of(a);
    if (work->span.is_lost[i] || !is_idle(a, command[i])) continue;
    const int has_band = form->force_number != NO_NUMBER && a->dead_band > 0;
    if (has_band && is_limited_by_tick(a, &work->box, i, form->force_number)) return 1;
    const int angle = form->angle_number;
    if (has_missed && angle != NO_NUMBER && is_limited_by_tick(a, &work->box, i, angle)) return 1;
  }
  return 0;
}

/* The angle [rad] to which an actuator turns in a tick, from one before towards one wanted within
   its arc, by a share of what its drive allows: the shorter way where it turns freely; else not
   past the ends of its arc, beyond which there may be a shorter way that it cannot go. */
static real turned_towards(const real *block, const fl_box *box, int i, real before, real wanted,
                           real share) {
  const fl_actuator *a = ACTUATOR(block, i);
  const int k = fl_form_of(a)->angle_number;
  real from = before;
  real to = before + fl_wrap_angle(wanted - before);
  if (a->is_free_angle == 0) {
    const real middle = (a->command_min[k] + a->command_max[k]) / 2;
    from = middle + fl_wrap_angle(before - middle);
    to = wanted;
  }
  if (!box->is_free_angle[i]) to = clipped(to, box->command_min[i][k], box->command_max[i][k]);
  return from + share * (to - from);
}

/* Has idle actuators prepare in a tick for the command that they would have if drives were as quick
   as can be: they turn towards it, and pass through their dead bands. Else a policy that gives
   nothing of a wrench would do so for ever, where pods or fins are turned elsewhere. Where others
   give a part of it, and change all the time, turning after it costs more than it gains: the busier
   the others are, the slower the idle ones turn. One whose command before is unknown takes that
   angle at once. */
void fl_prepare_idle(const real *block, fl_work *work, const fl_question *q,
                     const real *wrench_desired, real command[][3]) {
  const fl_box box = work->box;
  real turn_share = 1;
  if (FL_AIMS) turn_share = larger(LEAST_TURN, 1 - activity(block, work, q, command));
  fl_answer later;
  fl_limits_without_tick(block, work);
  fl_find_forces(block, work, wrench_desired, q->policy, 0, &later);
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    const int force = fl_form_of(a)->force_number;
    const int angle = fl_form_of(a)->angle_number;
    const real most = a->dead_band * INSIDE_BAND;
    if (work->span.is_lost[i] || !is_idle(a, command[i])) continue;
    if (size_of(later.force[i]) < larger(most, NEARLY * a->force_max)) continue;
    const real *before = 0;
    if (fl_is_known_command(q->previous + 3 * i)) before = q->previous + 3 * i;
    real wanted[3];
    fl_command_for_force(block, i, &work->box, later.force[i], before, wanted);
    if (force != NO_NUMBER) command[i][force] = clipped(wanted[force], -most, most);
    if (!FL_AIMS || angle == NO_NUMBER) continue;
    command[i][angle] = wanted[angle];
    if (!before) continue;
    command[i][angle] = turned_towards(block, &box, i, before[angle], wanted[angle], turn_share);
  }
  work->box = box;
  work->is_whole = 0;
}
