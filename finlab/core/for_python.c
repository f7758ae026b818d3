/* What Python alone asks: sizes, many answers, commands of other methods, and what prices prove. */
#include "inner.h"

int fl_sizes(int which) {
  const int sizes[] = {sizeof(real), sizeof(fl_head), sizeof(fl_actuator), sizeof(fl_work),
                       sizeof(fl_policy), sizeof(fl_answer), FL_MOST};
  return which >= 0 && which < (int)(sizeof sizes / sizeof *sizes) ? sizes[which] : 0;
}

/* Answers to wrenches (count, 6): forces (count, n, 2), prices and aims (count, 6), values, commands
   (count, n, 3), within reach; -1 where a search ended at its bound of steps. */
int fl_answer_many(const real *block, fl_work *work, const real *wrench, int count, const fl_policy *policy,
                   real *force, real *price, real *aim, real *value, real *command, unsigned char *within) {
  int n = COUNT(block), ended = 0;
  fl_question q = {{0}, policy, 0, 0};
  fl_answer out;
  for (int k = 0; k < count; k++) {
    memcpy(q.wrench, wrench + 6 * k, sizeof q.wrench);
    int error = fl_answer_one(block, work, &q, &out);
    if (error) return error;
    memcpy(force + 2 * n * k, out.force, 2 * n * sizeof *force);
    memcpy(price + 6 * k, out.price, sizeof out.price);
    memcpy(aim + 6 * k, out.aim, sizeof out.aim);
    memcpy(command + 3 * n * k, out.command, 3 * n * sizeof *command);
    value[k] = out.value, within[k] = out.within, ended |= out.ended;
  }
  return ended ? -1 : 0;
}

/* Prices in the basis of those of the wrench. */
void price_in_basis(const real *block, const real *price, real *inner) {
  const fl_head *h = HEAD(block);
  for (int j = 0; j < 6; j++) {
    inner[j] = 0;
    for (int k = 0; k < 6; k++) inner[j] += h->basis[k][j] * h->scale[k] * price[k];
  }
}

/* What prices (6,) of the wrench in the basis [W] give: forces (n, 2), and the dual value for a wrench. */
real fl_look(const real *block, fl_work *work, const real *wrench, const real *inner, real *force) {
  real target[6];
  to_basis(block, wrench, target);
  look(block, work, target, inner, work->state);
  memcpy(force, work->state->force, 2 * COUNT(block) * sizeof *force);
  return work->state->value;
}

/* At prices (count, 6) of the wrench [W/N, W/(N m)], of each actuator (count, n, 3): prices along its force, ahead and
   in reverse, and what the force is worth, less its power [W]. */
void fl_worth(const real *block, fl_work *work, const real *price, int count, real *worth) {
  for (int k = 0; k < count; k++, price += 6) {
    real inner[6], own[2], force[2];
    price_in_basis(block, price, inner);
    for (int i = 0; i < COUNT(block); i++, worth += 3) {
      own_price(block, i, inner, own);
      worth[0] = farthest_of(block, i, work->set + i, own, force), worth[1] = 0;
      if (work->set[i].reverse > 0) {
        fl_set back = reversed(work->set + i);
        worth[1] = farthest_of(block, i, &back, own, force);
      }
      worth[2] = reply_of(block, i, work->set + i, own).conjugate;
    }
  }
}

/* Commands (count, n, 3) for forces (count, n, 2); angles without a force keep those of previous ones (n, 3). */
void fl_commands(const real *block, fl_work *work, const real *force, int count, const real *previous, real *command) {
  int n = COUNT(block);
  all_limits(block, &work->box);
  for (int k = 0; k < count; k++)
    commands_for(block, &work->box, (real(*)[2])(force + 2 * n * k), previous, (real(*)[3])(command + 3 * n * k));
}
