/* In place of turning_cost.c, for a robot whose actuators turn for nothing: thrusters, fins, rudders.
   Nothing calls these functions, which the other files name. */
#include "internal.h"

response fl_response_with_turning(const real *block, int i, const fl_set *set, const real *price) {
  (void)block;
  (void)i;
  (void)set;
  (void)price;
  response none;
  memset(&none, 0, sizeof none);
  return none;
}

int fl_has_jumped(const real *block, int i, const fl_set *set, const fl_state *one,
                  const fl_state *other, const real *step, int is_short) {
  (void)block;
  (void)i;
  (void)set;
  (void)one;
  (void)other;
  (void)step;
  (void)is_short;
  return 0;
}

void fl_mark_jump(fl_set *set, real one, real other) {
  (void)set;
  (void)one;
  (void)other;
}
