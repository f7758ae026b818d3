/* Where the lift of a foil whose drag is welcome jumps along a step of Newton's method: from one of
   its ends to the other. There the response is a chord, whose derivative leads on to where the
   forces add up. */
#include "internal.h"

/* Where a foil responds at the middle of a jump along a step of multipliers, as a share of it: the
   lift of one whose drag is welcome jumps between its ends, where the price of lift and drag along
   its chord is that of its power. LARGEST_NUMBER where it does not jump. */
static real share_at_jump(const real *block, const fl_work *work, int i, const real *step,
                          const fl_state *from, const fl_state *to) {
  const fl_actuator *a = ACTUATOR(block, i);
  const fl_set *set = work->set + i;
  const real range = set->force_max - set->force_min;
  const real change = to->force[i][0] - from->force[i][0];
  if (!is_foil(a) || set->tangent || !(FABS(change) > range / 2)) return LARGEST_NUMBER;
  const real power_slope = (set->cost_at_max - set->cost_at_min) / range; /* of the chord */
  const real drag_slope = power_slope / a->flow_speed;
  real s[2];
  real ds[2];
  actuator_price(work, i, from->lambda_reduced, s);
  actuator_price(work, i, step, ds);
  const real price = s[0] + drag_slope * s[1] - power_slope; /* of lift, along the chord */
  return -price / (ds[0] + drag_slope * ds[1]);
}

/* The share of a step (0 to 1) at which the dual value is largest, where that is at the jump of a
   foil; 0 where it is not. Each jump takes from the `slope` along the step what it changes. */
static real share_to_jump(const real *block, const fl_work *work, const real *step, real slope,
                          const fl_state *from, const fl_state *to) {
  real last_share = 0;
  while (slope > 0) {
    real share = 1; /* of the next jump */
    real drop = 0;  /* of the slope there */
    for (int i = 0; i < COUNT(block); i++) {
      const real jump_share = share_at_jump(block, work, i, step, from, to);
      if (!(jump_share > last_share && jump_share < share)) continue;
      real ds[2];
      actuator_price(work, i, step, ds);
      const real d_lift = to->force[i][0] - from->force[i][0];
      const real d_drag = to->force[i][1] - from->force[i][1];
      share = jump_share;
      drop = ds[0] * d_lift + ds[1] * d_drag;
    }
    if (!(share < 1)) return 0;
    slope -= drop;
    last_share = share;
  }
  return last_share;
}

/* Makes a trial of a step of multipliers the dual at the jump at which its value is largest along
   the step, whose slope begins with so much; 0 where there is no such jump. */
int fl_go_to_jump(const real *block, const fl_work *work, const real *target_reduced,
                  const real *step, real slope, const fl_state *from, fl_state *trial) {
  const real share = share_to_jump(block, work, step, slope, from, trial);
  if (!(share > 0)) return 0;
  real lambda[6];
  for (int j = 0; j < 6; j++) lambda[j] = from->lambda_reduced[j] + share * step[j];
  fl_dual_at(block, work, target_reduced, lambda, trial);
  return 1;
}

/* Whether the drag of a foil is welcome at multipliers: its lift is at an end then. */
int fl_is_drag_welcome(const real *block, const fl_work *work, const real *lambda) {
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    real s[2];
    actuator_price(work, i, lambda, s);
    if (is_foil(a) && s[1] > a->flow_speed) return 1;
  }
  return 0;
}
