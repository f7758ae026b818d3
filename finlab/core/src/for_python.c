/* What Python alone asks: fields and constants, many answers, commands of other methods, and what
   multipliers prove. */
#include "internal.h"

typedef struct {
  const char *name;
  int value;
} constant;

#define CONSTANT(name) {#name, name}
#define FL_BEGIN(type) {"sizeof " #type, (int)sizeof(type)},
#define FL_FIELD(type, name, shape, unit, meaning)
#define FL_END(type)
static const constant CONSTANTS[] = {
#include "fl_fields.h"
    {"sizeof fl_work", (int)sizeof(fl_work)},
    {"sizeof fl_real", (int)sizeof(fl_real)},
    CONSTANT(FL_MAGIC),
    CONSTANT(FL_VERSION),
    CONSTANT(FL_MOST),
    CONSTANT(FL_ARCS),
    CONSTANT(FL_BUSES),
    CONSTANT(FL_THRUSTER),
    CONSTANT(FL_POD),
    CONSTANT(FL_FIN),
    CONSTANT(FL_FOIL),
    CONSTANT(FL_STEERED),
    CONSTANT(FL_KINDS),
    CONSTANT(FL_DRAG),
    CONSTANT(FL_LIGHTHILL),
    CONSTANT(FL_SOFT),
    CONSTANT(FL_FIXED_PROPELLER),
    CONSTANT(FL_TURNING_PROPELLER),
    CONSTANT(FL_FORMULAS),
    CONSTANT(FL_CLOSEST),
    CONSTANT(FL_DIRECTION),
    CONSTANT(FL_PRIORITY),
    CONSTANT(FL_FALLING),
    CONSTANT(FL_POLICIES),
    CONSTANT(FL_OK),
    CONSTANT(FL_BAD_BLOCK),
    CONSTANT(FL_BAD_VERSION),
    CONSTANT(FL_BAD_NUMBER),
    CONSTANT(FL_BAD_ARGUMENT),
    CONSTANT(FL_OVER_BUDGET),
    CONSTANT(FL_UNFINISHED),
    CONSTANT(FL_BEYOND_REACH),
    CONSTANT(FL_MET),
    CONSTANT(FL_BEYOND),
    CONSTANT(FL_NO_PROGRESS),
};
#undef FL_BEGIN
#undef FL_FIELD
#undef FL_END

static int is_constant(int k) {
  return k >= 0 && k < (int)(sizeof CONSTANTS / sizeof CONSTANTS[0]);
}

const char *fl_constant_name(int k) {
  if (!is_constant(k)) return 0;
  return CONSTANTS[k].name;
}

int fl_constant_value(int k) {
  if (!is_constant(k)) return 0;
  return CONSTANTS[k].value;
}

#define TEXT_OF(x) #x
#define TEXT(x) TEXT_OF(x) /* [FL_MOST][2] as [64][2] */
#define FL_BEGIN(type) #type " "
#define FL_FIELD(type, name, shape, unit, meaning) #type " " #name TEXT(shape) ";"
#define FL_END(type) "\n"
const char *fl_fields(void) {
  return
#include "fl_fields.h"
      ;
}
#undef FL_BEGIN
#undef FL_FIELD
#undef FL_END

/* Writes an answer as a row of numbers; returns its commands. */
static real *write_row(const real *block, const fl_question *q, const fl_answer *out, real *row) {
  const size_t n = (size_t)COUNT(block);
  fl_answer_row *head = (fl_answer_row *)row;
  real *command = row + sizeof *head / sizeof *row;
  real *force = command + 3 * n;
  real *previous = force + 2 * n;
  head->error = out->error;
  head->gap_power_bound = out->gap_power_bound;
  head->is_attainable = (real)out->is_attainable;
  head->is_truncated = (real)out->is_truncated;
  head->is_tick = (real)(q->previous != 0);
  memcpy(head->wrench, q->wrench, sizeof q->wrench);
  memcpy(head->multipliers, out->multipliers, sizeof out->multipliers);
  memcpy(head->wrench_served, out->wrench_served, sizeof out->wrench_served);
  memcpy(command, out->command, 3 * n * sizeof *command);
  memcpy(force, out->force, 2 * n * sizeof *force);
  if (q->previous && q->previous != previous) {
    memcpy(previous, q->previous, 3 * n * sizeof *previous);
  }
  return command;
}

/* Makes the commands (n, 3) of lost actuators NaN. */
static void mark_lost(const real *block, const fl_work *work, const fl_question *question,
                      real *command) {
  for (int i = 0; question->lost && i < COUNT(block); i++) {
    if (!work->span.is_lost[i]) continue;
    for (int k = 0; k < 3; k++) command[3 * i + k] = (real)NAN;
  }
}

/* Whether an answer in place of a wrench beyond reach gives a share of it. */
static int is_on_ray(const real *block, const fl_work *work, const real *wrench,
                     const fl_answer *out) {
  const real *sigma = HEAD(block)->wrench_scale;
  real ray[6];
  real served[6];
  for (int k = 0; k < 6; k++) {
    ray[k] = 0;
    if (work->span.axis_counts[k]) ray[k] = wrench[k] / sigma[k];
    served[k] = out->wrench_served[k] / sigma[k];
  }
  const real share = dot(served, ray, 6) / larger(dot(ray, ray, 6), TINY);
  for (int k = 0; k < 6; k++) {
    if (!(FABS(served[k] - share * ray[k]) <= NEARLY)) return 0;
  }
  return out->error <= NEARLY;
}

/* Whether nothing is left to do for a wrench beyond reach. */
static int is_best_beyond_reach(const real *block, const fl_work *work, const fl_question *q,
                                const fl_answer *out) {
  if (!q->policy || q->policy->kind != FL_DIRECTION) return 1;
  /* In a tick what the rates leave is the nearest to the ray, Eq. 15. */
  return q->previous || is_on_ray(block, work, q->wrench, out);
}

int fl_answer_into_row(const real *block, fl_work *work, const fl_question *question,
                       real most_error, real *row) {
  fl_answer out;
  const int code = fl_answer_one(block, work, question, &out);
  if (code) return code;
  real *command = write_row(block, question, &out, row);
  if (out.is_truncated || out.exceeds_budget || !(most_error >= 0)) return FL_UNFINISHED;
  if (out.is_attainable && !(out.error <= most_error)) return FL_UNFINISHED;
  if (!out.is_attainable && !is_best_beyond_reach(block, work, question, &out)) {
    return FL_UNFINISHED;
  }
  mark_lost(block, work, question, command);
  return out.is_attainable ? FL_OK : FL_BEYOND_REACH;
}

int fl_answer_coupled_into_row(const fl_coupled_robot *robot, real *block, fl_work *work,
                               const fl_question *question, real most_error, real *row) {
  fl_answer out;
  fl_outer_result result;
  const int code = fl_answer_coupled(robot, block, work, question, &out, &result);
  if (code) return code;
  out.gap_power_bound = 0;
  real *command = write_row(block, question, &out, row);
  const int is_met = out.is_attainable && out.error <= most_error;
  if (!(most_error >= 0) || (out.is_attainable && !is_met)) return FL_UNFINISHED;
  mark_lost(block, work, question, command);
  return is_met ? FL_OK : FL_BEYOND_REACH;
}

int fl_answer_coupled_many(const fl_coupled_robot *robot, real *block, fl_work *work,
                           const fl_question *question, const real *wrench, int count, real *force,
                           real *multipliers, real *wrench_served, real *command,
                           fl_byte *is_attainable, real *error, fl_byte *is_truncated) {
  const answer_arrays answers = {force,         multipliers, wrench_served, command,
                                 is_attainable, error,       is_truncated};
  fl_question q = *question;
  fl_answer out;
  fl_outer_result result;
  for (int k = 0; k < count; k++) {
    memcpy(q.wrench, wrench + 6 * k, sizeof q.wrench);
    const int code = fl_answer_coupled(robot, block, work, &q, &out, &result);
    if (code) return code;
    write_answer_of(block, &out, k, &answers);
  }
  return FL_OK;
}

real fl_dual_value(const real *block, fl_work *work, const real *wrench, const real *lambda_reduced,
                   real *force) {
  fl_state *state = work->state;
  real target_reduced[6];
  fl_reduce_wrench(work, wrench, target_reduced);
  fl_dual_at(block, work, target_reduced, lambda_reduced, state);
  memcpy(force, state->force, (size_t)COUNT(block) * sizeof state->force[0]);
  return state->dual_value;
}

/* The error of a table in `margins` of fl_conjugates: by how much the conjugate of the law may be
   above that of the table at a price v [W/N]. */
static real margin_at(const real *margin, real v) {
  const real price_max = margin[0];
  const int cells = (int)margin[1];
  const int cells_beyond = (int)margin[2];
  const real force_error = margin[3];
  const real *within = margin + 4;
  const real *beyond = within + cells;
  if (!(v > 0)) return within[0] - v * force_error;
  if (v < price_max) {
    const int cell = (int)((real)cells * SQRT(SQRT(v / price_max)));
    if (cell < cells) return within[cell];
    return within[cells - 1];
  }
  const real position = (real)cells_beyond * (1 - price_max / v);
  int cell = (int)position;
  if (cell >= cells_beyond) cell = cells_beyond - 1;
  const real t = position - (real)cell;
  return v * (beyond[cell] + t * (beyond[cell + 1] - beyond[cell]));
}

/* Power of a force F by a power law c |F|^e, as `margins` of fl_conjugates have it [W]. */
static real power_by_law(const real *law, real force) {
  real c = law[1];
  if (force < 0) c = law[2];
  const real e = law[3];
  return c * POW(FABS(force), e);
}

/* Conjugate max v F - P(F) of that law over the forces between two, at a price v (Eq. 4). */
static real conjugate_by_law(const real *law, real v, real low, real high) {
  real c = law[1];
  if (v < 0) c = law[2];
  const real e = law[3];
  real force = POW(FABS(v) / (e * c), 1 / (e - 1)); /* where e c F^(e - 1) = |v| */
  if (v < 0) force = -force;
  force = clipped(force, low, high);
  return v * force - power_by_law(law, force);
}

/* The same of a propeller at its prices, within the limits of its set. */
static real conjugate_of_propeller(const fl_actuator *a, const real *law,
                                   const fl_actuator_conjugate *prices) {
  const real low = prices->force_min;
  const real high = prices->force_max;
  if (!is_plane(a)) {
    const real v = a->command_sign * prices->price_ahead;
    if (a->command_sign > 0) return conjugate_by_law(law, v, low, high);
    return conjugate_by_law(law, v, -high, -low);
  }
  const real ahead = conjugate_by_law(law, prices->price_ahead, larger(low, 0), larger(high, 0));
  if (low >= 0) return ahead;
  const real astern =
      conjugate_by_law(law, -prices->price_reverse, smaller(low, 0), smaller(high, 0));
  if (high < 0) return astern;
  return larger(ahead, astern);
}

/* The conjugate of one actuator's cost at its prices s (Eq. 4), over all that it may give now; with
   a margin an upper bound of that of its law, over all that its limits ever allow. */
static fl_actuator_conjugate conjugate_at(const real *block, int i, const fl_set *set,
                                          const real *s, const real *margin) {
  wide unused[2];
  const real along_force = fl_support_of_set(block, i, set, s, unused, 0);
  fl_actuator_conjugate result = {0};
  if (set->is_flipped) {
    result.price_reverse = along_force;
    result.force_min = -set->force_max;
    result.force_max = -set->force_min;
  } else {
    result.price_ahead = along_force;
    result.force_min = set->force_min;
    result.force_max = set->force_max;
  }
  if (set->force_max_reverse > 0) {
    const fl_set back = fl_reversed_set(set);
    result.price_reverse = fl_support_of_set(block, i, &back, s, unused, 0);
    result.force_min = -set->force_max_reverse;
  }
  if (!margin) {
    result.conjugate = fl_response(block, i, set, s).conjugate;
    return result;
  }
  const fl_actuator *a = ACTUATOR(block, i);
  if (margin[0] < 0) {
    result.conjugate = conjugate_of_propeller(a, margin, &result);
    return result;
  }
  const line_response y = fl_unlimited_response(block, a, along_force);
  const real v = along_force * a->force_scale / a->power_scale; /* price of the table */
  result.conjugate = y.conjugate + a->power_scale * margin_at(margin, v);
  return result;
}

int fl_conjugates(const real *block, fl_work *work, const fl_question *question,
                  const real *multipliers, int count, const real *const *margins,
                  fl_actuator_conjugate *conjugates) {
  fl_question q = *question;
  q.calm = 0; /* turning is no power */
  if (!fl_prepare_question(block, work, &q)) return FL_BAD_NUMBER;
  for (int k = 0; k < count; k++) {
    real lambda[6];
    fl_reduce_lambda(work, multipliers + 6 * k, lambda);
    for (int i = 0; i < COUNT(block); i++) {
      real s[2];
      actuator_price(work, i, lambda, s);
      conjugates[k * COUNT(block) + i] = conjugate_at(block, i, work->set + i, s, margins[i]);
    }
  }
  return FL_OK;
}

int fl_dual_points(const real *block, fl_work *work, const fl_question *question,
                   const real *wrench, int count, int most_steps, real *multipliers, int *steps,
                   real *residual, real *dual_value, real *force, real *slope) {
  fl_question q = *question;
  if (!fl_prepare_question(block, work, &q)) return FL_BAD_NUMBER;
  const fl_span *span = &work->span;
  const size_t n = (size_t)COUNT(block);
  for (int k = 0; k < count; k++) {
    real of_forces[6];
    real target_reduced[6];
    real lambda[6];
    for (int j = 0; j < 6; j++) {
      of_forces[j] = 0;
      if (span->axis_counts[j]) of_forces[j] = wrench[6 * k + j] - span->wrench_offset[j];
    }
    fl_reduce_wrench(work, of_forces, target_reduced);
    if (!fl_are_within(target_reduced, 6, LARGEST_NUMBER)) return FL_BAD_ARGUMENT;
    work->newton_steps = 0;
    if (isnan(multipliers[6 * k])) {
      fl_dual_newton(block, work, target_reduced, 0, most_steps);
    } else {
      fl_reduce_lambda(work, multipliers + 6 * k, lambda);
      if (!fl_are_within(lambda, 6, LARGEST_NUMBER)) return FL_BAD_ARGUMENT;
      fl_dual_newton(block, work, target_reduced, lambda, most_steps);
    }
    steps[k] = work->newton_steps;
    const fl_state *found = work->state_found;
    for (int j = 0; j < 6; j++) {
      multipliers[6 * k + j] = dot(span->basis[j], found->lambda_reduced, 6) / span->axis_scale[j];
      residual[6 * k + j] = dot(span->basis[j], found->residual, 6) * span->axis_scale[j];
    }
    dual_value[k] = found->dual_value;
    memcpy(force + 2 * n * (size_t)k, found->force, 2 * n * sizeof *force);
    memcpy(slope + 3 * n * (size_t)k, found->dy_ds, 3 * n * sizeof *slope);
  }
  return FL_OK;
}

void fl_forces_of_commands(const real *block, const real *command, int count, real *force) {
  const int n = COUNT(block);
  for (int k = 0; k < count * n; k++) {
    const int i = k % n;
    const real *own_command = command + 3 * k;
    real *own_force = force + 3 * k;
    fl_force_of_command(block, i, own_command, own_force, 0);
    if (fl_is_in_dead_band(ACTUATOR(block, i), own_command)) {
      memset(own_force, 0, 3 * sizeof *own_force);
    }
  }
}

/* g(lambda) of Eq. 3 at multipliers (6,) for a wrench, with margins, less what its sums may be off
   by. */
static real certified_dual_value(const real *block, fl_work *work, const real *multipliers,
                                 const real *wrench, const real *const *margins) {
  const fl_span *span = &work->span;
  real paid = 0;
  real size = 0; /* of all that is summed [W] */
  for (int k = 0; k < 6; k++) {
    const real part = multipliers[k] * (wrench[k] - span->wrench_offset[k]);
    paid += part;
    size += FABS(part);
  }
  real lambda[6];
  fl_reduce_lambda(work, multipliers, lambda);
  real conjugates = 0;
  for (int i = 0; i < COUNT(block); i++) {
    if (span->is_lost[i]) continue;
    real s[2];
    actuator_price(work, i, lambda, s);
    const real conjugate = conjugate_at(block, i, work->set + i, s, margins[i]).conjugate;
    conjugates += conjugate;
    size += FABS(conjugate);
  }
  return paid - conjugates - ROUNDING * size;
}

int fl_power_bounds(const real *block, fl_work *work, const fl_question *question,
                    const real *multipliers, const real *wrench, int count,
                    const real *const *margins, real *bound) {
  fl_question q = *question;
  q.calm = 0; /* turning is no power */
  if (!fl_prepare_question(block, work, &q)) return FL_BAD_NUMBER;
  static const real zero[6] = {0};
  const real at_rest = certified_dual_value(block, work, zero, zero, margins);
  for (int k = 0; k < count; k++) {
    const real value =
        certified_dual_value(block, work, multipliers + 6 * k, wrench + 6 * k, margins);
    bound[k] = larger(at_rest, 0);
    if (value > bound[k] && value < LARGEST_NUMBER) bound[k] = value; /* not of NaN */
  }
  return FL_OK;
}

real fl_power_bound_of_row(const fl_prepared_call *call, const fl_formula *laws,
                           const real *effectiveness, const real *const *margins, const real *row) {
  const real not_here = -1;
  fl_answer_row head;
  memcpy(&head, row, sizeof head);
  if (*call->is_busy || head.gap_power_bound != 0) return not_here;
  const int n = COUNT(call->block);
  const real *command = row + sizeof head / sizeof *row;
  real wrench[6];
  if (fl_wrench_of_command(laws, n, effectiveness, command, wrench) != FL_OK) return not_here;

  fl_question question = *call->question;
  if (head.is_tick != 0) question.previous = command + 5 * (size_t)n;
  for (int k = 0; question.free && k < 6; k++) {
    if (question.free[k]) wrench[k] = 0; /* its multiplier is 0 */
  }
  real bound;
  const int code = fl_power_bounds(call->block, call->work, &question, head.multipliers, wrench, 1,
                                   margins, &bound);
  if (code != FL_OK) return not_here;
  return bound;
}

void fl_commands(const real *block, fl_work *work, const real *force, int count,
                 const real *previous, real *command) {
  const int n = COUNT(block);
  fl_limits_without_tick(block, work);
  for (int k = 0; k < count; k++) {
    real(*forces)[2] = (real(*)[2])(force + 2 * n * k);
    real(*commands)[3] = (real(*)[3])(command + 3 * n * k);
    fl_commands_for_forces(block, &work->box, forces, previous, commands);
  }
}
