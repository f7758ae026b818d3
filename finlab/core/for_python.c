/* What Python alone asks: commands of other methods, and what prices prove. */
#include "inner.h"

/* Prices in the basis of those of the wrench. */
void price_in_basis(const real *block, const real *price, real *inner) {
  const fl_head *h = HEAD(block);
  for (int j = 0; j < RANGE(block); j++) {
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
      farthest_of(block, i, work->set + i, own, force, worth);
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
