/* Commands within power budgets, whatever was found: a last resort, which a search of forces that
   keeps budgets (power_budget.c) seldom leaves something to do.

   Of all commands within the limits of a question, those of least power are within every budget
   where any are. On the way from these to commands that take too much, each bus goes as far as its
   budget allows. */
#include "internal.h"

#if FL_KEEPS_BUDGETS

#define WAY_HALVES 40 /* of the way to commands that take too much */

/* Power of a command [W]: by its law where the core knows it, else by tables. */
static real power_of_one(const real *block, const fl_work *work, int i, const real *command) {
  real force[2];
  if (work->span.is_lost[i]) return 0;
  if (work->law_power) return work->law_power(work, i, command);
  const fl_actuator *a = ACTUATOR(block, i);
  if (a->dead_band > 0 && fl_is_in_dead_band(a, command)) return 0;
  return fl_power_of_command(block, i, command, force);
}

/* Powers of the buses at commands, over what they have. */
void fl_budget_shares(const real *block, const fl_work *work, const fl_budget *budget,
                      real command[][3], real *share) {
  real power[FL_BUSES + 1] = {0};
  for (int i = 0; i < COUNT(block); i++) {
    power[budget->bus_of[i]] += power_of_one(block, work, i, command[i]);
  }
  for (int b = 0; b < budget->buses; b++) share[b] = power[b + 1] / budget->watts[b];
}

/* Whether all buses take what they have at most. */
int fl_is_within_shares(const fl_budget *budget, const real *share) {
  for (int b = 0; b < budget->buses; b++) {
    if (share[b] > MOST_SHARE) return 0;
  }
  return 1;
}

/* Commands of least power within the limits of a question. */
static void least_commands(const real *block, const fl_work *work, const fl_question *q,
                           real command[][3]) {
  real force[FL_MOST][2];
  for (int i = 0; i < COUNT(block); i++) fl_least_power_force(block, work, i, force[i]);
  fl_commands_for_forces(block, &work->box, force, q->previous, command);
  fl_rest_in_dead_bands(block, &work->box, command);
  fl_clip_commands(block, &work->box, command);
}

/* The commands of a tick before, of actuators of which one is known. */
static void stay(const real *block, const fl_work *work, const fl_question *q, real command[][3]) {
  for (int i = 0; i < COUNT(block); i++) {
    const real *before = q->previous + 3 * i;
    if (fl_is_known_command(before)) memcpy(command[i], before, sizeof command[i]);
  }
  fl_clip_commands(block, &work->box, command);
}

/* Commands of a bus at a part of the way from those of `near` to those of `far`. */
static void go_to(const real *block, const fl_work *work, const fl_budget *budget, int bus,
                  real part, real near[][3], real far[][3], real command[][3]) {
  for (int i = 0; i < COUNT(block); i++) {
    if (budget->bus_of[i] != bus + 1) continue;
    const int angle = fl_form_of(ACTUATOR(block, i))->angle_number;
    for (int k = 0; k < 3; k++) {
      real way = far[i][k] - near[i][k];
      if (k == angle) way = fl_wrap_angle(way);
      command[i][k] = near[i][k] + part * way;
      if (part == 1) command[i][k] = far[i][k];
    }
  }
  fl_clip_commands(block, &work->box, command);
}

/* Has a bus go as far from `near` as its budget allows, by halves of the way. */
static void go_within_budget(const real *block, const fl_work *work, const fl_budget *budget,
                             int bus, real near[][3], real far[][3], real command[][3]) {
  real share[FL_BUSES];
  real low = 0;
  real high = 1;
  for (int k = 0; k < WAY_HALVES; k++) {
    const real part = (low + high) / 2;
    go_to(block, work, budget, bus, part, near, far, command);
    fl_budget_shares(block, work, budget, command, share);
    if (share[bus] > 1) {
      high = part;
    } else {
      low = part;
    }
  }
  go_to(block, work, budget, bus, low, near, far, command);
}

/* Brings commands within the budgets of a question where the limits leave any there, else to the
   least power of a bus. `share` has those of the commands (b,), and becomes those of the new ones.
 */
void fl_come_within_budget(const real *block, const fl_work *work, const fl_question *q,
                           real command[][3], real *share) {
  const fl_budget *budget = q->budget;
  real far[FL_MOST][3];
  real near[FL_MOST][3];
  real least[FL_BUSES];
  copy_commands(block, command, far);
  least_commands(block, work, q, near);
  fl_budget_shares(block, work, budget, near, least);
  if (q->previous && !fl_is_within_shares(budget, least)) {
    /* Tables may be off where those of least power are: a tick before that was within stays so. */
    real before[FL_MOST][3];
    real share_before[FL_BUSES];
    copy_commands(block, near, before);
    stay(block, work, q, before);
    fl_budget_shares(block, work, budget, before, share_before);
    for (int b = 0; b < budget->buses; b++) {
      if (!(share_before[b] < least[b])) continue;
      least[b] = share_before[b];
      go_to(block, work, budget, b, 1, near, before, near);
    }
  }
  for (int b = 0; b < budget->buses; b++) {
    if (!(share[b] > MOST_SHARE)) continue;
    if (least[b] > 1) {
      if (least[b] < share[b]) go_to(block, work, budget, b, 0, near, far, command);
    } else {
      go_within_budget(block, work, budget, b, near, far, command);
    }
  }
  fl_budget_shares(block, work, budget, command, share);
}

#else
typedef int fl_no_command_budget; /* a file of C has to declare something */
#endif
