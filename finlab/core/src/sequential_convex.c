/* Answers where actuators act on each other, in turns: the dual of the model made linear at the last forces, then
   Levenberg-Marquardt steps on the whole model. finlab/allocation/dual/turns.py says why they settle. */
#include "internal.h"

#define TURN_PARTS 200 /* of sets with gaps that are looked at after the first turn, which begins near its answer */
#define STEPS (ROUNDS / 3) /* of commands, to be exact on the whole model; most times that a step is made shorter */

/* Makes the wrench of a block linear at commands; their miss of an aim, on the yardstick. */
static real linear_at(const fl_whole *w, real *block, fl_work *work, const real *aim, real command[][3], real *miss) {
  const fl_span *span = &work->span;
  int n = COUNT(block);
  real force[FL_MOST][3], body[FL_MOST][3] = {{0}}, none[FL_MOST][3], offset[6], slope[FL_MOST][3][6];
  fl_head *h = (fl_head *)block;
  for (int i = 0; i < n; i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    memset(force[i], 0, sizeof force[i]);
    if (span->lost[i]) continue;
    if (!fl_is_in_dead_band(a, command[i])) fl_force_of_command(block, i, command[i], force[i], 0);
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
  fl_offset_wrench(block, &work->span);
  for (int k = 0; k < 6; k++)
    if (!span->counts[k]) miss[k] = 0;
  return SQRT(dot(miss, miss, 6));
}

/* Has fins of a block commanded as they are, or by direction and size of the force, without their tables. */
static void command_fins(const fl_whole *w, real *block, int by_force) {
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
static real exact(const fl_whole *w, real *block, fl_work *work, const fl_box *box, const real *aim, real enough,
                  real command[][3]) {
  real miss[6], share = 1, error = linear_at(w, block, work, aim, command, miss);
  for (int k = 0; k < STEPS && error > enough; k++) {
    real tried[FL_MOST][3], near[6], other[6], new_error;
    memcpy(tried, command, (size_t)COUNT(block) * sizeof *tried);
    for (int c = 0; c < 6; c++) near[c] = aim[c] - (1 - share) * miss[c] * HEAD(block)->yard[c];
    fl_refine_commands(block, work, box, near, tried, 1);
    new_error = linear_at(w, block, work, aim, tried, other);
    if (new_error < error) {
      memcpy(command, tried, (size_t)COUNT(block) * sizeof *tried);
      memcpy(miss, other, sizeof miss);
      error = new_error, share = 1;
    } else
      share *= R(0.3), linear_at(w, block, work, aim, command, miss);
  }
  return error;
}

/* The box of commands after the previous ones, or of all, of a block whose fins may be commanded by their forces. */
static void box_now(const real *block, fl_work *work, const fl_question *q, fl_box *box) {
  fl_question still = *q;
  still.calm = 0;
  if (q->previous)
    fl_limits_of_tick(block, work, &still);
  else
    fl_limits_without_tick(block, work);
  *box = work->box;
}

/* Turns from forces (n, 2) on, as many as are given, or from the previous commands of the question; its price is one
   of the wrench. The forces that they come to, the last answer of the dual by which they got better, with their
   commands, and what they end with (4,): power [W], what an error as large as the yardstick counts [W], the error,
   steps of Newton's method and on commands. The second and the last are also taken: what an error counts at least; steps after which no other turn
   is begun. */
int fl_settle(const fl_whole *w, real *block, fl_work *work, const fl_question *question, int turns, real *forces,
              fl_answer *out, real *end) {
  fl_question q = *question;
  fl_answer own;
  fl_box box;
  const real *previous = q.previous;
  real(*here)[2] = (real(*)[2])forces;
  real command[FL_MOST][3], there[FL_MOST][2], price[6];
  real worth = end[1];
  const real most_steps = end[3];
  real steps = 0;
  work->refined = 0;
  command_fins(w, block, !previous);
  if (!fl_span_of_question(block, work, q.lost, q.free)) return FL_BAD_NUMBER;
  if (previous) fl_power_of_commands(block, work, (real(*)[3])previous, here);
  box_now(block, work, &q, &box);
  fl_commands_for_forces(block, &box, here, previous, command);
  /* A tick begins where the robot is; forces that are only looked at need not be exact. */
  real enough = NEARLY / 10;
  if (turns == 0) enough = 10 * CLOSE;
  if (previous) enough = 1 / NOTHING;
  real error = exact(w, block, work, &box, q.wrench, enough, command);
  real power = fl_power_of_commands(block, work, command, here);
  for (int turn = 0; turn < turns && (turn == 0 || steps + (real)work->refined < most_steps); turn++) {
    int better = 0;
    if (!fl_prepare_span(block, work, 0)) return FL_BAD_NUMBER;
    const fl_settings usual = work->settings;
    if (turn > 0) work->settings.most_parts = MIN(TURN_PARTS, usual.most_parts);
    const int failed = fl_answer_one(block, work, &q, &own);
    work->settings = usual;
    if (failed) return failed;
    steps += (real)own.steps;
    real scaled[6], size = 1;
    for (int k = 0; k < 6; k++) scaled[k] = own.price[k] * HEAD(block)->yard[k];
    worth = MAX(worth, 2 * SQRT(dot(scaled, scaled, 6))); /* twice what it is worth at these prices: an exact penalty */
    const real merit = power + worth * error;
    if (turn == 0) *out = own;
    box_now(block, work, &q, &box);
    for (int k = 0; k < STEPS && !better; k++, size *= R(0.3)) {
      real force[FL_MOST][2], (*tried)[3] = own.command;
      for (int i = 0; i < COUNT(block); i++)
        for (int c = 0; c < 2; c++) force[i][c] = here[i][c] + size * (own.force[i][c] - here[i][c]);
      if (k > 0 || previous) fl_commands_for_forces(block, &box, force, previous, tried);
      const real new_error = exact(w, block, work, &box, q.wrench, NEARLY / 10, tried);
      const real new_power = fl_power_of_commands(block, work, tried, there);
      if (!(new_power + worth * new_error < merit)) continue;
      better = 1;
      power = new_power;
      error = new_error;
      *out = own;
      memcpy(here, there, (size_t)COUNT(block) * sizeof *here);
      memcpy(price, out->price, sizeof price);
      q.price = price;
    }
    if (!better || merit - power - worth * error <= CLOSE / 2 * merit) break;
  }
  end[0] = power;
  end[1] = worth;
  end[2] = error;
  end[3] = steps + (real)work->refined;
  if (turns == 0) return 0;
  command_fins(w, block, 0);
  box_now(block, work, &q, &box);
  fl_commands_for_forces(block, &box, here, previous, out->command);
  end[2] = exact(w, block, work, &box, q.wrench, EXACT, out->command);
  fl_rest_in_dead_bands(block, &box, out->command);
  fl_clip_commands(block, &box, out->command);
  return 0;
}
