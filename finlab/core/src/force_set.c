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
  if (is_reverse && a->back > 0) return block + (int)a->back;
  return block + (int)a->ahead;
}

/* T(v), T'(v) and C(v) of an actuator without limits, Eq. 16, at a price v [W/N]. Its force is
   k_T times that of the table, its power k_P times: so the table is asked at v k_T / k_P. */
static line_response at_price(const real *block, const fl_actuator *a, int is_reverse, real v) {
  real ratio = 1; /* k_T / k_P */
  if (a->share != a->worth) ratio = a->share / a->worth;
  const line_response table = fl_force_of_price(table_of(block, a, is_reverse), v * ratio);
  line_response scaled;
  scaled.force = table.force * a->share;
  scaled.slope = table.slope * a->share * ratio;
  scaled.conjugate = table.conjugate * a->worth;
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
  const real power = a->worth * fl_marginal_cost(table, FABS(force) / a->share, price);
  if (price) *price *= a->worth / a->share;
  return power;
}

/* Sets what follows from the limits of a set, but for its angles: the price below which a
   direction is rounding, and whether its arc has two ends that may be worth the same. */
static void set_ends(int plane, fl_set *set) {
  real least = 0;
  if (set->high > 0) least = NOTHING * set->high_cost / set->high;
  if (set->low > 0) {
    real turning = TURNING;
    if (set->half <= NARROW) turning = CLOSE;
    least = fl_larger(least, turning * set->low_cost / set->low);
  }
  set->gap2 = least * least + TINY;

  const int is_arc = set->half < PI;
  const int is_wide = set->half > PI / 2;
  const int has_hole = set->low > 0 && set->half > 0;
  set->forked = plane && is_arc && (is_wide || has_hole);
}

/* Sets what follows from the limits and the arc of a set. */
void fl_prepare_set(const real *block, int i, fl_set *set) {
  set_ends(is_plane(ACTUATOR(block, i)), set);
  set->cos_middle = COS(set->middle);
  set->sin_middle = SIN(set->middle);
  set->cos_half = COS(set->half);
  set->sin_half = SIN(set->half);
}

/* Leaves of an interval of forces what is outside of a dead band, and rest: commands within the
   band give no force. */
static void without_band(real band, real *low, real *high) {
  const int touches = *low < band && *high > -band;
  if (!(band > 0) || !touches) return;
  if (*low > -band) *low = 0;
  if (*high < band) *high = 0;
}

/* Makes a set of forces between two [N], of planes below 0 against their direction, in an arc
   of middle +- half [rad]. A plane keeps sizes, from 0 on: one that can push in reverse alone
   is flipped, its arc turned by pi; one that can push both ways has what it pushes ahead as its
   interval, and the largest size in reverse beside it. */
void fl_limit_set(const real *block, int i, fl_set *set, real low, real high, real middle,
                  real half) {
  without_band(ACTUATOR(block, i)->band, &low, &high);
  const int plane = is_plane(ACTUATOR(block, i));
  const int has_reverse = plane && low < 0;
  set->flipped = has_reverse && high <= 0;
  set->tangent = 0;
  set->turn = 0;
  set->at = 0;
  set->cut = 0;
  set->steepest = 0;
  set->jumps = 0;

  real near = low; /* to rest */
  real far = high;
  if (set->flipped) {
    near = high;
    far = low;
  } else if (has_reverse) {
    near = 0;
  }
  set->low_cost = fl_power_of_force(block, i, near);
  set->high_cost = fl_power_of_force(block, i, far);
  set->low = near;
  set->high = far;
  if (plane) {
    set->low = FABS(near);
    set->high = FABS(far);
  }

  set->reverse = 0;
  set->reverse_cost = set->low_cost;
  if (has_reverse) set->reverse_cost = fl_power_of_force(block, i, low);
  if (has_reverse && !set->flipped) set->reverse = -low;

  set->middle = middle;
  if (set->flipped) set->middle = middle + PI;
  set->half = half;
  fl_prepare_set(block, i, set);
}

/* Makes the set of an actuator that is lost: rest, at no power. */
void fl_empty_set(const real *block, int i, fl_set *set) {
  memset(set, 0, sizeof *set);
  if (is_plane(ACTUATOR(block, i))) set->half = PI;
  fl_prepare_set(block, i, set);
}

/* Leaves of a set one force (2,) [N] and nothing else. */
void fl_fix_force(const real *block, int i, fl_set *set, const real *force) {
  const int plane = is_plane(ACTUATOR(block, i));
  real size = force[0];
  if (plane) size = size_of(force);
  real signed_size = fl_clipped(size, set->low, set->high);
  if (set->flipped) signed_size = -signed_size;
  const real cost = fl_power_of_force(block, i, signed_size);
  set->low_cost = cost;
  set->high_cost = cost;
  set->low = size;
  set->high = size;
  if (plane) {
    set->middle = ATAN2(force[1], force[0]);
    set->half = 0;
    set->reverse = 0;
  }
  fl_prepare_set(block, i, set);
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
  int is_reverse = set->flipped;
  real sign = 1;
  if (line) is_reverse = price < 0;
  if (line && price < 0) sign = -1;
  const real v = sign * price;
  const int is_arc = !line && set->half < PI;
  real v_asked = v;
  if (is_arc) v_asked = fl_larger(v, 0);

  line_response y = at_price(block, a, is_reverse, v_asked);
  y.force *= sign;
  if (is_arc && !(v > 0)) y.slope = 0;
  if (y.force <= set->low) return at_limit(price, set->low, set->low_cost);
  if (y.force >= set->high) return at_limit(price, set->high, set->high_cost);
  return y;
}

/* What a plane that pushes either way gives in reverse. */
fl_set fl_reversed_set(const fl_set *set) {
  fl_set reversed = *set;
  reversed.low = 0;
  reversed.high = set->reverse;
  reversed.high_cost = set->reverse_cost;
  reversed.reverse = 0;
  reversed.flipped = 1;
  reversed.at = set->at + PI;
  reversed.middle = set->middle + PI;
  reversed.cos_middle = -set->cos_middle;
  reversed.sin_middle = -set->sin_middle;
  set_ends(1, &reversed);
  return reversed;
}

/* The largest slope of a table of force over price, of all of its cubics: no slope is above the
   control points of its parabola, which are the slopes at both knots and one between them. */
static real steepest_in(const real *table) {
  const int cells = (int)table[1];
  const real *knot = table + 3;
  real most = 0;
  if (knot[0] > 0) return R(1e30); /* a force at no price is a jump */
  for (int k = 0; k < cells; k++) {
    real first = (real)k / (real)cells;
    real last = (real)(k + 1) / (real)cells;
    first *= first;
    last *= last;
    const real width = (last * last - first * first) * table[0];
    const real middle = 3 * (knot[3] - knot[0]) / width - knot[1] - knot[4];
    const real most_at_knots = fl_larger(knot[1], knot[4]);
    most = fl_larger(fl_larger(most, middle), most_at_knots);
    knot += 3;
  }
  return most;
}

/* The largest slope T' of the force of an actuator by its price [N^2/W]. */
real fl_largest_slope(const real *block, int i) {
  const fl_actuator *a = ACTUATOR(block, i);
  const real ahead = steepest_in(table_of(block, a, 0));
  const real reverse = steepest_in(table_of(block, a, 1));
  const real most = fl_larger(ahead, reverse);
  return most * a->share * a->share / a->worth;
}
