/* Commands of all actuators: for forces, made exact by Levenberg-Marquardt steps, and within what may follow the
   commands of the tick before. */
#include "inner.h"

/* Which number of a command is an angle; -1 where none is. */
int angle_of(const fl_actuator *a) { return a->form == FL_FIN ? 2 : a->form == FL_POD ? 0 : -1; }

/* A number of a command in a box, an angle wrapped first. */
real held_in(const fl_box *box, int i, int k, int angle, real value) {
  real low = box->low[i][k], high = box->high[i][k], middle = (low + high) / 2;
  if (k == angle) value = middle + wrapped(value - middle);
  return CLIP(value, low, high);
}

void all_limits(const real *block, fl_box *box) {
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    memcpy(box->low[i], a->lower, sizeof a->lower);
    memcpy(box->high[i], a->upper, sizeof a->upper);
    box->free[i] = a->turns != 0;
  }
}

static int is_known(const real *row) { return row[0] == row[0] && row[1] == row[1] && row[2] == row[2]; }

/* What may follow previous commands (n, 3); an angle that turns freely is counted from the previous one. */
void tick_limits(const real *block, const real *previous, fl_box *box) {
  all_limits(block, box);
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    const real *row = previous + 3 * i;
    int angle = angle_of(a);
    if (!is_known(row)) continue;
    for (int k = 0; k < 3; k++) {
      int turns = k == angle && a->turns != 0;
      if (turns && !(a->step[k] < PI)) continue;
      real center = turns ? row[k] : CLIP(row[k], a->lower[k], a->upper[k]);
      real low = center - a->step[k], high = center + a->step[k];
      box->low[i][k] = turns ? low : MAX(low, a->lower[k]);
      box->high[i][k] = turns ? high : MIN(high, a->upper[k]);
      if (turns) box->free[i] = 0;
    }
  }
}

/* Whether commands may follow previous ones in a tick. */
int may_follow(const real *block, const real *previous, real command[][3]) {
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    for (int k = 0; k < 3; k++) {
      real change = FABS(command[i][k] - previous[3 * i + k]);
      if (k == angle_of(a) && a->turns != 0) change = MIN(change, FABS(2 * PI - change));
      if (change > a->step[k]) return 0;
    }
  }
  return 1;
}

void commands_for(const real *block, const fl_box *box, real force[][2], const real *previous, real command[][3]) {
  for (int i = 0; i < COUNT(block); i++) {
    const real *before = previous && is_known(previous + 3 * i) ? previous + 3 * i : 0;
    command_for(block, i, box, force[i], before, command[i]);
  }
}

/* Commands whose angles are wrapped, or held, within the limits. */
void into_limits(const real *block, real command[][3]) {
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    for (int k = 0; k < 3; k++) {
      real middle = (a->lower[k] + a->upper[k]) / 2;
      if (k == angle_of(a)) command[i][k] = middle + wrapped(command[i][k] - middle);
      command[i][k] = CLIP(command[i][k], a->lower[k], a->upper[k]);
    }
  }
}

/* Commands inside a dead band give no force: they rest, where the box allows. */
void rest_in_bands(const real *block, const fl_box *box, real command[][3]) {
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    int k = a->form == FL_POD ? 1 : 0;
    if (!(a->band > 0) || !(FABS(command[i][k]) < a->band)) continue;
    if (box->low[i][k] <= 0 && box->high[i][k] >= 0) command[i][k] = 0;
  }
}

/* The miss (6,) of commands from an aim, on the yardstick. Returns its square. */
static real miss_of(const real *block, const real *aim, real command[][3], real *miss) {
  const fl_head *h = HEAD(block);
  for (int k = 0; k < 6; k++) miss[k] = (aim[k] - h->beside[k]) / h->yard[k];
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    real force[3];
    force_of(block, i, command[i], force, 0);
    for (int k = 0; k < 6; k++)
      miss[k] -= force[0] * a->own[0][k] + force[1] * a->own[1][k] + force[2] * a->own[2][k];
  }
  return dot(miss, miss, 6);
}

/* The slopes of the wrench, into the work area. */
static void slopes_of(const real *block, fl_work *work, const fl_box *box, real command[][3]) {
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    real force[3], by[3][3];
    force_of(block, i, command[i], force, by);
    for (int c = 0; c < 3; c++) {
      real width = box->high[i][c] - box->low[i][c];
      for (int k = 0; k < 6; k++)
        work->slope[i][c][k] = width * (by[c][0] * a->own[0][k] + by[c][1] * a->own[1][k] + by[c][2] * a->own[2][k]);
    }
  }
}

static int leaves(const real *block, const fl_box *box, int i, int c, const real *command, real step) {
  if (c == angle_of(ACTUATOR(block, i)) && box->free[i]) return 0;
  return (command[c] <= box->low[i][c] + NOTHING && step < 0) || (command[c] >= box->high[i][c] - NOTHING && step > 0);
}

/* The damped smallest change of commands, over the widths of their limits, that gives a miss; those of `held` not. */
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
  for (int j = 0; j < 6; j++) gram[j][j] += damping + NOTHING + ROUNDING * R(0.01) * trace;
  if (factor(gram)) solve(gram, miss, x);
  for (int i = 0; i < n; i++)
    for (int c = 0; c < 3; c++) step[i][c] = held[i][c] ? 0 : dot(work->slope[i][c], x, 6);
}

/* Levenberg-Marquardt steps on commands within a box towards an aim [N, N m]; the error that is left. */
real refine(const real *block, fl_work *work, const fl_box *box, const real *aim, real command[][3], int steps) {
  int n = COUNT(block);
  real miss[6], cost = miss_of(block, aim, command, miss), damping = NEARLY;
  int moved = 1;
  for (int k = 0; k < steps && cost > EXACT * EXACT; k++) {
    unsigned char held[FL_MOST][3] = {{0}};
    real step[FL_MOST][3], tried[FL_MOST][3], other[6], new_cost;
    int any = 0;
    if (moved) slopes_of(block, work, box, command);
    change_for(block, work, miss, damping, (const unsigned char(*)[3])held, step);
    for (int i = 0; i < n; i++)
      for (int c = 0; c < 3; c++) any |= held[i][c] = leaves(block, box, i, c, command[i], step[i][c]);
    if (any) change_for(block, work, miss, damping, (const unsigned char(*)[3])held, step);
    for (int i = 0; i < n; i++)
      for (int c = 0; c < 3; c++) {
        real own = leaves(block, box, i, c, command[i], step[i][c]) ? 0 : step[i][c];
        own = command[i][c] + own * (box->high[i][c] - box->low[i][c]);
        tried[i][c] = held_in(box, i, c, angle_of(ACTUATOR(block, i)), own);
      }
    new_cost = miss_of(block, aim, tried, other);
    if ((moved = new_cost <= cost)) {
      memcpy(command, tried, n * sizeof *tried);
      memcpy(miss, other, sizeof miss);
      cost = new_cost, damping *= R(0.3);
    } else
      damping = damping * 30 + CLOSE;
  }
  return SQRT(cost);
}
