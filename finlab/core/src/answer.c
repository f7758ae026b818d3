/* One target after the other: commands of least power where it is within what may be given now,
   else for what a policy gives in its place.

   Forces come first (`fl_find_forces`), by the dual; then commands for the forces; then steps on
   the commands, which make up for what the tables of forces leave. */
#include "internal.h"

#define LARGEST R(1e12) /* wrench, price or command of a question */
#define MOST_CALM 1000
#define CALM_STEPS 10       /* halves of the range of what turning costs, to keep a budget */
#define OVER_BUDGET NOTHING /* share by which an answer may exceed a budget: rounding */
#define SHORT_OF_BUDGET (NEARLY / 2) /* share that a bus that binds may leave of its budget */
#define AIM_BELOW (NEARLY / 10)      /* by which share less than a budget is aimed at */
#define LEAST_SLOPE R(0.2) /* of powers by the laws over those by tables, both as logarithms */
#define STEPS_BY_LAWS 12   /* on commands, to a wrench a little beyond the tables */
/* Error over the wrench scale, beyond reach, up to which the laws may yet meet the target. */
#define BEYOND_TABLES (10 * CLOSE)
/* Error over the wrench scale up to which a wrench counts as reached. */
#define REACHED R(1e-3)

int fl_version(void) { return FL_VERSION; }

/* An answer before anything is known: no forces. */
static void begin_answer(const real *block, const real *wrench, fl_answer *out) {
  out->gap_power_bound = 0;
  out->newton_status = FL_MET;
  out->has_foil_commands = 0;
  out->exceeds_budget = 0;
  memset(out->lambda_reduced, 0, sizeof out->lambda_reduced);
  memset(out->multipliers, 0, sizeof out->multipliers);
  memset(out->force, 0, (size_t)COUNT(block) * sizeof out->force[0]);
  memcpy(out->wrench_served, wrench, sizeof out->wrench_served);
}

/* Where nothing pushes, such as foils at rest: only no wrench is within reach. */
static void answer_without_forces(const real *wrench, fl_answer *out) {
  out->is_attainable = 1;
  for (int k = 0; k < 6; k++) {
    if (wrench[k] != 0) out->is_attainable = 0;
    out->wrench_served[k] = 0;
  }
}

/* Brings forces that may lie in gaps of their sets out of these, where the target is within reach
   of the convex hulls; returns whether it is within reach of the sets. */
static int leave_gaps(const real *block, fl_work *work, const real *target_reduced, int status,
                      int within, fl_answer *out) {
  const int is_in_gap = fl_worst_gap(block, work, out->force, out->lambda_reduced) >= 0;
  if (!within || !is_in_gap) return within && status == FL_MET;
  real bound;
  if (!fl_search_gaps(block, work, target_reduced, status, &bound)) return 0;
  copy_forces(block, work->best_force, out->force);
  out->gap_power_bound = fl_gap_power_bound(work, bound);
  return 1;
}

/* What of a wrench the forces have to give: all but the wrench beside them. */
static void take_off_offset(const fl_span *span, const real *wrench, real *of_forces) {
  for (int k = 0; k < 6; k++) of_forces[k] = wrench[k] - span->wrench_offset[k];
}

/* Forces for a wrench that the commands are to give [N, N m]; `lambda` are reduced multipliers to
   begin with [W], 0 for none. Out of reach a policy, where there is one, gives another wrench in
   its place: `out->wrench_served`, here without the wrench beside the forces. */
void fl_find_forces(const real *block, fl_work *work, const real *wrench_wanted,
                    const fl_policy *policy, const real *lambda, fl_answer *out) {
  const fl_span *span = &work->span;
  real wrench[6];
  real target_reduced[6];
  take_off_offset(span, wrench_wanted, wrench);
  begin_answer(block, wrench, out);
  fl_reduce_wrench(work, wrench, target_reduced);
  if (span->rank == 0) {
    answer_without_forces(wrench, out);
    return;
  }
  const int has_kinks = work->has_forks || work->has_drag || work->has_turn_cost;
  const int is_in_range = fl_is_in_range(work, wrench, target_reduced);
  int most_steps = FL_STEPS;
  if (has_kinks) most_steps = FL_STEPS_AT_KINK;
  const int status = fl_dual_newton(block, work, target_reduced, lambda, most_steps);
  const int may_be_met = status == FL_MET || (status == FL_NO_PROGRESS && has_kinks);
  int within = may_be_met && is_in_range;
  out->newton_status = status;
  memcpy(out->lambda_reduced, work->state_found->lambda_reduced, sizeof out->lambda_reduced);
  copy_forces(block, work->state_found->force, out->force);
  if (work->has_drag) {
    within = is_in_range &&
             fl_answer_with_drag(block, work, wrench_wanted, target_reduced, status, out);
    if (within) copy_forces(block, work->best_force, out->force);
  } else if (fl_may_have_gaps(block, work, out->force)) {
    within = leave_gaps(block, work, target_reduced, status, within, out);
  }
  out->is_attainable = within;
  if (!within && policy) {
    out->has_foil_commands = 0;
    fl_out_of_reach(block, work, wrench, policy, out);
  }
}

/* Multipliers of the wrench of those in the basis. */
static void find_multipliers(const fl_span *span, fl_answer *out) {
  for (int k = 0; k < 6; k++) {
    out->multipliers[k] = dot(span->basis[k], out->lambda_reduced, span->rank) /
                          span->axis_scale[k];
  }
}

#if FL_KEEPS_BUDGETS
/* Finds forces where turning costs so much; returns whether they take more power than their buses
   have. */
static int exceeds_at_calm(const real *block, fl_work *work, const fl_question *q, real calm,
                           const real *wrench_desired, fl_answer *out) {
  fl_question calmer = *q;
  calmer.calm = calm;
  fl_limits_of_tick(block, work, &calmer);
  fl_find_forces(block, work, wrench_desired, q->policy, 0, out);
  return fl_exceeds_budget(block, work, q->budget, out->force);
}

/* Turns more freely where that brings buses within their budgets: as calmly as they allow. Returns
   whether it does; else turning costs nothing. */
static int turn_within_budget(const real *block, fl_work *work, const fl_question *q,
                              const real *wrench_desired, fl_answer *out) {
  real low = 0;
  real high = 1; /* shares of what turning costs */
  if (exceeds_at_calm(block, work, q, 0, wrench_desired, out)) return 0;
  for (int k = 0; k < CALM_STEPS; k++) {
    const real share = (low + high) / 2;
    if (exceeds_at_calm(block, work, q, share * q->calm, wrench_desired, out)) {
      high = share;
    } else {
      low = share;
    }
  }
  exceeds_at_calm(block, work, q, low * q->calm, wrench_desired, out);
  return 1;
}

/* Finds other forces where these take more power than their buses have; returns whether they do. */
static int keep_budget(const real *block, fl_work *work, const fl_question *q,
                       const real *wrench_desired, fl_answer *out) {
  memset(work->bus_binds, 0, sizeof work->bus_binds);
  if (!fl_exceeds_budget(block, work, q->budget, out->force)) return 0;
  if (work->has_turn_cost && turn_within_budget(block, work, q, wrench_desired, out)) return 1;
  real wrench[6];
  take_off_offset(&work->span, wrench_desired, wrench);
  out->exceeds_budget = !fl_keep_budget(block, work, wrench, q->policy, q->budget, out);
  return 1;
}
#endif

/* Reduced multipliers to begin with [W]: those of a question, which go to `lambda`, or those of the
   commands before in a tick; 0 where there are none, or none of use. */
static const real *first_multipliers(const fl_work *work, const fl_question *q, real *lambda) {
  if (q->multipliers) {
    fl_reduce_lambda(work, q->multipliers, lambda);
    if (fl_are_within(lambda, 6, LARGEST)) return lambda;
    return 0;
  }
  if (work->has_lambda_begin) return work->lambda_begin;
  return 0;
}

/* The wrench [N, N m] that a question asks for, 0 in axes that do not count. */
static void wrench_that_counts(const fl_span *span, const fl_question *q, real *wrench) {
  for (int k = 0; k < 6; k++) {
    wrench[k] = 0;
    if (span->axis_counts[k]) wrench[k] = q->wrench[k];
  }
}

/* Error over the wrench scale of what an answer serves. */
static real error_of_served(const real *block, const real *wrench_desired, const fl_answer *out) {
  const real *sigma = HEAD(block)->wrench_scale;
  real missing[6];
  for (int k = 0; k < 6; k++) missing[k] = (out->wrench_served[k] - wrench_desired[k]) / sigma[k];
  return SQRT(dot(missing, missing, 6));
}

/* Meets a wrench a little beyond what the tables give by steps on commands: the last share of a
   force has no price that a table could hold. */
static void meet_by_laws(const real *block, fl_work *work, const real *wrench_desired,
                         fl_answer *out) {
  if (out->is_attainable || error_of_served(block, wrench_desired, out) > BEYOND_TABLES) return;
  real command[FL_MOST][3];
  copy_commands(block, out->command, command);
  const real error =
      fl_refine_commands(block, work, &work->box, wrench_desired, command, STEPS_BY_LAWS);
  if (error > NEARLY) return;
  copy_commands(block, command, out->command);
  memcpy(out->wrench_served, wrench_desired, sizeof out->wrench_served);
  out->is_attainable = 1;
  out->gap_power_bound = 0;
  out->error = error;
}

/* Whether an error over the wrench scale is one for which idle actuators turn, where any turn. */
int fl_is_missed(real error) { return FL_AIMS && error > REACHED; }

/* Finds commands for the forces of an answer. */
static void find_commands(const real *block, fl_work *work, const fl_question *q,
                          const real *wrench_desired, int is_budget_used_up, fl_answer *out) {
  const fl_span *span = &work->span;
  find_multipliers(span, out);
  for (int k = 0; k < 6; k++) {
    if (out->is_attainable) {
      out->wrench_served[k] = wrench_desired[k];
    } else {
      out->wrench_served[k] += span->wrench_offset[k];
    }
  }
  if (!out->has_foil_commands) {
    fl_commands_for_forces(block, &work->box, out->force, q->previous, out->command);
    fl_leave_dead_bands(block, out->force, out->command);
  }
  const int steps = work->settings.command_steps;
  out->error = fl_refine_commands(block, work, &work->box, out->wrench_served, out->command, steps);
  if (!is_budget_used_up) meet_by_laws(block, work, wrench_desired, out);
  fl_rest_in_dead_bands(block, &work->box, out->command);
  const int has_missed = !out->is_attainable &&
                         fl_is_missed(error_of_served(block, wrench_desired, out));
  if (q->previous && fl_may_give_later(block, work, has_missed, out->command)) {
    fl_prepare_idle(block, work, q, wrench_desired, out->command);
  }
  fl_clip_commands(block, &work->box, out->command);
}

#if FL_KEEPS_BUDGETS
/* Powers of the buses by the laws at the commands of an answer, over what they have. */
static void find_shares(const real *block, const fl_work *work, const fl_budget *budget,
                        const fl_answer *out, real *share) {
  real power[FL_BUSES + 1] = {0};
  for (int i = 0; i < COUNT(block); i++) {
    if (!work->span.is_lost[i])
      power[budget->bus_of[i]] += work->law_power(work, i, out->command[i]);
  }
  for (int b = 0; b < budget->buses; b++) share[b] = power[b + 1] / budget->watts[b];
}

/* Changes what buses are asked to take by tables, so that by the laws they take what they have, and
   returns 1; 0 where they do already. `log_share` and `log_asked` are of the try before. */
static int correct_budget(const fl_work *work, const fl_budget *budget, const real *share,
                          int tries, real *log_share, real *log_asked, fl_budget *asked) {
  int is_kept = 1;
  for (int b = 0; b < budget->buses; b++) {
    const real y = LOG(larger(share[b], TINY));
    const real x = LOG(asked->watts[b] / budget->watts[b]);
    const int is_short = work->bus_binds[b] && y < -SHORT_OF_BUDGET;
    const real last_log_share = log_share[b];
    real slope = 1;
    if (tries > 0 && FABS(x - log_asked[b]) > ROUNDING) {
      slope = clipped((y - log_share[b]) / (x - log_asked[b]), LEAST_SLOPE, 1 / LEAST_SLOPE);
    }
    log_share[b] = y;
    log_asked[b] = x;
    const int is_stuck = tries > 0 && y == last_log_share;
    if ((y <= OVER_BUDGET && !is_short) || is_stuck) continue;
    is_kept = 0;
    asked->watts[b] *= EXP(-(y + AIM_BELOW) / slope);
  }
  return !is_kept;
}

/* Answers within a budget, from the answer without: by the laws where these are known, which may
   take a little more or less than the tables say. */
static void answer_within_budget(const real *block, fl_work *work, const fl_question *q,
                                 const real *wrench_desired, fl_answer *out) {
  fl_question asked_question = *q;
  fl_budget asked = *q->budget;
  const int has_laws = work->law_power != 0;
  real share[FL_BUSES];
  real log_share[FL_BUSES] = {0};
  real log_asked[FL_BUSES] = {0};
  if (has_laws && fl_exceeds_budget(block, work, q->budget, out->force)) {
    for (int b = 0; b < asked.buses; b++) asked.watts[b] *= 1 - AIM_BELOW;
  }
  fl_answer without = *out;
  work->budget_begins = 0;
  asked_question.budget = &asked;
  for (int tries = 0;; tries++) {
    const int is_used_up = keep_budget(block, work, &asked_question, wrench_desired, out);
    find_commands(block, work, q, wrench_desired, is_used_up, out);
    if (!has_laws) return;
    find_shares(block, work, q->budget, out, share);
    if (!correct_budget(work, q->budget, share, tries, log_share, log_asked, &asked)) break;
    if (tries == FL_BUDGET_TRIES - 1) break;
    *out = without;
    if (q->previous) fl_limits_of_tick(block, work, q);
  }
  out->exceeds_budget = 0;
  for (int b = 0; b < q->budget->buses; b++) out->exceeds_budget |= share[b] > 1 + OVER_BUDGET;
}
#endif

/* Answers a question for which the work area is prepared. */
static void answer_question(const real *block, fl_work *work, const fl_question *q,
                            fl_answer *out) {
  real wrench_desired[6];
  real lambda[6];
  wrench_that_counts(&work->span, q, wrench_desired);
  work->newton_steps = 0;
  work->is_truncated = 0;
  work->command_previous = q->previous;
  fl_find_forces(block, work, wrench_desired, q->policy, first_multipliers(work, q, lambda), out);
#if FL_KEEPS_BUDGETS
  if (q->budget) {
    answer_within_budget(block, work, q, wrench_desired, out);
  } else {
    find_commands(block, work, q, wrench_desired, 0, out);
  }
#else
  find_commands(block, work, q, wrench_desired, 0, out);
#endif
  out->newton_steps = work->newton_steps;
  out->is_truncated = work->is_truncated;
}

static int is_valid_policy(const fl_policy *p) {
  if (p->kind < FL_CLOSEST || p->kind >= FL_POLICIES) return 0;
  if (p->kind == FL_PRIORITY && (p->group_count < 0 || p->group_count > 6)) return 0;
#ifdef FL_WITH_FALLING
  if (p->kind == FL_FALLING && p->group_count != 1) return 0;
#else
  if (p->kind == FL_FALLING) return 0;
#endif
  if (p->kind == FL_CLOSEST && !fl_are_within(p->axis_weight, 6, 1)) return 0;
  return 1;
}

/* Whether (count,) values are no larger than can be answered; NaN is one that is not known. */
static int are_small_or_unknown(const real *values, int count) {
  for (int k = 0; k < count; k++) {
    if (FABS(values[k]) > LARGEST) return 0;
  }
  return 1;
}

/* Whether budgets are ones that are kept: power is that of the actuators alone, no drag. */
static int is_valid_budget(const real *block, const fl_budget *budget) {
  if (!FL_KEEPS_BUDGETS) return 0;
  if (budget->buses < 1 || budget->buses > FL_BUSES) return 0;
  for (int b = 0; b < budget->buses; b++) {
    if (!(budget->watts[b] > 0 && budget->watts[b] <= LARGEST)) return 0;
  }
  for (int i = 0; i < COUNT(block); i++) {
    if (budget->bus_of[i] > budget->buses || is_foil(ACTUATOR(block, i))) return 0;
  }
  return 1;
}

static int is_valid_question(const real *block, const fl_question *q) {
  const int n = COUNT(block);
  if (!fl_are_within(q->wrench, 6, LARGEST)) return 0;
  if (!(q->calm >= 0 && q->calm <= MOST_CALM)) return 0;
  if (q->ticks < 0) return 0;
  if (q->policy && !is_valid_policy(q->policy)) return 0;
  if (q->budget && !is_valid_budget(block, q->budget)) return 0;
  if (q->budget && q->policy && q->policy->kind == FL_FALLING) return 0;
  if (q->previous && !are_small_or_unknown(q->previous, 3 * n)) return 0;
  if (q->angles_wanted && !are_small_or_unknown(q->angles_wanted, n)) return 0;
  return 1;
}

int fl_answer_one(const real *block, fl_work *work, const fl_question *q, fl_answer *out) {
  if (!is_valid_question(block, q)) return FL_BAD_ARGUMENT;
  if (!fl_prepare_question(block, work, q)) return FL_BAD_NUMBER;
  answer_question(block, work, q, out);
  if (!fl_are_within(out->wrench_served, 6, LARGEST_NUMBER)) return FL_BAD_NUMBER;
  if (!fl_are_within(&out->error, 1, LARGEST_NUMBER)) return FL_BAD_NUMBER;
  return FL_OK;
}
