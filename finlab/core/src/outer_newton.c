/* Newton's method on multipliers and forces at once, where actuators that push along lines act on
   each other, Eq. 18.

   In each round the model is made linear at the last forces y, J = B + do/dy, and Newton's method
   on its dual goes on from the last multipliers lambda until a tenth of the error is left; its
   responses are the next forces. Where they stay and give the wrench, they are the responses to
   lambda at their own J: the conditions of Karush, Kuhn and Tucker hold on the whole model. A round
   evaluates the model once, and four rounds are the usual number.

   No merit falls on the way, as it does in outer iterations. So forces have to move less in each
   round than in the one before; where they do not, outer iterations begin from the first forces.
   It is so where a force is nearly 0, as the slope of its jet changes within some mN there. One
   such force is held while the others are found, and moved between the rounds, to where the excess
   P'(y) - s of its marginal power over its price is 0: between two bounds, by the Illinois method.
*/
#include "internal.h"

#define NEWTON_ROUNDS 16     /* rounds, each with its own linear model */
#define STEPS_IN_ROUND 30    /* of Newton's method on the dual of one linear model */
#define LEFT_IN_ROUND R(0.1) /* share of the error that a round may leave */
#define SHRINKS R(0.5)       /* largest move of a force over that in the round before */
#define LARGE_CHANGE R(0.3) /* of a force, over its sizes before and after, from which it is held */
#define BOUND_SHARE R(0.05) /* share of the way between two bounds that a next value is off them */
#define SMALL_EXCESS R(1e-3) /* of a held force, over the price of the largest one */
#define SMALL_GAIN R(1e-10)  /* share of the power that its next value may still gain */
#define DEARER R(1.1) /* power of a start over the best one, from which it may lead back there */

enum { NO_LINE = -1 };

/* A force that is held while the others are found. */
typedef struct {
  int line;       /* which one it is, or NO_LINE */
  real bound[2];  /* between which its best value lies [N] */
  real excess[2]; /* there [W/N]; 0 where it is not known */
  int side;       /* which bound the last value has become, -1 before there is one */
  real gain;      /* what the next value may gain [W] */
} held_force;

/* Rounds so far. */
typedef struct {
  const fl_coupled_robot *robot;
  real *block; /* the linear model */
  fl_work *work;
  const fl_question *question;
  real (*force)[2];   /* (n, 2) at which the model is linear [N] */
  real (*command)[3]; /* of these */
  real lambda[6];     /* reduced multipliers [W] */
  real residual[6];   /* of the wrench by the whole model, over the wrench scale */
  real error;         /* its size */
  held_force held;
} newton_search;

/* How responses differ from the forces at which the model is linear, but for the held one. */
typedef struct {
  real largest;   /* change of a force, over its largest value */
  real most;      /* change of a force, over its sizes before and after */
  int most_moved; /* the line whose change that is */
} change_of_forces;

/* Whether the robot, in the state of the question, is one for these rounds. The basis is that of
   the laws alone: of a robot that drives all axes that count, it is one of each linear model. */
static int can_begin(const newton_search *search) {
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
   wrench scale. Returns whether the wrench is met so. */
static int solve_dual(const newton_search *search, real enough) {
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
  const int status =
      fl_dual_newton(search->block, work, target_reduced, search->lambda, STEPS_IN_ROUND);
  work->residual_enough = TOLERANCE;
  return status == FL_MET;
}

static change_of_forces compare_responses(const newton_search *search) {
  const fl_state *found = search->work->state_found;
  change_of_forces change = {0, 0, NO_LINE};
  for (int i = 0; i < COUNT(search->block); i++) {
    if (i == search->held.line) continue;
    const real before = search->force[i][0];
    const real after = found->force[i][0];
    const real moved = FABS(after - before);
    const real most = ACTUATOR(search->block, i)->row_force_max[0];
    const real sizes = FABS(before) + FABS(after);
    change.largest = larger(change.largest, moved / most);
    if (moved > change.most * sizes) {
      change.most = moved / sizes;
      change.most_moved = i;
    }
  }
  return change;
}

/* Power of the responses [W], sum P(y) = sum s y - sum c*(s), from the dual value and its gradient:
   Eq. 3 and 6. */
static real power_found(const newton_search *search) {
  const fl_state *found = search->work->state_found;
  return found->dual_value - dot(found->lambda_reduced, found->residual, 6);
}

/* Takes the responses of the linear model for the forces, and its multipliers. */
static void take_responses(newton_search *search) {
  const fl_state *found = search->work->state_found;
  memcpy(search->lambda, found->lambda_reduced, sizeof search->lambda);
  copy_forces(search->block, (real(*)[2])found->force, search->force);
}

/* Limits all forces but the held one to what the question allows, and that one to its value. */
static void fix_held(const newton_search *search) {
  const real *block = search->block;
  fl_work *work = search->work;
  const int i = search->held.line;
  fl_limits_without_tick(block, work);
  fl_fix_force(block, i, work->set + i, search->force[i]);
  fl_prepare_sets(block, work);
}

/* Holds the force that changes most: at 0 where it changes its sign or shrinks, else where it goes.
   Its best value is looked for on the way that it went. */
static void hold_force(newton_search *search, int line) {
  const real before = search->force[line][0];
  const real after = search->work->state_found->force[line][0];
  held_force *held = &search->held;
  held->line = line;
  held->bound[0] = smaller(before, after);
  held->bound[1] = larger(before, after);
  held->excess[0] = 0;
  held->excess[1] = 0;
  held->side = -1;
  held->gain = LARGEST_NUMBER;
  const int is_away = before * after >= 0 && FABS(after) >= FABS(before);
  search->force[line][0] = 0;
  if (is_away) search->force[line][0] = after;
  fix_held(search);
}

/* The root of a force, with its sign: what a jet does is about linear in it. */
static real signed_root(real force) {
  if (force < 0) return -SQRT(-force);
  return SQRT(force);
}

/* Where an excess that is linear in the root of the force would be 0, but not too near to a bound;
   in the middle where it is not known at both. */
static real next_value(const held_force *held) {
  const real low = signed_root(held->bound[0]);
  const real high = signed_root(held->bound[1]);
  real share = R(0.5);
  if (held->excess[0] < 0 && held->excess[1] > 0) {
    share = held->excess[0] / (held->excess[0] - held->excess[1]);
  }
  const real root = low + clipped(share, BOUND_SHARE, 1 - BOUND_SHARE) * (high - low);
  return root * FABS(root);
}

/* Makes the value of the held force a bound, as its excess says, and moves it to the next one. */
static void move_held(newton_search *search) {
  held_force *held = &search->held;
  const int i = held->line;
  const fl_actuator *a = ACTUATOR(search->block, i);
  const real y = search->force[i][0];
  const real s = dot(search->work->span.effectiveness_reduced[i][0], search->lambda, 6);
  real marginal; /* P'(y) [W/N] */
  fl_power_and_price(search->block, i, y, &marginal);
  if (y < 0) marginal = -marginal;
  const real excess = marginal - s;
  const int side = excess > 0;
  held->bound[side] = y;
  held->excess[side] = excess;
  if (held->side == side) held->excess[1 - side] /= 2;
  held->side = side;
  const real next = next_value(held);
  /* At a bound that is out of date, as the other forces have changed, the excess stays large. */
  const real price_of_largest = a->row_force_max[0] / a->secant[0];
  held->gain = LARGEST_NUMBER;
  if (FABS(excess) <= SMALL_EXCESS * price_of_largest) held->gain = FABS(excess * (next - y));
  search->force[i][0] = next;
  fix_held(search);
}

/* Power of commands, and what their residual is worth at multipliers of the wrench [W]. */
static real lagrangian_of(const newton_search *search, real command[][3], const real *residual) {
  const real *sigma = HEAD(search->block)->wrench_scale;
  real unused[FL_MOST][2];
  real sum = fl_power_of_commands(search->block, search->work, command, unused);
  for (int k = 0; k < 6; k++) sum += search->question->multipliers[k] * sigma[k] * residual[k];
  return sum;
}

static void write_answer(const newton_search *search, fl_answer *answer, fl_outer_result *result) {
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
  result->power = fl_power_of_commands(search->block, search->work, search->command, search->force);
  result->penalty = fl_exact_penalty(search->block, answer->multipliers);
  result->error = search->error;
}

/* The rounds, from forces at which the model is linear. Returns how they end. */
static int run_rounds(newton_search *search, const known_end *known) {
  fl_work *work = search->work;
  real command_begin[FL_MOST][3];
  real residual_begin[6];
  copy_commands(search->block, search->command, command_begin);
  memcpy(residual_begin, search->residual, sizeof residual_begin);
  real moved_before = LARGEST_NUMBER;
  for (int k = 0; k < NEWTON_ROUNDS; k++) {
    if (!solve_dual(search, LEFT_IN_ROUND * search->error)) return NEWTON_LEFT;
    const change_of_forces change = compare_responses(search);
    const int has_held = search->held.line != NO_LINE;
    if (!has_held && !(change.largest <= SHRINKS * moved_before)) {
      if (!(change.most > LARGE_CHANGE)) return NEWTON_LEFT;
      hold_force(search, change.most_moved);
      continue;
    }
    moved_before = change.largest;
    take_responses(search);
    const real small_gain = SMALL_GAIN * FABS(work->state_found->dual_value);
    const int is_settled = change.largest <= FINE && search->held.gain <= small_gain;

    if (known && fl_leads_to_known(search->block, known, search->force, power_found(search))) {
      /* A start that is about as cheap may have an answer of its own that these rounds have left:
         outer iterations, whose merit falls, would not. */
      if (k == 0) return NEWTON_KNOWN;
      const real merit_begin = lagrangian_of(search, command_begin, residual_begin);
      return merit_begin > DEARER * known->power ? NEWTON_KNOWN : NEWTON_LEFT;
    }
    linearize(search, is_settled);
    if (is_settled && search->error <= TOLERANCE) return NEWTON_MET;
    if (has_held) move_held(search);
  }
  return NEWTON_LEFT;
}

int fl_newton_from(const fl_coupled_robot *robot, real *block, fl_work *work,
                   const fl_question *question, const known_end *known, real force[][2],
                   fl_answer *answer, fl_outer_result *result) {
  newton_search search = {.robot = robot,
                          .block = block,
                          .work = work,
                          .question = question,
                          .force = force,
                          .command = answer->command,
                          .held = {.line = NO_LINE}};
  work->newton_steps = 0;
  result->steps = 0;
  if (!can_begin(&search)) return NEWTON_LEFT;
  fl_reduce_lambda(work, question->multipliers, search.lambda);
  linearize(&search, 0);
  const int status = run_rounds(&search, known);
  if (search.held.line != NO_LINE) fl_limits_without_tick(block, work);
  result->steps = (real)work->newton_steps;
  if (status == NEWTON_MET) write_answer(&search, answer, result);
  return status;
}
