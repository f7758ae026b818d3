/* Commands of all actuators: for forces, and made exact by Levenberg-Marquardt steps within a box. */
#include "internal.h"

/* The miss (6,) of commands from an aim, on the yardstick. Returns its square. */
static real miss_of(const real *block, const fl_work *work, const real *aim, real command[][3], real *miss) {
  const fl_head *h = HEAD(block);
  const fl_span *span = &work->span;
  for (int k = 0; k < 6; k++) miss[k] = (aim[k] - span->beside[k]) / h->yard[k];
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    real force[3];
    if (span->lost[i]) continue;
    fl_force_of_command(block, i, command[i], force, 0);
    if (fl_is_in_dead_band(a, command[i])) memset(force, 0, sizeof force);
    for (int k = 0; k < 6; k++)
      miss[k] -= force[0] * a->own[0][k] + force[1] * a->own[1][k] + force[2] * a->own[2][k];
  }
  for (int k = 0; k < 6; k++)
    if (!span->counts[k]) miss[k] = 0;
  return dot(miss, miss, 6);
}

/* The slopes of the wrench, into the work area. */
static void slopes_of(const real *block, fl_work *work, const fl_box *box, real command[][3]) {
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    real force[3], by[3][3];
    fl_force_of_command(block, i, command[i], force, by);
    if (work->span.lost[i] || fl_is_in_dead_band(a, command[i])) memset(by, 0, sizeof by);
    for (int c = 0; c < 3; c++) {
      real width = box->high[i][c] - box->low[i][c];
      for (int k = 0; k < 6; k++)
        work->slope[i][c][k] = !work->span.counts[k] ? 0 :
            width * (by[c][0] * a->own[0][k] + by[c][1] * a->own[1][k] + by[c][2] * a->own[2][k]);
    }
  }
}

static int leaves(const real *block, const fl_box *box, int i, int c, const real *command, real step) {
  if (c == fl_angle_number(ACTUATOR(block, i)) && box->free[i]) return 0;
  return (command[c] <= box->low[i][c] + NOTHING && step < 0) || (command[c] >= box->high[i][c] - NOTHING && step > 0);
}

/* The damped smallest change of commands, over the widths of their limits, that gives a miss; those of `held` not. The
   damping is a share of the trace: in a tick widths, and with them slopes, are small. */
static void change_for(const real *block, fl_work *work, const real *miss, real damping,
                       const unsigned char held[][3], real step[][3]) {
  int n = COUNT(block);
  real gram[6][6] = {{0}}, x[6] = {0}, trace = 0;
  for (int i = 0; i < n; i++)
    for (int c = 0; c < 3; c++) {
      const real *row = work->slope[i][c];
      if (held[i][c]) continue;
      for (int j = 0; j < 6; j++)
        for (int k = 0; k <= j; k++) gram[j][k] += row[j] * row[k];
    }
  for (int j = 0; j < 6; j++) trace += gram[j][j];
  for (int j = 0; j < 6; j++) gram[j][j] += (damping + ROUNDING * R(0.01)) * trace + TINY;
  if (fl_factor(gram)) fl_solve(gram, miss, x);
  for (int i = 0; i < n; i++)
    for (int c = 0; c < 3; c++) step[i][c] = held[i][c] ? 0 : dot(work->slope[i][c], x, 6);
}

/* Holds the commands (n, 3) that a step would take out of the box, beside those that are held; whether there are any. */
static int hold_leaving(const real *block, const fl_box *box, real command[][3], real step[][3],
                        unsigned char held[][3]) {
  int any = 0;
  for (int i = 0; i < COUNT(block); i++)
    for (int c = 0; c < 3; c++) {
      if (held[i][c] || !leaves(block, box, i, c, command[i], step[i][c])) continue;
      held[i][c] = 1;
      any = 1;
    }
  return any;
}

#define HOLDS 3 /* how often a step is found anew without the commands that would leave the box */

/* Levenberg-Marquardt steps on commands within a box towards an aim [N, N m]; the error that is left. */
real fl_refine_commands(const real *block, fl_work *work, const fl_box *box, const real *aim, real command[][3], int steps) {
  int n = COUNT(block);
  real miss[6], cost = miss_of(block, work, aim, command, miss), damping = NEARLY;
  int moved = 1;
  for (int k = 0; k < steps && cost > EXACT * EXACT && damping <= 1; k++) {
    unsigned char held[FL_MOST][3] = {{0}};
    real step[FL_MOST][3], tried[FL_MOST][3], other[6], new_cost;
    work->refined++;
    if (moved) slopes_of(block, work, box, command);
    change_for(block, work, miss, damping, (const unsigned char(*)[3])held, step);
    for (int again = 0; again < HOLDS && hold_leaving(block, box, command, step, held); again++)
      change_for(block, work, miss, damping, (const unsigned char(*)[3])held, step);
    for (int i = 0; i < n; i++)
      for (int c = 0; c < 3; c++) {
        real own = leaves(block, box, i, c, command[i], step[i][c]) ? 0 : step[i][c];
        own = command[i][c] + own * (box->high[i][c] - box->low[i][c]);
        tried[i][c] = fl_clip_number(box, i, c, fl_angle_number(ACTUATOR(block, i)), own);
      }
    new_cost = miss_of(block, work, aim, tried, other);
    if ((moved = new_cost <= cost)) {
      memcpy(command, tried, (size_t)n * sizeof *tried);
      memcpy(miss, other, sizeof miss);
      cost = new_cost, damping *= R(0.3);
    } else
      damping = damping * 10 + NEARLY;
  }
  return SQRT(cost);
}
