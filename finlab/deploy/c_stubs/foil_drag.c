/* In place of foil_drag.c and the files that it needs, for a robot none of whose actuators is a foil
   in a flow: nothing calls these functions, which the other files name. */
#include "internal.h"

void fl_improve_commands(const real *block, fl_work *work, const real *target_reduced,
                         real *best_cost) {
  (void)block;
  (void)work;
  (void)target_reduced;
  (void)best_cost;
}

void fl_improve_from_starts(const real *block, fl_work *work, const real *target_reduced,
                            real *best_cost) {
  fl_improve_commands(block, work, target_reduced, best_cost);
}

int fl_take_sure_forces(const real *block, fl_work *work) {
  (void)block;
  (void)work;
  return 0;
}

void fl_largest_ray_share(const real *block, fl_work *work, const real *wrench, real start[][3],
                          real found, real most, fl_answer *out) {
  (void)block;
  (void)work;
  (void)wrench;
  (void)start;
  (void)found;
  (void)most;
  (void)out;
}

int fl_go_to_jump(const real *block, const fl_work *work, const real *target_reduced,
                  const real *step, real slope, const fl_state *from, fl_state *trial) {
  (void)block;
  (void)work;
  (void)target_reduced;
  (void)step;
  (void)slope;
  (void)from;
  (void)trial;
  return 0;
}

int fl_is_drag_welcome(const real *block, const fl_work *work, const real *lambda) {
  (void)block;
  (void)work;
  (void)lambda;
  return 0;
}

int fl_is_done_by_foils(const real *block, const fl_work *work, real best_cost) {
  (void)block;
  (void)work;
  (void)best_cost;
  return 0;
}

void fl_foil_at(const real *block, int i, real angle, fl_tangent *tangent) {
  (void)block;
  (void)i;
  (void)angle;
  (void)tangent;
}
