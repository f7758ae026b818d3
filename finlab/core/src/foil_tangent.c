/* A foil near to a command: its curve of lift and drag by the angle, and the tangent of that curve,
   which stands for it in a step of foil_drag.c. */
#include "internal.h"

#define TRUST R(0.25) /* trust radius: share of its range that a foil turns in one step */

/* The last lift coefficient of a foil's table, and behind it the angle of attack [rad] at which
   it has that: beyond, it stalls and drags more. */
const real *fl_lift_end(const real *block, const fl_actuator *a) {
  const real *curve = block + (int)a->command_table;
  return curve + 2 * (int)curve[0] - 1;
}

/* A foil at an angle: force, cost and their slopes; all of the tangent but its curvature. */
void fl_foil_at(const real *block, int i, real angle, fl_tangent *tangent) {
  const fl_actuator *a = ACTUATOR(block, i);
  const real command[3] = {angle, 0, 0};
  real force[3];
  real by[3][3];
  fl_force_of_command(block, i, command, force, by);
  const real lift = force[0];
  const real d_lift = by[0][0];
  const real drag = force[1] + a->pressure_area * a->zero_lift_drag;
  const real d_drag = by[0][1];
  memcpy(tangent->force, force, sizeof tangent->force);
  memcpy(tangent->force_slope, by[0], sizeof tangent->force_slope);
  tangent->cost = a->flow_speed * drag + a->uncertainty_cost * (lift * lift + drag * drag);
  tangent->cost_slope = a->flow_speed * d_drag +
                        2 * a->uncertainty_cost * (lift * d_lift + drag * d_drag);
}

/* Makes the set of a step the tangent of a foil at an angle, curved as much as its cost less
   the worth of its force at prices s of lift and drag. */
void fl_draw_tangent(const real *block, int i, const fl_box *box, real angle, const real *s,
                     fl_tangent *tangent, fl_set *set) {
  const fl_actuator *a = ACTUATOR(block, i);
  const real low = box->command_min[i][0];
  const real high = box->command_max[i][0];
  const real most_turn = TRUST * (high - low);
  const real apart = CLOSE * (high - low) + TINY;
  fl_tangent other;
  fl_foil_at(block, i, angle + apart, &other);
  fl_foil_at(block, i, angle, tangent);
  /* Change of the slope of cost - s.force over `apart`. */
  const real change = other.cost_slope - tangent->cost_slope - dot(s, other.force_slope, 2) +
                      dot(s, tangent->force_slope, 2);
  tangent->curvature =
      larger(FABS(change) / apart, CLOSE * a->flow_speed * a->pressure_area + TINY);
  const real most_cost = tangent->cost + FABS(tangent->cost_slope) * most_turn +
                         tangent->curvature * most_turn * most_turn;
  set->force_min = larger(low - angle, -most_turn);
  set->force_max = smaller(high - angle, most_turn);
  set->tangent = tangent;
  set->cost_at_min = most_cost;
  set->cost_at_max = most_cost;
}
