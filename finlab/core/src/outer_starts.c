/* Where outer iterations begin. The whole model of actuators that act on each other is not convex:
   in a symmetric robot no slope turns a jet aside, and which of two jets gives way is a choice
   between minima. So where the answer costs more than the laws alone would have it, iterations
   begin anew: with one force reversed, and with all forces rotated or changed in size.

   Lines cannot turn aside: of a robot of thrusters, what starts differ in is which way each pushes
   where they give the wrench. Starts that push as the best forces do are not followed, nor those
   whose ways were looked at before, nor those whose ways cost more than jets can take. */
#include "internal.h"

#define OUTER_ROUNDS 12      /* outer iterations from one start, and rounds of reversed forces */
#define ITERATIONS_IN_TICK 2 /* the next tick goes on from there */
#define MOST_WORK 400000     /* steps times actuators after which no iteration is begun */
#define CHEAPER (10 * CLOSE) /* share of the power that makes other starts worth a try */
#define REVERSED_FOLLOWED 2  /* starts that are followed of those with one force reversed */
#define OTHERS_FOLLOWED 1    /* the same of those that are rotated, or changed in size */
#define SURE 3               /* a force is turned where that may gain its cost over this */
#define KNOWN_MOST 32        /* ways of lines that a search remembers */
#define FOLLOWED_MOST 2      /* the larger one of these */

/* A start whose forces give the wrench, nearly. */
typedef struct {
  real force[FL_MOST][2]; /* [N] */
  real merit;             /* power, and what the error counts [W] */
} tried_start;

/* A search so far. */
typedef struct {
  const fl_coupled_robot *robot;
  real *block; /* the linear model */
  fl_work *work;
  fl_question question;           /* with the multipliers of the answer by the laws alone */
  real force_by_laws[FL_MOST][2]; /* that answer [N] */
  real force[FL_MOST][2];         /* the best ones so far [N] */
  fl_outer_result best;           /* what they cost */
  int may_prune_lines;            /* whether every actuator pushes along a line, at rest */
  int may_prune;                  /* whether starts that lead to the best forces are left out */
  fl_byte known_way[KNOWN_MOST][FL_MOST]; /* 1 of lines that push ahead, as they were looked at */
  int known_count;
  real null_space[FL_MOST][FL_MOST]; /* columns of N of `find_null_space` */
  real turn_cost[FL_MOST]; /* what it costs at least to turn each of the best forces [W] */
  real turn_gain[FL_MOST]; /* what jets would take less without each of them, nearly [W] */
  fl_answer *answer;       /* by which they were found */
  real steps_left;
} start_search;

/* Whether iterations that end so are better than others: nearer to the wrench, or as near at less
   power. */
static int is_better(const fl_outer_result *one, const fl_outer_result *other) {
  const real nearer = other->error - one->error;
  if (nearer > NEARLY) return 1;
  return nearer >= -NEARLY && one->power < other->power;
}

/* Iterations from forces, which become those at which they end; none where they come to those that
   are known. Returns an error code. */
static int follow(start_search *search, const known_end *known, real force[][2], fl_answer *answer,
                  fl_outer_result *result) {
  const fl_outer_limits limits = {
      .penalty_least = 0, .most_steps = search->steps_left, .most_iterations = OUTER_ROUNDS};
  const int code = fl_iterations_from(search->robot, search->block, search->work, &search->question,
                                      &limits, known, force, answer, result);
  search->steps_left -= result->steps;
  return code;
}

/* The forces of a start: the best ones with one reversed, or those by the laws alone rotated and
   changed in size. */
static void forces_of_start(const start_search *search, int is_reversed, int start,
                            real force[][2]) {
  const int n = COUNT(search->block);
  if (is_reversed) {
    memcpy(force, search->force, (size_t)n * sizeof force[0]);
    force[start][0] = -force[start][0];
    force[start][1] = -force[start][1];
    return;
  }
  const real *factor = search->robot->starts + 2 * n * start;
  for (int i = 0; i < n; i++) {
    const real x = search->force_by_laws[i][0];
    const real y = search->force_by_laws[i][1];
    force[i][0] = factor[2 * i] * x - factor[2 * i + 1] * y;
    force[i][1] = factor[2 * i + 1] * x + factor[2 * i] * y;
  }
}

/* Keeps a start among the cheapest ones, which are sorted by merit. */
static void keep_cheapest(const real *block, const tried_start *one, int followed,
                          tried_start *cheapest) {
  int index = followed;
  while (index > 0 && one->merit < cheapest[index - 1].merit) index--;
  for (int k = followed - 1; k > index; k--) cheapest[k] = cheapest[k - 1];
  if (index == followed) return;
  memcpy(cheapest[index].force, one->force, (size_t)COUNT(block) * sizeof one->force[0]);
  cheapest[index].merit = one->merit;
}

/* Finds the matrix N = I - J' (J J')^-1 J, J the linear model at the best forces: a start y becomes
   b + N (y - b) where it gives the wrench by that model, b the best forces. */
static void find_null_space(start_search *search) {
  const real *block = search->block;
  const fl_span *span = &search->work->span;
  const int n = COUNT(block);
  real row[FL_MOST][6];
  real gram[6][6] = {{0}};
  for (int i = 0; i < n; i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    for (int k = 0; k < 6; k++) {
      row[i][k] = 0;
      if (span->axis_counts[k] && !span->is_lost[i]) {
        row[i][k] = a->row_force_max[0] * a->effectiveness_normalized[0][k];
      }
    }
    fl_add_square(gram, row[i], 1);
  }
  const real ridge = NOTHING * fl_trace(gram) + TINY;
  for (int k = 0; k < 6; k++) gram[k][k] += ridge;
  const int is_regular = fl_factor(gram);
  for (int j = 0; j < n; j++) {
    real multiplier[6] = {0};
    if (is_regular) fl_solve(gram, row[j], multiplier);
    const real *most_j = ACTUATOR(block, j)->row_force_max;
    for (int i = 0; i < n; i++) {
      const real *most_i = ACTUATOR(block, i)->row_force_max;
      const real part = dot(row[i], multiplier, 6) * most_i[0] / most_j[0];
      search->null_space[j][i] = (real)(i == j) - part;
    }
  }
}

/* What it costs, and may gain, to turn each of the best forces y_i of a robot of lines.

   By the linear model, whose multipliers are those of the answer, the power rises by at least the
   conjugate c*(s_i) = s_i y_i - P(y_i) where y_i is 0 or points the other way (weak duality). What
   jets take is homogeneous of degree 1 in the forces, and of each like its root, so that it falls
   by twice what the linear model says where y_i vanishes; the model has one half of that. */
static void find_turn_costs(start_search *search) {
  const real *block = search->block;
  const real *sigma = HEAD(block)->wrench_scale;
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *linear = ACTUATOR(block, i);
    const fl_actuator *plain = ACTUATOR(search->robot->block_uncoupled, i);
    const real force = search->force[i][0];
    real price;
    const real power = fl_power_and_price(block, i, force, &price);
    real taken = 0;
    for (int k = 0; k < 6; k++) {
      const real slope = linear->effectiveness_normalized[0][k] -
                         plain->effectiveness_normalized[0][k];
      taken += search->answer->multipliers[k] * sigma[k] * slope;
    }
    search->turn_cost[i] = price * FABS(force) - power;
    search->turn_gain[i] = FABS(taken * force);
  }
}

/* Prepares what tells which starts are not worth a try, while the linear model is that of the best
   forces. */
static void prepare_pruning(start_search *search) {
  const int is_met = search->answer->is_attainable && search->best.error <= NEARLY;
  search->may_prune = search->may_prune_lines && is_met;
  if (!search->may_prune) return;
  find_null_space(search);
  find_turn_costs(search);
}

/* Whether lines that push so were looked at before; they are kept. */
static int were_known_ways(start_search *search, const fl_byte *way) {
  const int n = COUNT(search->block);
  for (int k = 0; k < search->known_count; k++) {
    int differ = 0;
    for (int i = 0; i < n; i++) differ |= search->known_way[k][i] != way[i];
    if (!differ) return 1;
  }
  if (search->known_count < KNOWN_MOST) {
    memcpy(search->known_way[search->known_count], way, (size_t)n);
    search->known_count++;
  }
  return 0;
}

/* Forces b + N (y - b) to which a start y of lines comes by the linear model at the best forces
   b. */
static void move_by_linear_model(const start_search *search, real start[][2], real moved[][2]) {
  const int n = COUNT(search->block);
  real way[FL_MOST]; /* N (y - b) */
  for (int i = 0; i < n; i++) way[i] = 0;
  for (int j = 0; j < n; j++) {
    const real off = start[j][0] - search->force[j][0];
    if (off == 0) continue; /* as all but the reversed one */
    for (int i = 0; i < n; i++) way[i] += search->null_space[j][i] * off;
  }
  for (int i = 0; i < n; i++) {
    moved[i][0] = search->force[i][0] + way[i];
    moved[i][1] = 0;
  }
}

/* Whether a start is not worth a try. At the forces to which it has moved by the linear model each
   line pushes its way: all as the best forces do, or as others did that were looked at, or some
   another way at more than that may gain. */
static int is_pruned(start_search *search, real moved[][2]) {
  const int n = COUNT(search->block);
  int turned = 0;
  real cost = 0;
  real gain = 0;
  fl_byte way[FL_MOST] = {0};
  for (int i = 0; i < n; i++) {
    if (search->work->span.is_lost[i]) continue;
    way[i] = moved[i][0] > 0;
    if (moved[i][0] * search->force[i][0] > 0) continue;
    turned++;
    cost += search->turn_cost[i];
    gain += search->turn_gain[i];
  }
  if (turned == 0) return 1;
  if (cost >= SURE * gain) return 1;
  return were_known_ways(search, way);
}

/* Takes an answer and its forces for the best one. */
static void keep_best(start_search *search, const fl_outer_result *result, const fl_answer *answer,
                      real force[][2]) {
  search->best = *result;
  *search->answer = *answer;
  copy_forces(search->block, force, search->force);
  prepare_pruning(search);
}

/* Begins Newton's method at the forces to which a start has moved by the linear model, and keeps
   what comes out better. Returns whether the start is done with. */
static int is_done_by_newton(start_search *search, real moved[][2]) {
  fl_answer answer;
  fl_outer_result result;
  fl_question question = search->question;
  question.multipliers = search->answer->multipliers;
  const known_end best = {search->force, search->best.power};
  const int status = fl_newton_from(search->robot, search->block, search->work, &question, &best,
                                    moved, &answer, &result);
  search->steps_left -= result.steps;
  if (status == NEWTON_MET && is_better(&result, &search->best)) {
    keep_best(search, &result, &answer, moved);
  }
  return status != NEWTON_LEFT;
}

/* Moves all starts of a kind to the nearest forces that give the wrench, and keeps the cheapest.
   Returns an error code. */
static int try_starts(start_search *search, int is_reversed, int count, int followed,
                      tried_start *cheapest) {
  fl_question question = search->question;
  question.policy = 0;
  question.multipliers = 0;
  const fl_outer_limits limits = {.penalty_least = search->best.penalty};
  for (int k = 0; k < followed; k++) cheapest[k].merit = INFEASIBLE_COST;
  for (int start = 0; start < count; start++) {
    tried_start one;
    fl_outer_result result;
    forces_of_start(search, is_reversed, start, one.force);
    if (search->may_prune) {
      real moved[FL_MOST][2];
      move_by_linear_model(search, one.force, moved);
      if (is_pruned(search, moved) || is_done_by_newton(search, moved)) continue;
    }
    const int code = fl_outer_iterations(search->robot, search->block, search->work, &question,
                                         &limits, *one.force, 0, &result);
    if (code) return code;
    one.merit = result.power + result.penalty * result.error;
    keep_cheapest(search->block, &one, followed, cheapest);
  }
  return FL_OK;
}

/* Follows the cheapest starts of a kind, and keeps what comes out better; `is_cheaper` becomes
   whether that is so. Returns an error code. */
static int follow_cheapest(start_search *search, int is_reversed, int count, int followed,
                           int *is_cheaper) {
  const real power_before = search->best.power;
  tried_start cheapest[FOLLOWED_MOST];
  *is_cheaper = 0;
  int code = try_starts(search, is_reversed, count, followed, cheapest);
  for (int k = 0; k < followed && !code && search->steps_left > 0; k++) {
    if (!(cheapest[k].merit < INFEASIBLE_COST)) break;
    fl_answer answer;
    fl_outer_result result;
    const known_end best = {search->force, search->best.power};
    const known_end *known = 0;
    if (search->may_prune) known = &best;
    code = follow(search, known, cheapest[k].force, &answer, &result);
    if (code || !is_better(&result, &search->best)) continue;
    keep_best(search, &result, &answer, cheapest[k].force);
  }
  *is_cheaper = search->best.power < (1 - CHEAPER) * power_before;
  return code;
}

/* Begins anew with one force reversed, while that gains something, then with the other starts.
   Returns an error code. */
static int try_other_starts(start_search *search) {
  int is_cheaper = 1;
  for (int k = 0; k < OUTER_ROUNDS && is_cheaper; k++) {
    const int code =
        follow_cheapest(search, 1, COUNT(search->block), REVERSED_FOLLOWED, &is_cheaper);
    if (code) return code;
  }
  return follow_cheapest(search, 0, search->robot->start_count, OTHERS_FOLLOWED, &is_cheaper);
}

/* The answer by the laws alone: forces and multipliers at which the first iterations begin, and
   its power. Returns an error code. */
static int answer_by_laws(start_search *search, const fl_question *q, real *lambda, real *power) {
  const real *uncoupled = search->robot->block_uncoupled;
  fl_work *work = search->work;
  fl_answer *answer = search->answer;
  real unused[FL_MOST][2];
  fl_forget_span(work);
  const int code = fl_answer_one(uncoupled, work, q, answer);
  if (code) return code;
  memcpy(search->force_by_laws, answer->force, sizeof answer->force);
  memcpy(lambda, answer->multipliers, sizeof answer->multipliers);
  *power = fl_power_of_commands(uncoupled, work, answer->command, unused);
  return FL_OK;
}

/* The answer from the forces by the laws alone, by Newton's method where that comes to one. Returns
   an error code. */
static int find_first_answer(start_search *search) {
  copy_forces(search->block, search->force_by_laws, search->force);
  if (fl_has_lines_alone(search->robot->block_uncoupled)) {
    const int status = fl_newton_from(search->robot, search->block, search->work, &search->question,
                                      0, search->force, search->answer, &search->best);
    search->steps_left -= search->best.steps;
    if (status == NEWTON_MET) return FL_OK;
    copy_forces(search->block, search->force_by_laws, search->force);
  }
  return follow(search, 0, search->force, search->answer, &search->best);
}

/* The best answer to a question outside of ticks. Returns an error code. */
static int answer_from_all_starts(const fl_coupled_robot *robot, real *block, fl_work *work,
                                  const fl_question *q, fl_answer *answer,
                                  fl_outer_result *result) {
  start_search search;
  real lambda[6];
  real power_by_laws;
  search.robot = robot;
  search.block = block;
  search.work = work;
  search.question = *q;
  search.answer = answer;
  search.steps_left = (real)MOST_WORK / (real)COUNT(block);
  int code = answer_by_laws(&search, q, lambda, &power_by_laws);
  if (code) return code;
  search.question.multipliers = lambda;
  code = find_first_answer(&search);
  if (!code && search.best.power > (1 + CHEAPER) * power_by_laws) {
    search.known_count = 0;
    search.may_prune_lines = !robot->inflow && fl_has_lines_alone(robot->block_uncoupled);
    prepare_pruning(&search);
    code = try_other_starts(&search);
  }
  *result = search.best;
  return code;
}

int fl_answer_coupled(const fl_coupled_robot *robot, real *block, fl_work *work,
                      const fl_question *question, fl_answer *answer, fl_outer_result *result) {
  int code;
  if (question->previous) {
    const fl_outer_limits limits = {
        .penalty_least = 0, .most_steps = LARGEST_NUMBER, .most_iterations = ITERATIONS_IN_TICK};
    real force[FL_MOST][2];
    code = fl_outer_iterations(robot, block, work, question, &limits, *force, answer, result);
  } else {
    code = answer_from_all_starts(robot, block, work, question, answer, result);
  }
  if (!code) fl_serve_coupled(robot, block, work, question, answer, result);
  return code;
}
