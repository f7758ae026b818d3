/* What one actuator may give: the set Y of its feasible forces with their cost c(y), Eq. 1 and 2.
   It is made of limits, an arc of directions and dead bands. And the response of an interval of
   forces to a price along it, Eq. 5.

   Forces are in newtons along the actuator's own rows, of planes below 0 in reverse; prices in
   W/N, costs in W. */
#include "internal.h"

/* Price, over the mean one of the least force, up to which a force turns round; CLOSE stands in
   its place in an arc whose half is up to NARROW. */
#define TURNING R(1e-2)

/* The table of force over price of an actuator, or that in reverse where it has one. */
static const real *table_of(const real *block, const fl_actuator *a, int is_reverse) {
  if (is_reverse && a->force_table_reverse > 0) return block + (int)a->force_table_reverse;
  return block + (int)a->force_table;
}

/* T(v), T'(v) and C(v) of an actuator without limits, Eq. 16, at a price v [W/N]. Its force is
   k_T times that of the table, its power k_P times: so the table is asked at v k_T / k_P. */
static line_response at_price(const real *block, const fl_actuator *a, int is_reverse, real v) {
  real ratio = 1; /* k_T / k_P */
  if (a->force_scale != a->power_scale) ratio = a->force_scale / a->power_scale;
  const line_response table = fl_force_of_price(table_of(block, a, is_reverse), v * ratio);
  line_response scaled;
  scaled.force = table.force * a->force_scale;
  scaled.slope = table.slope * a->force_scale * ratio;
  scaled.conjugate = table.conjugate * a->power_scale;
  return scaled;
}

/* Power c(y) [W] of a force of an actuator within its tables. */
real fl_power_of_force(const real *block, int i, real force) {
  return fl_power_and_price(block, i, force, 0);
}

/* The same, and the price c'(y) [W/N] at which the force is given; 0 for who does not ask. */
real fl_power_and_price(const real *block, int i, real force, real *price) {
  const fl_actuator *a = ACTUATOR(block, i);
  const real *table = table_of(block, a, force < 0);
  const real power = a->power_scale * fl_marginal_cost(table, FABS(force) / a->force_scale, price);
  if (price) *price *= a->power_scale / a->force_scale;
  return power;
}

/* Sets what follows from the limits of a set, but for its angles: the price below which a
   direction is rounding, and whether its arc has two ends that may be worth the same. */
static void set_ends(int plane, fl_set *set) {
  real least = 0;
  if (set->force_max > 0) least = NOTHING * set->cost_at_max / set->force_max;
  if (set->force_min > 0) {
    real turning = TURNING;
    if (set->sector_half_angle <= NARROW) turning = CLOSE;
    least = larger(least, turning * set->cost_at_min / set->force_min);
  }
  set->price_floor_squared = least * least + TINY;

  const int is_arc = set->sector_half_angle < PI;
  const int is_wide = set->sector_half_angle > PI / 2;
  const int has_hole = set->force_min > 0 && set->sector_half_angle > 0;
  set->is_forked = plane && is_arc && (is_wide || has_hole);
}

/* Sets what follows from the limits and the arc of a set. */
void fl_prepare_set(const real *block, int i, fl_set *set) {
  set_ends(is_plane(ACTUATOR(block, i)), set);
  set->cos_center = COS(set->sector_center);
  set->sin_center = SIN(set->sector_center);
  set->cos_half_angle = COS(set->sector_half_angle);
  set->sin_half_angle = SIN(set->sector_half_angle);
}

/* Leaves of an interval of forces what is outside of a dead band, and rest: commands within the
   band give no force. */
static void without_band(real band, real *low, real *high) {
  const int touches = *low < band && *high > -band;
  if (!(band > 0) || !touches) return;
  if (*low > -band) *low = 0;
  if (*high < band) *high = 0;
}

/* Makes the arc of a set that of its forces in reverse. */
static void turn_arc_round(fl_set *set) {
  set->sector_center += PI;
  if (!reverses_straight(set)) return;
  set->sector_center = PI;
  set->sector_half_angle = 0;
}

/* Makes a set of forces between two [N], of planes below 0 against their direction, in an arc
   of middle +- half [rad]. A plane keeps sizes, from 0 on: one that can push in reverse alone
   is flipped, its arc turned by pi; one that can push both ways has what it pushes ahead as its
   interval, and the largest size in reverse beside it. */
void fl_limit_set(const real *block, int i, fl_set *set, real low, real high, real middle,
                  real half) {
  without_band(ACTUATOR(block, i)->dead_band, &low, &high);
  const int plane = is_plane(ACTUATOR(block, i));
  const int has_reverse = plane && low < 0;
  set->is_flipped = has_reverse && high <= 0;
  set->tangent = 0;
  if (FL_ARCS > 0) set->arc = 0;
  set->turn_cost = 0;
  set->turn_origin = 0;
  set->jump_angle = 0;
  set->slope_max = 0;
  set->has_jumped = 0;

  real near = low; /* to rest */
  real far = high;
  if (set->is_flipped) {
    near = high;
    far = low;
  } else if (has_reverse) {
    near = 0;
  }
  set->cost_at_min = fl_power_of_force(block, i, near);
  set->cost_at_max = fl_power_of_force(block, i, far);
  set->force_min = near;
  set->force_max = far;
  if (plane) {
    set->force_min = FABS(near);
    set->force_max = FABS(far);
  }

  set->force_max_reverse = 0;
  set->cost_at_max_reverse = set->cost_at_min;
  if (has_reverse) set->cost_at_max_reverse = fl_power_of_force(block, i, low);
  if (has_reverse && !set->is_flipped) set->force_max_reverse = -low;

  set->sector_center = middle;
  set->sector_half_angle = half;
  if (FL_SLIPSTREAMS)
    set->reverses_straight = (unsigned char)fl_form_of(ACTUATOR(block, i))->reverses_straight;
  if (set->is_flipped) turn_arc_round(set);
  fl_prepare_set(block, i, set);
}

/* Makes the set of an actuator that is lost: rest, at no power. */
void fl_empty_set(const real *block, int i, fl_set *set) {
  memset(set, 0, sizeof *set);
  if (is_plane(ACTUATOR(block, i))) set->sector_half_angle = PI;
  fl_prepare_set(block, i, set);
}

/* Leaves of a set one force (2,) [N] and nothing else. */
void fl_fix_force(const real *block, int i, fl_set *set, const real *force) {
  const int plane = is_plane(ACTUATOR(block, i));
  real size = force[0];
  if (plane) size = fl_limited_size(block, i, set, force);
  real signed_size = clipped(size, set->force_min, set->force_max);
  if (set->is_flipped) signed_size = -signed_size;
  const real cost = fl_power_of_force(block, i, signed_size);
  set->cost_at_min = cost;
  set->cost_at_max = cost;
  set->force_min = size;
  set->force_max = size;
  if (plane) {
    set->sector_center = ATAN2(force[1], force[0]);
    set->sector_half_angle = 0;
    set->force_max_reverse = 0;
  }
  fl_prepare_set(block, i, set);
}

/* The response of a plane ahead to a price along it, within all that its table gives: where the
   price is against the force, the least one. */
line_response fl_unlimited_response(const real *block, const fl_actuator *a, real price) {
  line_response y = at_price(block, a, 0, larger(price, 0));
  if (price < 0) {
    y.slope = 0;
    y.conjugate += price * y.force;
  }
  return y;
}

/* The response where a limit of a set holds it: no slope, and c*(v) = v y - c(y). */
static line_response at_limit(real v, real force, real cost) {
  line_response limited;
  limited.force = force;
  limited.slope = 0;
  limited.conjugate = v * force - cost;
  return limited;
}

/* The response y = argmax v y - c(y) between the limits of a set to a price along it, Eq. 5,
   with its derivative and the conjugate. A line pushes either way by the sign of the price; a
   plane has sizes from 0 on, and in an arc a price may be against all of its directions. */
line_response fl_limited_response(const real *block, const fl_actuator *a, const fl_set *set,
                                  int line, real price) {
  int is_reverse = set->is_flipped;
  real sign = 1;
  if (line) is_reverse = price < 0;
  if (line && price < 0) sign = -1;
  const real v = sign * price;
  const int is_arc = !line && set->sector_half_angle < PI;
  real v_asked = v;
  if (is_arc) v_asked = larger(v, 0);

  line_response y = at_price(block, a, is_reverse, v_asked);
  y.force *= sign;
  if (is_arc && !(v > 0)) y.slope = 0;
  if (y.force <= set->force_min) return at_limit(price, set->force_min, set->cost_at_min);
  if (y.force >= set->force_max) return at_limit(price, set->force_max, set->cost_at_max);
  return y;
}

/* What a plane that pushes either way gives in reverse. */
fl_set fl_reversed_set(const fl_set *set) {
  fl_set reversed = *set;
  reversed.force_min = 0;
  reversed.force_max = set->force_max_reverse;
  reversed.cost_at_max = set->cost_at_max_reverse;
  reversed.force_max_reverse = 0;
  reversed.is_flipped = 1;
  reversed.turn_origin = set->turn_origin + PI;
  reversed.cos_center = -set->cos_center;
  reversed.sin_center = -set->sin_center;
  turn_arc_round(&reversed);
  if (reverses_straight(set)) {
    reversed.cos_center = -1;
    reversed.sin_center = 0;
    reversed.cos_half_angle = 1;
    reversed.sin_half_angle = 0;
  }
  set_ends(1, &reversed);
  return reversed;
}

/* The largest slope of a table of force over price, of all of its cubics: no slope is above the
   control points of its parabola, which are the slopes at both knots and one between them. */
static real steepest_in(const real *table) {
  const real price_max = table[0];
  const int cells = (int)table[1];
  const real *knot = table + 3;
  real most = 0;
  if (knot[0] > 0) return LARGEST_NUMBER; /* a force at no price is a jump */
  for (int k = 0; k < cells; k++) {
    real first = (real)k / (real)cells;
    real last = (real)(k + 1) / (real)cells;
    first *= first;
    last *= last;
    const real width = (last * last - first * first) * price_max;
    const real middle = 3 * (knot[3] - knot[0]) / width - knot[1] - knot[4];
    const real most_at_knots = larger(knot[1], knot[4]);
    most = larger(larger(most, middle), most_at_knots);
    knot += 3;
  }
  return most;
}

/* The largest slope T' of the force of an actuator by its price [N^2/W]. */
real fl_largest_slope(const real *block, int i) {
  const fl_actuator *a = ACTUATOR(block, i);
  const real ahead = steepest_in(table_of(block, a, 0));
  const real reverse = steepest_in(table_of(block, a, 1));
  const real most = larger(ahead, reverse);
  return most * a->force_scale * a->force_scale / a->power_scale;
}
