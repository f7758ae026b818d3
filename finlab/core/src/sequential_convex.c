/* Answers where actuators act on each other, Eq. 18, in outer iterations: the dual of the model made
   linear at the last forces, then Levenberg-Marquardt steps on the whole model (sequential
   convex programming). finlab/allocation/dual/turns.py says why they settle. */
#include "internal.h"

/* Parts of sets with gaps that are looked at after the first iteration, which begins near
   its answer. */
#define TURN_PARTS 200
/* Steps on commands, to be exact on the whole model; most times that a step is made shorter. */
#define STEPS (ROUNDS / 3)
#define SHORTEN R(0.3) /* a step that gets no better is shortened to this share */

/* Forces of commands along the laws' axes, and in the body frame, where a foil's drag at
   rest is on top. */
static void forces_of_commands(const fl_whole *w, const real *block, const fl_span *span,
                               real command[][3], real force[][3], real body[][3]) {
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    memset(force[i], 0, sizeof force[i]);
    memset(body[i], 0, sizeof body[i]);
    if (span->is_lost[i]) continue;
    if (!fl_is_in_dead_band(a, command[i])) fl_force_of_command(block, i, command[i], force[i], 0);
    for (int c = 0; c < 3; c++) {
      real along = force[i][c];
      if (a->command_kind == FL_FOIL && c == 1) along += a->pressure_area * a->zero_lift_drag;
      const real *axis = w->frames + 9 * i + 3 * c;
      for (int b = 0; b < 3; b++) body[i][b] += along * axis[b];
    }
  }
}

/* Makes the wrench of a block linear at commands: its effectiveness becomes that of the laws
   and the slope of what the actuators do to each other, its offset what is left. Their
   residual from a wrench, on the yardstick; its size. */
static real linearize_at(const fl_whole *w, real *block, fl_work *work, const real *wrench,
                         real command[][3], real *residual) {
  const fl_span *span = &work->span;
  const int n = COUNT(block);
  fl_head *head = (fl_head *)block;
  real force[FL_MOST][3];
  real body[FL_MOST][3];
  real unused[FL_MOST][3];
  real offset[6];
  real slope[FL_MOST][3][6];
  forces_of_commands(w, block, span, command, force, body);
  w->effect(w->known, *body, 1, w->inflow, *unused, offset, **slope);
  for (int k = 0; k < 6; k++) {
    head->wrench_offset[k] = HEAD(w->plain)->wrench_offset[k] + w->axis_counts[k] * offset[k];
    residual[k] = (wrench[k] - head->wrench_offset[k]) / head->wrench_scale[k];
  }
  for (int i = 0; i < n; i++) {
    const fl_actuator *plain = ACTUATOR(w->plain, i);
    fl_actuator *linear = (fl_actuator *)ACTUATOR(block, i);
    for (int c = 0; c < 3; c++) {
      const real *axis = w->frames + 9 * i + 3 * c;
      for (int k = 0; k < 6; k++) {
        const real along =
            axis[0] * slope[i][0][k] + axis[1] * slope[i][1][k] + axis[2] * slope[i][2][k];
        const real more = w->axis_counts[k] * along;
        linear->effectiveness_normalized[c][k] =
            plain->effectiveness_normalized[c][k] + more / head->wrench_scale[k];
        head->wrench_offset[k] -= force[i][c] * more;
        residual[k] -= force[i][c] * plain->effectiveness_normalized[c][k];
      }
    }
  }
  fl_offset_wrench(block, &work->span);
  for (int k = 0; k < 6; k++) {
    if (!span->axis_counts[k]) residual[k] = 0;
  }
  return SQRT(dot(residual, residual, 6));
}

/* Has fins of a block commanded by direction and size of the force, without their tables. */
static void command_fins_by_force(const fl_whole *w, real *block) {
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *plain = ACTUATOR(w->plain, i);
    fl_actuator *a = (fl_actuator *)ACTUATOR(block, i);
    if (plain->command_kind != FL_FIN) continue;
    const real low[3] = {plain->sector_center - plain->sector_half_angle, plain->force_min};
    const real high[3] = {plain->sector_center + plain->sector_half_angle, plain->force_max};
    a->command_kind = FL_POD;
    a->is_free_angle = plain->sector_half_angle >= PI;
    memcpy(a->command_min, low, sizeof low);
    memcpy(a->command_max, high, sizeof high);
  }
}

/* Has fins of a block commanded as they are. */
static void command_fins_by_law(const fl_whole *w, real *block) {
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *plain = ACTUATOR(w->plain, i);
    fl_actuator *a = (fl_actuator *)ACTUATOR(block, i);
    if (plain->command_kind != FL_FIN) continue;
    a->command_kind = FL_FIN;
    a->is_free_angle = plain->is_free_angle;
    memcpy(a->command_min, plain->command_min, sizeof a->command_min);
    memcpy(a->command_max, plain->command_max, sizeof a->command_max);
  }
}

/* Steps on commands to a wrench, by the whole model, which the block is linear at where they
   end, until an error is enough; the error that is left. */
static real step_to_wrench(const fl_whole *w, real *block, fl_work *work, const fl_box *box,
                           const real *wrench, real enough, real command[][3]) {
  const size_t size = (size_t)COUNT(block) * sizeof *command;
  real residual[6];
  real share = 1;
  real error = linearize_at(w, block, work, wrench, command, residual);
  for (int k = 0; k < STEPS && error > enough; k++) {
    real stepped[FL_MOST][3];
    real nearer[6]; /* than the wrench, by a share of the way */
    real residual_stepped[6];
    memcpy(stepped, command, size);
    for (int c = 0; c < 6; c++) {
      nearer[c] = wrench[c] - (1 - share) * residual[c] * HEAD(block)->wrench_scale[c];
    }
    fl_refine_commands(block, work, box, nearer, stepped, 1);
    const real error_stepped = linearize_at(w, block, work, wrench, stepped, residual_stepped);
    if (error_stepped < error) {
      memcpy(command, stepped, size);
      memcpy(residual, residual_stepped, sizeof residual);
      error = error_stepped;
      share = 1;
      continue;
    }
    share *= SHORTEN;
    linearize_at(w, block, work, wrench, command, residual);
  }
  return error;
}

/* The box of commands after the previous ones, or of all, of a block whose fins may be
   commanded by their forces. */
static void box_now(const real *block, fl_work *work, const fl_question *q, fl_box *box) {
  fl_question calm = *q;
  calm.calm = 0;
  if (q->previous)
    fl_limits_of_tick(block, work, &calm);
  else
    fl_limits_without_tick(block, work);
  *box = work->box;
}

/* The dual's answer to a question on the linear model; those after the first look at fewer
   parts. */
static int answer_linear(real *block, fl_work *work, const fl_question *q, int is_first,
                         fl_answer *answer) {
  if (!fl_prepare_span(block, work, 0)) return FL_BAD_NUMBER;
  const fl_settings usual = work->settings;
  if (!is_first && TURN_PARTS < usual.most_parts) work->settings.most_parts = TURN_PARTS;
  const int code = fl_answer_one(block, work, q, answer);
  work->settings = usual;
  return code;
}

/* What an error as large as the yardstick is worth [W] at multipliers of the wrench: twice
   that makes an exact penalty. */
static real penalty_at(const real *block, const real *lambda) {
  real scaled[6];
  for (int k = 0; k < 6; k++) scaled[k] = lambda[k] * HEAD(block)->wrench_scale[k];
  return 2 * SQRT(dot(scaled, scaled, 6));
}

/* Forces on the way to others. */
static void part_of_way(const real *block, real from[][2], real to[][2], real share,
                        real force[][2]) {
  for (int i = 0; i < COUNT(block); i++) {
    for (int c = 0; c < 2; c++) force[i][c] = from[i][c] + share * (to[i][c] - from[i][c]);
  }
}

/* Error that is enough before the first iteration: a tick begins where the robot is; forces
   that are only looked at need not be exact. */
static real enough_to_begin(int turns, const real *previous) {
  if (previous) return 1 / NOTHING;
  if (turns == 0) return 10 * CLOSE;
  return NEARLY / 10;
}

/* Outer iterations from forces (n, 2) on, as many as are given, or from the previous
   commands of the question; its price is one of the wrench. The forces that they come to,
   the last answer of the dual by which they got better, with their commands, and what they
   end with (4,): power [W], what an error as large as the yardstick counts [W], the error,
   steps of Newton's method and on commands. The second and the last are also taken: what an
   error counts at least; steps after which no other iteration is begun. */
int fl_settle(const fl_whole *w, real *block, fl_work *work, const fl_question *question, int turns,
              real *forces, fl_answer *out, real *end) {
  const real exact_enough = NEARLY / 10;
  const real *previous = question->previous;
  const real most_steps = end[3];
  const size_t size_of_forces = (size_t)COUNT(block) * sizeof(real[2]);
  real(*force)[2] = (real(*)[2])forces;
  fl_question q = *question;
  fl_answer answer;
  fl_box box;
  real command[FL_MOST][3];
  real lambda[6];
  real penalty = end[1];
  real steps = 0;
  work->refine_steps = 0;
  if (previous)
    command_fins_by_law(w, block);
  else
    command_fins_by_force(w, block);
  if (!fl_span_of_question(block, work, q.lost, q.free)) return FL_BAD_NUMBER;
  if (previous) fl_power_of_commands(block, work, (real(*)[3])previous, force);
  box_now(block, work, &q, &box);
  fl_commands_for_forces(block, &box, force, previous, command);
  const real enough = enough_to_begin(turns, previous);
  real error = step_to_wrench(w, block, work, &box, q.wrench, enough, command);
  real power = fl_power_of_commands(block, work, command, force);

  for (int turn = 0; turn < turns; turn++) {
    if (turn > 0 && !(steps + (real)work->refine_steps < most_steps)) break;
    const int code = answer_linear(block, work, &q, turn == 0, &answer);
    if (code) return code;
    steps += (real)answer.newton_steps;
    penalty = fl_larger(penalty, penalty_at(block, answer.prices));
    const real merit = power + penalty * error;
    if (turn == 0) *out = answer;
    box_now(block, work, &q, &box);

    /* Shorter and shorter steps from the forces so far to those of the answer, until one is
       better. */
    int is_better = 0;
    real share = 1;
    for (int k = 0; k < STEPS && !is_better; k++) {
      real(*stepped)[3] = answer.command;
      real force_wanted[FL_MOST][2];
      real force_stepped[FL_MOST][2];
      part_of_way(block, force, answer.force, share, force_wanted);
      if (k > 0 || previous) {
        fl_commands_for_forces(block, &box, force_wanted, previous, stepped);
      }
      const real error_stepped =
          step_to_wrench(w, block, work, &box, q.wrench, exact_enough, stepped);
      const real power_stepped = fl_power_of_commands(block, work, stepped, force_stepped);
      is_better = power_stepped + penalty * error_stepped < merit;
      share *= SHORTEN;
      if (!is_better) continue;
      power = power_stepped;
      error = error_stepped;
      *out = answer;
      memcpy(force, force_stepped, size_of_forces);
      memcpy(lambda, out->prices, sizeof lambda);
      q.prices = lambda;
    }
    if (!is_better || merit - power - penalty * error <= CLOSE / 2 * merit) break;
  }
  end[0] = power;
  end[1] = penalty;
  end[2] = error;
  end[3] = steps + (real)work->refine_steps;
  if (turns == 0) return 0;
  command_fins_by_law(w, block);
  box_now(block, work, &q, &box);
  fl_commands_for_forces(block, &box, force, previous, out->command);
  end[2] = step_to_wrench(w, block, work, &box, q.wrench, EXACT, out->command);
  fl_rest_in_dead_bands(block, &box, out->command);
  fl_clip_commands(block, &box, out->command);
  return 0;
}
