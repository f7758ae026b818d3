/* Answers where actuators act on each other, Eq. 18, in outer iterations: the dual of the model
   made linear at the last forces, then Levenberg-Marquardt steps on the whole model (sequential
   convex programming). finlab/allocation/dual/outer_iterations.py says where they converge. */
#include "jets.h"

/* Parts of sets with gaps that are looked at after the first iteration, which begins near
   its answer. */
#define PARTS_LATER 200
#define MODEL_STEPS 4  /* steps on commands that make them exact on the whole model */
#define TRIALS 4       /* shares of a step that are tried in one iteration */
#define SHORTEN R(0.3) /* a step that gets no better is shortened to this share */
#define MU_KEPT R(0.3) /* damping of Levenberg-Marquardt after a kept step, over that before */
#define MU_REFUSED 30  /* the same after a refused step */
/* Error over the wrench scale that commands on the way may leave. */
#define EXACT_ON_WAY (NEARLY / 10)
/* Share of power and what the error counts that makes another iteration worth it; of lines, whose
   iterations settle at once, less. */
#define GAIN_LEAST (CLOSE / 2)
#define GAIN_LEAST_OF_LINES (NEARLY / 10)
#define WORTH_OFF R(0.5) /* share by which a residual may be worth less than multipliers say */
#define MUCH_CHEAPER (10 * CLOSE) /* share of a known power below which forces are other ones */

/* Along how many axes the law of an actuator has forces, from the first one on. */
static int law_axes(const fl_actuator *a) {
  if (a->command_kind == FL_THRUSTER) return 1;
  return 3;
}

/* Forces of commands along the laws' axes, and in the body frame, where a foil's drag at
   rest is on top. */
static void forces_of_commands(const fl_coupled_robot *robot, const real *block,
                               const fl_span *span, real command[][3], real force[][3],
                               real body[][3]) {
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    memset(force[i], 0, sizeof force[i]);
    memset(body[i], 0, sizeof body[i]);
    if (span->is_lost[i]) continue;
    if (!fl_is_in_dead_band(a, command[i])) fl_force_of_command(block, i, command[i], force[i], 0);
    for (int c = 0; c < law_axes(a); c++) {
      real along = force[i][c];
      if (fl_form_of(a)->has_drag && c == 1) along += a->pressure_area * a->zero_lift_drag;
      const real *axis = robot->frames + 9 * i + 3 * c;
      for (int b = 0; b < 3; b++) body[i][b] += along * axis[b];
    }
  }
}

/* What actuators do to each other at forces: the offset (6,), and, where wanted, its derivatives
   (n, 3, 6) by the forces along the laws' axes. */
static void offset_along_axes(const fl_coupled_robot *robot, const real *block, const fl_span *span,
                              real force[][3], real body[][3], int has_slope, real *offset,
                              real by_axes[][3][6]) {
  if (robot->line_jets) {
    fl_jets_of_lines(robot, span, force, offset, has_slope ? by_axes : 0);
    return;
  }
  real unused[FL_MOST][3];
  real slope[FL_MOST][3][6];
  robot->offset(robot->constants, *body, 1, robot->inflow, *unused, offset,
                has_slope ? **slope : 0);
  for (int i = 0; has_slope && i < COUNT(block); i++) {
    for (int c = 0; c < law_axes(ACTUATOR(block, i)); c++) {
      const real *axis = robot->frames + 9 * i + 3 * c;
      for (int k = 0; k < 6; k++) {
        by_axes[i][c][k] = axis[0] * slope[i][0][k] + axis[1] * slope[i][1][k] +
                           axis[2] * slope[i][2][k];
      }
    }
  }
}

/* Makes the wrench of a block linear at commands: its effectiveness becomes that of the laws
   and the slope of what the actuators do to each other, its offset what is left. By a chord the
   slope stays that of the commands before, and the offset alone is evaluated. Their residual from
   a wrench, over the wrench scale; its size. */
real fl_linearize_coupled(const fl_coupled_robot *robot, real *block, fl_work *work,
                          const real *wrench, real command[][3], int is_chord, real *residual) {
  const fl_span *span = &work->span;
  const int n = COUNT(block);
  fl_head *head = (fl_head *)block;
  real force[FL_MOST][3];
  real body[FL_MOST][3];
  real offset[6];
  real slope[FL_MOST][3][6]; /* by the forces along the laws' axes */
  forces_of_commands(robot, block, span, command, force, body);
  offset_along_axes(robot, robot->block_uncoupled, span, force, body, !is_chord, offset, slope);
  real per_scale[6]; /* 1 / sigma of axes that count, else 0 */
  for (int k = 0; k < 6; k++) {
    per_scale[k] = robot->axis_counts[k] / head->wrench_scale[k];
    head->wrench_offset[k] = HEAD(robot->block_uncoupled)->wrench_offset[k] +
                             robot->axis_counts[k] * offset[k];
    residual[k] = (wrench[k] - head->wrench_offset[k]) / head->wrench_scale[k];
  }
  for (int i = 0; i < n; i++) {
    const fl_actuator *plain = ACTUATOR(robot->block_uncoupled, i);
    fl_actuator *linear = (fl_actuator *)ACTUATOR(block, i);
    for (int c = 0; c < law_axes(plain); c++) {
      const real *by_laws = plain->effectiveness_normalized[c];
      real *by_model = linear->effectiveness_normalized[c];
      for (int k = 0; k < 6; k++) {
        if (!is_chord) by_model[k] = by_laws[k] + slope[i][c][k] * per_scale[k];
        const real more = (by_model[k] - by_laws[k]) * head->wrench_scale[k];
        head->wrench_offset[k] -= force[i][c] * more;
        residual[k] -= force[i][c] * by_laws[k];
      }
    }
  }
  fl_offset_wrench(block, &work->span);
  for (int k = 0; k < 6; k++) {
    if (!span->axis_counts[k]) residual[k] = 0;
  }
  return SQRT(dot(residual, residual, 6));
}

/* The wrench (6,) [N, N m] of commands by the whole model, which the block becomes linear at. */
void fl_coupled_wrench(const fl_coupled_robot *robot, real *block, fl_work *work, real command[][3],
                       real *wrench) {
  const real *sigma = HEAD(block)->wrench_scale;
  const real nothing[6] = {0};
  real residual[6];
  fl_linearize_coupled(robot, block, work, nothing, command, 0, residual);
  for (int k = 0; k < 6; k++) wrench[k] = -residual[k] * sigma[k];
}

/* Has fins of a block commanded by direction and size of the force, without their tables. */
static void command_fins_by_force(const fl_coupled_robot *robot, real *block, fl_work *work) {
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *plain = ACTUATOR(robot->block_uncoupled, i);
    fl_actuator *a = (fl_actuator *)ACTUATOR(block, i);
    if (plain->command_kind != FL_FIN) continue;
    const real low[3] = {plain->sector_center - plain->sector_half_angle, plain->force_min};
    const real high[3] = {plain->sector_center + plain->sector_half_angle, plain->force_max};
    a->command_kind = FL_POD;
    a->is_free_angle = plain->sector_half_angle >= PI;
    memcpy(a->command_min, low, sizeof low);
    memcpy(a->command_max, high, sizeof high);
    work->is_whole = 0;
  }
}

/* Has fins of a block commanded as they are. */
static void command_fins_by_law(const fl_coupled_robot *robot, real *block, fl_work *work) {
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *plain = ACTUATOR(robot->block_uncoupled, i);
    fl_actuator *a = (fl_actuator *)ACTUATOR(block, i);
    if (plain->command_kind != FL_FIN) continue;
    a->command_kind = FL_FIN;
    a->is_free_angle = plain->is_free_angle;
    memcpy(a->command_min, plain->command_min, sizeof a->command_min);
    memcpy(a->command_max, plain->command_max, sizeof a->command_max);
    work->is_whole = 0;
  }
}

/* A merit that commands have to get below, and multipliers (6,) of the wrench by which it is seen
   before they give the wrench. */
typedef struct {
  real merit; /* [W] */
  const real *multipliers;
} merit_limit;

/* Whether commands are surely at no less than the limit: by the Lagrangian, their power and what
   their residual is worth, which to first order is the power where they give the wrench. */
static int is_too_dear(const real *block, fl_work *work, real command[][3], const real *residual,
                       const merit_limit *limit) {
  const real *sigma = HEAD(block)->wrench_scale;
  real unused[FL_MOST][2];
  real worth = 0;
  for (int k = 0; k < 6; k++) worth += limit->multipliers[k] * sigma[k] * residual[k];
  const real lagrangian = fl_power_of_commands(block, work, command, unused) + worth;
  return lagrangian - limit->merit > WORTH_OFF * FABS(worth);
}

/* Steps on commands to a wrench, by the whole model, which the block is linear at where they
   end, or by a chord where they begin, until an error is enough, or commands are seen to be beyond
   a limit, 0 for none; the error that is left, LARGEST_NUMBER beyond the limit. */
static real step_to_wrench(const fl_coupled_robot *robot, real *block, fl_work *work,
                           const fl_box *box, const real *wrench, real enough, int is_chord,
                           const merit_limit *limit, real command[][3]) {
  const size_t size = (size_t)COUNT(block) * sizeof *command;
  real residual[6];
  real share = 1;
  real error = fl_linearize_coupled(robot, block, work, wrench, command, 0, residual);
  for (int k = 0; k < MODEL_STEPS && error > enough; k++) {
    if (limit && is_too_dear(block, work, command, residual, limit)) return LARGEST_NUMBER;
    real stepped[FL_MOST][3];
    real nearer[6]; /* than the wrench, by a share of the way */
    real residual_stepped[6];
    memcpy(stepped, command, size);
    for (int c = 0; c < 6; c++) {
      nearer[c] = wrench[c] - (1 - share) * residual[c] * HEAD(block)->wrench_scale[c];
    }
    fl_refine_commands(block, work, box, nearer, stepped, 1);
    const real error_stepped =
        fl_linearize_coupled(robot, block, work, wrench, stepped, is_chord, residual_stepped);
    if (error_stepped < error) {
      memcpy(command, stepped, size);
      memcpy(residual, residual_stepped, sizeof residual);
      error = error_stepped;
      share = 1;
      continue;
    }
    share *= SHORTEN;
    fl_linearize_coupled(robot, block, work, wrench, command, is_chord, residual);
  }
  return error;
}

real fl_refine_coupled(const fl_coupled_robot *robot, real *block, fl_work *work, const fl_box *box,
                       const real *wrench, real enough, int most_steps, real command[][3]) {
  const size_t size = (size_t)COUNT(block) * sizeof *command;
  real residual[6];
  real mu = NEARLY;
  real error = fl_linearize_coupled(robot, block, work, wrench, command, 0, residual);
  for (int k = 0; k < most_steps && error > enough; k++) {
    real stepped[FL_MOST][3];
    real residual_stepped[6];
    fl_step_commands(block, work, box, residual, mu, command, stepped);
    const real error_stepped =
        fl_linearize_coupled(robot, block, work, wrench, stepped, 0, residual_stepped);
    if (error_stepped <= error) {
      memcpy(command, stepped, size);
      memcpy(residual, residual_stepped, sizeof residual);
      error = error_stepped;
      mu *= MU_KEPT;
      continue;
    }
    mu = mu * MU_REFUSED + CLOSE;
    fl_linearize_coupled(robot, block, work, wrench, command, 0, residual);
  }
  return error;
}

/* The box of commands after the previous ones, or of all, of a block whose fins may be
   commanded by their forces. */
void fl_box_of_question(const real *block, fl_work *work, const fl_question *q, fl_box *box) {
  fl_question calm = *q;
  calm.calm = 0;
  if (q->previous)
    fl_limits_of_tick(block, work, &calm);
  else if (!work->is_whole)
    fl_limits_without_tick(block, work);
  *box = work->box;
}

/* The dual's answer to a question on the linear model; those after the first look at fewer
   parts. */
static int answer_linear(real *block, fl_work *work, const fl_question *q, int is_first,
                         fl_answer *answer) {
  if (!fl_prepare_span(block, work, 0)) return FL_BAD_NUMBER;
  const fl_settings usual = work->settings;
  if (!is_first && PARTS_LATER < usual.most_parts) work->settings.most_parts = PARTS_LATER;
  const int code = fl_answer_one(block, work, q, answer);
  work->settings = usual;
  return code;
}

/* What an error as large as the wrench scale is worth [W] at multipliers of the wrench: twice
   that makes an exact penalty. */
real fl_exact_penalty(const real *block, const real *lambda) {
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

/* Outer iterations so far: the best forces, and what they cost. */
typedef struct {
  const fl_coupled_robot *robot;
  real *block; /* the linear model */
  fl_work *work;
  const known_end *known; /* of other iterations; 0 for none */
  fl_question question;   /* whose multipliers become those of the best answer */
  real lambda[6];         /* that they point at */
  fl_box box;             /* of the commands by which the block is commanded now */
  real (*force)[2];       /* (n, 2) the best ones [N] */
  real power;             /* of these [W] */
  real penalty;           /* what an error as large as the wrench scale counts [W] */
  real error;             /* of the wrench, over the wrench scale */
  real newton_steps;
  int is_known;    /* whether iterations would end at the known forces */
  real gain_least; /* share of what the best forces cost that makes another iteration worth it */
} outer_search;

static real merit_of(const outer_search *search) {
  return search->power + search->penalty * search->error;
}

/* Steps of Newton's method and on commands that the iterations took. */
static real steps_of(const outer_search *search) {
  return search->newton_steps + (real)search->work->refine_steps;
}

/* Error that is enough before the first iteration: a tick begins where the robot is; forces
   that are only looked at need not be exact, nor those that may lead to known ones. */
static real enough_to_begin(const outer_search *search, int most_iterations) {
  if (search->question.previous) return 1 / NOTHING;
  if (most_iterations == 0 || search->known) return 10 * CLOSE;
  return EXACT_ON_WAY;
}

/* Makes the model linear at the forces where the iterations begin, those of the previous commands
   in a tick, and finds what they cost. Returns an error code. */
static int begin_search(outer_search *search, int most_iterations) {
  real *block = search->block;
  fl_work *work = search->work;
  const fl_question *q = &search->question;
  const real *previous = q->previous;
  work->refine_steps = 0;
  search->newton_steps = 0;
  if (previous) {
    command_fins_by_law(search->robot, block, work);
  } else {
    command_fins_by_force(search->robot, block, work);
  }
  if (!fl_span_of_question(block, work, q->lost, q->free)) return FL_BAD_NUMBER;
  if (previous) fl_power_of_commands(block, work, (real(*)[3])previous, search->force);
  fl_box_of_question(block, work, q, &search->box);

  real command[FL_MOST][3];
  fl_commands_for_forces(block, &search->box, search->force, previous, command);
  const real enough = enough_to_begin(search, most_iterations);
  /* Of lines at rest the slopes where a start begins are near enough to tell what it costs. */
  const int has_lines_alone = fl_has_lines_alone(search->robot->block_uncoupled);
  const int is_chord = most_iterations == 0 && has_lines_alone && !search->robot->inflow;
  search->error = step_to_wrench(search->robot, block, work, &search->box, q->wrench, enough,
                                 is_chord, 0, command);
  search->power = fl_power_of_commands(block, work, command, search->force);
  return FL_OK;
}

/* Tries shorter and shorter steps from the best forces so far to those of an answer, until one has
   less merit. Its commands are those of the answer then. Returns whether there is one. */
static int step_to_answer(outer_search *search, fl_answer *answer, real merit) {
  real *block = search->block;
  const fl_question *q = &search->question;
  /* Lines settle at once: their steps are mostly kept. */
  const int has_lines_alone = fl_has_lines_alone(search->robot->block_uncoupled);
  const merit_limit limit = {merit, answer->multipliers};
  real(*stepped)[3] = answer->command;
  real share = 1;
  for (int k = 0; k < TRIALS; k++) {
    real force_wanted[FL_MOST][2];
    real force_stepped[FL_MOST][2];
    part_of_way(block, search->force, answer->force, share, force_wanted);
    /* Outside of ticks the answer's own commands are tried first, else those for its forces. */
    if (k > 0 || q->previous) {
      fl_commands_for_forces(block, &search->box, force_wanted, q->previous, stepped);
    }
    const real error = step_to_wrench(search->robot, block, search->work, &search->box, q->wrench,
                                      EXACT_ON_WAY, 0, has_lines_alone ? 0 : &limit, stepped);
    const real power = fl_power_of_commands(block, search->work, stepped, force_stepped);
    if (power + search->penalty * error < merit) {
      search->power = power;
      search->error = error;
      memcpy(search->force, force_stepped, (size_t)COUNT(block) * sizeof force_stepped[0]);
      return 1;
    }
    share *= SHORTEN;
  }
  return 0;
}

/* Whether iterations would end at known forces again: forces of the dual's answer, and their
   power [W], have each line push the same way, and cost no less. */
int fl_leads_to_known(const real *block, const known_end *known, real force[][2], real power) {
  if (power < (1 - MUCH_CHEAPER) * known->power) return 0;
  for (int i = 0; i < COUNT(block); i++) {
    if (force[i][0] * known->force[i][0] < 0) return 0;
  }
  return 1;
}

/* One outer iteration: the dual's answer on the linear model, and a step to its forces. `has_ended`
   becomes whether another one would gain nothing. Returns an error code. */
static int iterate(outer_search *search, int is_first, fl_answer *out, int *has_ended) {
  fl_answer answer;
  const int code = answer_linear(search->block, search->work, &search->question, is_first, &answer);
  if (code) return code;
  search->newton_steps += (real)answer.newton_steps;
  if (search->known) {
    real unused[FL_MOST][2];
    const real power = fl_power_of_commands(search->block, search->work, answer.command, unused);
    search->is_known = fl_leads_to_known(search->block, search->known, answer.force, power);
  }
  *has_ended = 1;
  if (search->is_known) return FL_OK;
  search->penalty = larger(search->penalty, fl_exact_penalty(search->block, answer.multipliers));
  const real merit = merit_of(search);
  if (is_first) *out = answer;
  fl_box_of_question(search->block, search->work, &search->question, &search->box);

  const int is_better = step_to_answer(search, &answer, merit);
  if (is_better) {
    *out = answer;
    memcpy(search->lambda, answer.multipliers, sizeof search->lambda);
    search->question.multipliers = search->lambda;
  }
  const real gain = merit - search->power - search->penalty * search->error;
  *has_ended = !is_better || gain <= search->gain_least * merit;
  return FL_OK;
}

/* Has idle actuators turn in a tick that misses its wrench, by the linear model. */
static void turn_idle(outer_search *search, real command[][3]) {
  const fl_question *q = &search->question;
  const int has_missed = fl_is_missed(search->error);
  if (!q->previous || !has_missed) return;
  if (!fl_prepare_span(search->block, search->work, 0)) return;
  real wrench[6]; /* in axes that count */
  for (int k = 0; k < 6; k++) {
    wrench[k] = 0;
    if (search->work->span.axis_counts[k]) wrench[k] = q->wrench[k];
  }
  if (!fl_may_give_later(search->block, search->work, has_missed, command)) return;
  fl_prepare_idle(search->block, search->work, q, wrench, command);
}

/* Commands by the laws for the best forces, as exact as the whole model can tell. */
static void finish_search(outer_search *search, fl_answer *out) {
  const fl_question *q = &search->question;
  command_fins_by_law(search->robot, search->block, search->work);
  fl_box_of_question(search->block, search->work, q, &search->box);
  fl_commands_for_forces(search->block, &search->box, search->force, q->previous, out->command);
  real unused[6];
  search->error = fl_linearize_coupled(search->robot, search->block, search->work, q->wrench,
                                       out->command, 1, unused);
  if (search->error > EXACT) {
    search->error = step_to_wrench(search->robot, search->block, search->work, &search->box,
                                   q->wrench, EXACT, 0, 0, out->command);
  }
  fl_rest_in_dead_bands(search->block, &search->box, out->command);
  turn_idle(search, out->command);
  fl_clip_commands(search->block, &search->box, out->command);
}

/* As fl_outer_iterations. Where they would end as others did, 0 for none, they end at once, and
   their error says that nothing better was found. */
int fl_iterations_from(const fl_coupled_robot *robot, real *block, fl_work *work,
                       const fl_question *question, const fl_outer_limits *limits,
                       const known_end *known, real force[][2], fl_answer *answer,
                       fl_outer_result *result) {
  outer_search search = {0};
  search.robot = robot;
  search.block = block;
  search.work = work;
  search.question = *question;
  search.known = known;
  search.force = force;
  search.penalty = limits->penalty_least;
  const int has_lines_alone = fl_has_lines_alone(robot->block_uncoupled);
  search.gain_least = GAIN_LEAST;
  if (has_lines_alone) search.gain_least = GAIN_LEAST_OF_LINES;
  int code = begin_search(&search, limits->most_iterations);
  if (code) return code;
  for (int k = 0; k < limits->most_iterations; k++) {
    if (k > 0 && !(steps_of(&search) < limits->most_steps)) break;
    int has_ended;
    code = iterate(&search, k == 0, answer, &has_ended);
    if (code) return code;
    if (has_ended) break;
  }
  result->steps = steps_of(&search);
  if (search.is_known) {
    result->error = LARGEST_NUMBER;
    return FL_OK;
  }
  if (limits->most_iterations > 0) finish_search(&search, answer);
  result->power = search.power;
  result->penalty = search.penalty;
  result->error = search.error;
  return FL_OK;
}

int fl_outer_iterations(const fl_coupled_robot *robot, real *block, fl_work *work,
                        const fl_question *question, const fl_outer_limits *limits, real *force,
                        fl_answer *answer, fl_outer_result *result) {
  return fl_iterations_from(robot, block, work, question, limits, 0, (real(*)[2])force, answer,
                            result);
}
