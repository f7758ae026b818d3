/* Answers where actuators act on each other, in turns: the dual of the model made linear at the last forces, then
   Levenberg-Marquardt steps on the whole model. finlab/allocation/dual/turns.py says why they settle. */
#include "inner.h"

#define STEPS (ROUNDS / 3) /* of commands, to be exact on the whole model; most times that a step is made shorter */

/* The wrench (6,) that comes beside forces (n, 3), body frame, with its derivatives (n, 3, 6); see fl_jets. */
typedef void (*effect)(const real *known, const real *force, int count, const real *inflow, real *change, real *wrench,
                       real *slope);
typedef struct {
  effect effect;
  const real *known, *inflow, *plain; /* for `effect`; block of the laws alone */
  const real *frames; /* axes (n, 3, 3) of the laws' forces in the body frame, in rows */
  real counts[6];     /* 1 of axes that count, else 0 */
} whole;

/* Makes the wrench of a block linear at commands; their miss of an aim, on the yardstick. */
static real linear_at(const whole *w, real *block, const real *aim, real command[][3], real *miss) {
  int n = COUNT(block);
  real force[FL_MOST][3], body[FL_MOST][3] = {{0}}, none[FL_MOST][3], offset[6], slope[FL_MOST][3][6];
  fl_head *h = (fl_head *)block;
  for (int i = 0; i < n; i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    force_of(block, i, command[i], force[i], 0);
    for (int c = 0; c < 3; c++) {
      real own = force[i][c] + (a->form == FL_FOIL && c == 1 ? a->pressure * a->rest : 0);
      for (int b = 0; b < 3; b++) body[i][b] += own * w->frames[9 * i + 3 * c + b];
    }
  }
  w->effect(w->known, *body, 1, w->inflow, *none, offset, **slope);
  for (int k = 0; k < 6; k++) {
    h->beside[k] = HEAD(w->plain)->beside[k] + w->counts[k] * offset[k];
    miss[k] = (aim[k] - h->beside[k]) / h->yard[k];
  }
  for (int i = 0; i < n; i++) {
    const fl_actuator *from = ACTUATOR(w->plain, i);
    fl_actuator *to = (fl_actuator *)ACTUATOR(block, i);
    for (int c = 0; c < 3; c++)
      for (int k = 0; k < 6; k++) {
        const real *frame = w->frames + 9 * i + 3 * c;
        real more = w->counts[k] * (frame[0] * slope[i][0][k] + frame[1] * slope[i][1][k] + frame[2] * slope[i][2][k]);
        to->own[c][k] = from->own[c][k] + more / h->yard[k];
        h->beside[k] -= force[i][c] * more, miss[k] -= force[i][c] * from->own[c][k];
      }
  }
  return SQRT(dot(miss, miss, 6));
}

/* Scale, basis and matrices of a block by its wrenches along the laws' axes, and the work area. */
static int span(real *block, fl_work *work) {
  fl_head *h = (fl_head *)block;
  real row[2 * FL_MOST][6], rest[2 * FL_MOST][6], size[6] = {0}, most = 0, first = 0;
  int n = COUNT(block), r = 0;
  for (int p = 0; p < 2 * n; p++) {
    const fl_actuator *a = ACTUATOR(block, p / 2);
    real along = p % 2 >= a->rows ? 0 : a->form == FL_THRUSTER ? a->sign : 1;
    for (int k = 0; k < 6; k++) {
      row[p][k] = along * h->yard[k] * a->own[p % 2 + is_plane(a)][k], rest[p][k] = row[p][k] * a->most[p % 2];
      size[k] += rest[p][k] * rest[p][k];
    }
  }
  for (int k = 0; k < 6; k++) most = MAX(most, size[k]);
  for (int k = 0; k < 6; k++) h->scale[k] = size[k] > NOTHING * NOTHING * most ? SQRT(size[k]) : 1;
  memset(h->basis, 0, sizeof h->basis);
  for (int p = 0; p < 2 * n; p++)
    for (int k = 0; k < 6; k++) rest[p][k] /= h->scale[k];
  for (; r < 6; r++) { /* Gram and Schmidt, the largest first */
    real best = 0, *chosen = 0;
    for (int p = 0; p < 2 * n; p++) {
      real own = dot(rest[p], rest[p], 6);
      if (own > best) best = own, chosen = rest[p];
    }
    if (r == 0) first = best;
    if (!(best > NOTHING * NOTHING * first)) break;
    real q[6];
    for (int k = 0; k < 6; k++) h->basis[k][r] = q[k] = chosen[k] / SQRT(best);
    for (int p = 0; p < 2 * n; p++) {
      real along = dot(rest[p], q, 6);
      for (int k = 0; k < 6; k++) rest[p][k] -= along * q[k];
    }
  }
  h->range = r;
  for (int p = 0; p < 2 * n; p++) {
    fl_actuator *a = (fl_actuator *)ACTUATOR(block, p / 2);
    for (int k = 0; k < 6; k++) row[p][k] /= h->scale[k];
    for (int j = 0; j < 6; j++) {
      a->matrix[p % 2][j] = 0;
      for (int k = 0; k < 6; k++) a->matrix[p % 2][j] += h->basis[k][j] * row[p][k];
    }
  }
  return fl_prepare(block, work);
}

/* Has fins of a block commanded as they are, or by direction and size of the force, without their tables. */
static void command_fins(const whole *w, real *block, int by_force) {
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *from = ACTUATOR(w->plain, i);
    fl_actuator *to = (fl_actuator *)ACTUATOR(block, i);
    real low[3] = {from->middle - from->half, from->low}, high[3] = {from->middle + from->half, from->high};
    if (from->form != FL_FIN) continue;
    to->form = by_force ? FL_POD : FL_FIN, to->turns = by_force ? from->half >= PI : from->turns;
    memcpy(to->lower, by_force ? low : from->lower, sizeof low);
    memcpy(to->upper, by_force ? high : from->upper, sizeof high);
  }
}

/* Steps on commands to the aim, by the whole model, which the block is linear at where they end, until an error is
   enough; what is left. */
static real exact(const whole *w, real *block, fl_work *work, const real *aim, real enough, real command[][3]) {
  real miss[6], share = 1, error = linear_at(w, block, aim, command, miss);
  fl_box box;
  all_limits(block, &box);
  for (int k = 0; k < STEPS && error > enough; k++) {
    real tried[FL_MOST][3], near[6], other[6], new_error;
    memcpy(tried, command, COUNT(block) * sizeof *tried);
    for (int c = 0; c < 6; c++) near[c] = aim[c] - (1 - share) * miss[c] * HEAD(block)->yard[c];
    refine(block, work, &box, near, tried, 1);
    new_error = linear_at(w, block, aim, tried, other);
    if (new_error < error) {
      memcpy(command, tried, COUNT(block) * sizeof *tried);
      memcpy(miss, other, sizeof miss);
      error = new_error, share = 1;
    } else
      share *= R(0.3), linear_at(w, block, aim, command, miss);
  }
  return error;
}

/* Turns from forces (n, 2) on, as many as are given, or from the previous commands of the question; its price is one
   of the wrench. The forces that they come to, the last answer of the dual by which they got better, with their
   commands, and what they end with (3,): power [W], what an error as large as the yardstick counts [W], the error. */
int fl_settle(const whole *w, real *block, fl_work *work, const fl_question *question, int turns, real *forces,
              fl_answer *out, real *end) {
  fl_question q = *question;
  fl_answer own;
  fl_box box;
  real(*here)[2] = (real(*)[2])forces, command[FL_MOST][3], there[FL_MOST][2], inner[6] = {0}, worth = end[1];
  command_fins(w, block, !q.previous);
  if (q.previous) cost_of(block, (real(*)[3])q.previous, here);
  all_limits(block, &box);
  commands_for(block, &box, here, q.previous, command);
  /* A tick begins where the robot is; forces that are only looked at need not be exact. */
  real enough = q.previous ? 1 / NOTHING : turns ? NEARLY / 10 : 10 * CLOSE;
  real error = exact(w, block, work, q.wrench, enough, command), power = cost_of(block, command, here);
  for (int turn = 0; turn < turns; turn++) {
    int failed = span(block, work), better = 0;
    if (q.price) price_in_basis(block, q.price, inner), q.price = inner;
    if (failed || (failed = fl_answer_one(block, work, &q, &own))) return failed;
    real scaled[6], merit, size = 1;
    for (int k = 0; k < 6; k++) scaled[k] = own.price[k] * HEAD(block)->yard[k];
    worth = MAX(worth, 2 * SQRT(dot(scaled, scaled, 6))); /* twice what it is worth at these prices: an exact penalty */
    merit = power + worth * error;
    if (turn == 0) *out = own;
    for (int k = 0; k < STEPS && !better; k++, size *= R(0.3)) {
      real force[FL_MOST][2], (*tried)[3] = own.command, new_error, new_power;
      for (int i = 0; i < COUNT(block); i++)
        for (int c = 0; c < 2; c++) force[i][c] = here[i][c] + size * (own.force[i][c] - here[i][c]);
      if (k > 0 || q.previous) commands_for(block, &box, force, q.previous, tried);
      new_error = exact(w, block, work, q.wrench, NEARLY / 10, tried), new_power = cost_of(block, tried, there);
      if (!(new_power + worth * new_error < merit)) continue;
      better = 1, power = new_power, error = new_error, *out = own;
      memcpy(here, there, COUNT(block) * sizeof *here);
      q.price = out->price;
    }
    if (!better || merit - power - worth * error <= CLOSE / 2 * merit) break;
  }
  end[0] = power, end[1] = worth, end[2] = error;
  if (turns == 0) return 0;
  command_fins(w, block, 0);
  all_limits(block, &box);
  commands_for(block, &box, here, q.previous, out->command);
  end[2] = exact(w, block, work, q.wrench, EXACT, out->command);
  return 0;
}
