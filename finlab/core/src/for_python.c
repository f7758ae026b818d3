/* What Python alone asks: sizes, many answers, commands of other methods, and what prices prove. */
#include "internal.h"

int fl_sizes(int which) {
  const int sizes[] = {sizeof(real), sizeof(fl_head), sizeof(fl_actuator), sizeof(fl_work),
                       sizeof(fl_policy), sizeof(fl_answer), FL_MOST};
  return which >= 0 && which < (int)(sizeof sizes / sizeof *sizes) ? sizes[which] : 0;
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

/* Answers to wrenches (count, 6), all else as of a question: forces (count, n, 2), prices and aims (count, 6), values,
   commands (count, n, 3), within reach, errors; -1 where a search ended at its bound of steps. */
int fl_answer_many(const real *block, fl_work *work, const fl_question *question, const real *wrench, int count,
                   real *force, real *price, real *aim, real *value, real *command, unsigned char *within,
                   real *error) {
  const int n = COUNT(block);
  int ended = 0;
  fl_question q = *question;
  fl_answer out;
  for (int k = 0; k < count; k++) {
    memcpy(q.wrench, wrench + 6 * k, sizeof q.wrench);
    const int code = fl_answer_one(block, work, &q, &out);
    if (code) return code;
    memcpy(force + 2 * n * k, out.force, (size_t)2 * (size_t)n * sizeof *force);
    memcpy(price + 6 * k, out.price, sizeof out.price);
    memcpy(aim + 6 * k, out.aim, sizeof out.aim);
    memcpy(command + 3 * n * k, out.command, (size_t)3 * (size_t)n * sizeof *command);
    value[k] = out.value;
    within[k] = (unsigned char)out.within;
    error[k] = out.error;
    ended |= out.ended;
  }
  return ended ? -1 : 0;
}

/* What prices (6,) of the wrench in the basis [W] give: forces (n, 2), and the dual value for a wrench. */
real fl_look(const real *block, fl_work *work, const real *wrench, const real *inner, real *force) {
  real target[6];
  fl_reduce_wrench(work, wrench, target);
  fl_dual_at(block, work, target, inner, work->state);
  memcpy(force, work->state->force, (size_t)2 * (size_t)COUNT(block) * sizeof *force);
  return work->state->value;
}

int fl_worth(const real *block, fl_work *work, const fl_question *question, const real *price, int count,
             fl_actuator_worth *worth) {
  fl_question still = *question;
  still.calm = 0; /* turning is no power */
  if (!fl_prepare_question(block, work, &still)) return FL_BAD_NUMBER;
  for (int k = 0; k < count; k++) {
    real inner[6];
    fl_reduce_lambda(work, price + 6 * k, inner);
    for (int i = 0; i < COUNT(block); i++, worth++) {
      const fl_set *set = work->set + i;
      real own[2];
      wide force[2];
      own_price(work, i, inner, own);
      const real along_force = fl_support_of_set(block, i, set, own, force);
      worth->price = set->flipped ? 0 : along_force;
      worth->price_back = set->flipped ? along_force : 0;
      worth->low = set->flipped ? -set->high : set->low;
      worth->high = set->flipped ? -set->low : set->high;
      if (set->reverse > 0) {
        const fl_set back = fl_reversed_set(set);
        worth->price_back = fl_support_of_set(block, i, &back, own, force);
        worth->low = -set->reverse;
      }
      worth->conjugate = fl_response(block, i, set, own).conjugate;
    }
  }
  return FL_OK;
}

/* Commands (count, n, 3) for forces (count, n, 2); angles without a force keep those of previous ones (n, 3). */
void fl_commands(const real *block, fl_work *work, const real *force, int count, const real *previous, real *command) {
  int n = COUNT(block);
  fl_limits_without_tick(block, work);
  for (int k = 0; k < count; k++)
    fl_commands_for_forces(block, &work->box, (real(*)[2])(force + 2 * n * k), previous, (real(*)[3])(command + 3 * n * k));
}
