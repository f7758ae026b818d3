/* What Python alone asks: sizes, many answers, commands of other methods, and what prices prove. */
#include "internal.h"

int fl_sizes(int which) {
  const int sizes[] = {sizeof(real), sizeof(fl_head), sizeof(fl_actuator), sizeof(fl_work),
                       sizeof(fl_policy), sizeof(fl_answer), FL_MOST};
  const int count = (int)(sizeof sizes / sizeof *sizes);
  if (which < 0 || which >= count) return 0;
  return sizes[which];
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

/* Answers to wrenches (count, 6), all else as of a question: forces (count, n, 2), prices
   and aims (count, 6), values, commands (count, n, 3), within reach, errors; -1 where a
   search ended at its bound of steps. */
int fl_answer_many(const real *block, fl_work *work, const fl_question *question,
                   const real *wrench, int count, real *force, real *price, real *aim, real *value,
                   real *command, unsigned char *within, real *error) {
  const size_t n = (size_t)COUNT(block);
  int ended = 0;
  fl_question q = *question;
  fl_answer out;
  for (int k = 0; k < count; k++) {
    memcpy(q.wrench, wrench, sizeof q.wrench);
    const int code = fl_answer_one(block, work, &q, &out);
    if (code) return code;
    memcpy(force, out.force, 2 * n * sizeof *force);
    memcpy(price, out.prices, sizeof out.prices);
    memcpy(aim, out.wrench_served, sizeof out.wrench_served);
    memcpy(command, out.command, 3 * n * sizeof *command);
    wrench += 6;
    force += 2 * n;
    price += 6;
    aim += 6;
    command += 3 * n;
    value[k] = out.gap_power_bound;
    within[k] = (unsigned char)out.is_attainable;
    error[k] = out.error;
    ended |= out.is_truncated;
  }
  if (ended) return -1;
  return FL_OK;
}

/* The dual at multipliers in reduced coordinates (6,) [W]: responses (n, 2), and the dual
   value for a wrench. */
real fl_look(const real *block, fl_work *work, const real *wrench, const real *inner, real *force) {
  fl_state *state = work->state;
  real target[6];
  fl_reduce_wrench(work, wrench, target);
  fl_dual_at(block, work, target, inner, state);
  memcpy(force, state->force, (size_t)COUNT(block) * sizeof state->force[0]);
  return state->dual_value;
}

/* What one actuator's force is worth at its prices s, of all that it may give now. */
static fl_actuator_worth worth_at(const real *block, int i, const fl_set *set, const real *s) {
  wide unused[2];
  const real along_force = fl_support_of_set(block, i, set, s, unused);
  fl_actuator_worth worth = {0};
  if (set->is_flipped) {
    worth.price_reverse = along_force;
    worth.force_min = -set->force_max;
    worth.force_max = -set->force_min;
  } else {
    worth.price_ahead = along_force;
    worth.force_min = set->force_min;
    worth.force_max = set->force_max;
  }
  if (set->force_max_reverse > 0) {
    const fl_set back = fl_reversed_set(set);
    worth.price_reverse = fl_support_of_set(block, i, &back, s, unused);
    worth.force_min = -set->force_max_reverse;
  }
  worth.conjugate = fl_response(block, i, set, s).conjugate;
  return worth;
}

int fl_worth(const real *block, fl_work *work, const fl_question *question, const real *price,
             int count, fl_actuator_worth *worth) {
  fl_question calm = *question;
  calm.calm = 0; /* turning is no power */
  if (!fl_prepare_question(block, work, &calm)) return FL_BAD_NUMBER;
  for (int k = 0; k < count; k++) {
    real lambda[6];
    fl_reduce_lambda(work, price + 6 * k, lambda);
    for (int i = 0; i < COUNT(block); i++) {
      real s[2];
      actuator_price(work, i, lambda, s);
      *worth = worth_at(block, i, work->set + i, s);
      worth++;
    }
  }
  return FL_OK;
}

/* Commands (count, n, 3) for forces (count, n, 2); angles without a force keep those of
   previous ones (n, 3). */
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
