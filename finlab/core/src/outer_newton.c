/* Newton's method on multipliers and forces at once, where actuators that push along lines act on
   each other, Eq. 18.

   In each round the model is made linear at the last forces y, J = B + do/dy, and Newton's method
   on its dual goes on from the last multipliers lambda until a tenth of the error is left; its
   responses are the next forces. Where they stay and give the wrench, they are the responses to
   lambda at their own J: the conditions of Karush, Kuhn and Tucker hold on the whole model. A round
   evaluates the model once, and four rounds are the usual number.

   No merit falls on the way, as it does in outer iterations. So forces have to move less in each
   round than in the one before; where they do not, outer iterations begin from the first forces.
   It is so where a force is nearly 0: the slope of its jet changes within some mN. */
#include "internal.h"

#define NEWTON_ROUNDS 12      /* rounds, each with its own linear model */
#define STEPS_IN_ROUND 30     /* of Newton's method on the dual of one linear model */
#define LEFT_IN_ROUND R(0.1)  /* share of the error that a round may leave */
#define SHRINKS R(0.5)        /* largest move of a force over that in the round before */
#define DEARER R(1.1)         /* power of a start over the best one, above which it may lead there */

/* Rounds so far. */
typedef struct {
  const fl_coupled_robot *robot;
  real *block; /* the linear model */
  fl_work *work;
  const fl_question *question;
  const known_end *known; /* of other rounds; 0 for none */
  real (*force)[2];       /* (n, 2) at which the model is linear [N] */
  real (*command)[3];     /* of these */
  real lambda[6];         /* reduced multipliers [W] */
  real residual[6];       /* of the wrench by the whole model, over the wrench scale */
  real error;             /* its size */
  real moved;             /* largest change of a force in the last round, over the largest force */
} newton_search;

/* Whether the robot, in the state of the question, is one for these rounds. The basis is that of the
   laws alone: of a robot that drives all axes that count, it is one of each linear model. */
static int can_begin(newton_search *search) {
  const fl_question *q = search->question;
  fl_work *work = search->work;
  if (!fl_span_of_question(search->block, work, q->lost, q->free)) return 0;
  if (!work->is_whole) fl_limits_without_tick(search->block, work);
  int axes = 0;
  for (int k = 0; k < 6; k++) axes += work->span.axis_counts[k];
  return work->is_convex && work->span.rank == axes;
}

/* Makes the model linear at the forces, by a chord with the slopes as they are. */
static void linearize(newton_search *search, int is_chord) {
  fl_commands_for_forces(search->block, &search->work->box, search->force, 0, search->command);
  search->error = fl_linearize_coupled(search->robot, search->block, search->work,
                                       search->question->wrench, search->command, is_chord,
                                       search->residual);
  if (!is_chord) fl_reduce_effectiveness(search->block, search->work);
}

/* Newton's method on the dual of the linear model, until its error is at most `enough` over the
   wrench scale. The forces become its responses. Returns whether the wrench is met so. */
static int solve_dual(newton_search *search, real enough) {
  real *block = search->block;
  fl_work *work = search->work;
  real wrench[6];
  real target_reduced[6];
  for (int k = 0; k < 6; k++) {
    wrench[k] = 0;
    if (!work->span.axis_counts[k]) continue;
    wrench[k] = search->question->wrench[k] - work->span.wrench_offset[k];
  }
  fl_reduce_wrench(work, wrench, target_reduced);
  work->residual_enough = larger(TOLERANCE, enough);
  const int status = fl_dual_newton(block, work, target_reduced, search->lambda, STEPS_IN_ROUND);
  work->residual_enough = TOLERANCE;
  if (status != FL_MET) return 0;

  const fl_state *found = work->state_found;
  memcpy(search->lambda, found->lambda_reduced, sizeof search->lambda);
  search->moved = 0;
  for (int i = 0; i < COUNT(block); i++) {
    const real change = FABS(found->force[i][0] - search->force[i][0]);
    search->moved = larger(search->moved, change / ACTUATOR(block, i)->row_force_max[0]);
    search->force[i][0] = found->force[i][0];
    search->force[i][1] = 0;
  }
  return 1;
}

/* Power of commands, and what their residual is worth at multipliers of the wrench [W]. */
static real lagrangian(const newton_search *search, real command[][3], const real *residual,
                       const real *multipliers) {
  const real *sigma = HEAD(search->block)->wrench_scale;
  real unused[FL_MOST][2];
  real sum = fl_power_of_commands(search->block, search->work, command, unused);
  for (int k = 0; k < 6; k++) sum += multipliers[k] * sigma[k] * residual[k];
  return sum;
}

/* Writes the answer. */
static void write_answer(newton_search *search, fl_answer *answer, fl_outer_result *result) {
  const fl_span *span = &search->work->span;
  answer->gap_power_bound = 0;
  answer->newton_status = FL_MET;
  answer->newton_steps = search->work->newton_steps;
  answer->has_foil_commands = 0;
  answer->is_attainable = 1;
  answer->is_truncated = 0;
  answer->error = search->error;
  copy_forces(search->block, search->force, answer->force);
  memcpy(answer->lambda_reduced, search->lambda, sizeof answer->lambda_reduced);
  for (int k = 0; k < 6; k++) {
    answer->multipliers[k] = dot(span->basis[k], search->lambda, span->rank) / span->axis_scale[k];
  }
  result->power =
      fl_power_of_commands(search->block, search->work, search->command, search->force);
  result->penalty = fl_exact_penalty(search->block, answer->multipliers);
  result->error = search->error;
}

int fl_newton_from(const fl_coupled_robot *robot, real *block, fl_work *work,
                   const fl_question *question, const known_end *known, real force[][2],
                   fl_answer *answer, fl_outer_result *result) {
  newton_search search = {.robot = robot,
                          .block = block,
                          .work = work,
                          .question = question,
                          .known = known,
                          .force = force,
                          .command = answer->command};
  real command_begin[FL_MOST][3];
  real residual_begin[6];
  work->newton_steps = 0;
  result->steps = 0;
  if (!can_begin(&search)) return NEWTON_LEFT;
  fl_reduce_lambda(work, question->multipliers, search.lambda);
  linearize(&search, 0);
  copy_commands(block, search.command, command_begin);
  memcpy(residual_begin, search.residual, sizeof residual_begin);
  int status = NEWTON_LEFT;
  real moved_before = LARGEST_NUMBER;
  for (int k = 0; k < NEWTON_ROUNDS && status == NEWTON_LEFT; k++) {
    /* The first answer of a start has to be that of its linear model: it tells where it leads. */
    real enough = LEFT_IN_ROUND * search.error;
    if (known && k == 0) enough = 0;
    if (!solve_dual(&search, enough)) break;
    if (!(search.moved <= SHRINKS * moved_before)) break;
    moved_before = search.moved;
    const int is_settled = search.moved <= FINE;
    fl_commands_for_forces(block, &work->box, force, 0, search.command);
    if (known && fl_leads_to_known(block, work, known, force, search.command)) {
      /* A start that is about as cheap may be so in its own way, which steps have left: outer
         iterations would not. */
      const int is_sure = k == 0 || lagrangian(&search, command_begin, residual_begin,
                                               question->multipliers) > DEARER * known->power;
      if (is_sure) status = NEWTON_KNOWN;
      break;
    }
    linearize(&search, is_settled);
    if (is_settled && search.error <= TOLERANCE) status = NEWTON_MET;
  }
  result->steps = (real)work->newton_steps;
  if (status == NEWTON_MET) write_answer(&search, answer, result);
  return status;
}
