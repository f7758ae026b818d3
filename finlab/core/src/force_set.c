/* What one actuator may give: a set of forces with their power, made of limits, an arc of directions and dead bands; and
   the force of an interval that is worth most at a price along it. */
#include "internal.h"

/* Price, over the mean one of the least force, up to which a force turns round; CLOSE in a narrow arc. */
#define TURNING R(1e-2)

static const real *table_of(const real *block, const fl_actuator *a, int back) {
  return block + (int)(back && a->back > 0 ? a->back : a->ahead);
}

static line_response at_price(const real *block, const fl_actuator *a, int back, real price) {
  real per = a->share == a->worth ? 1 : a->share / a->worth;
  line_response o = fl_force_of_price(table_of(block, a, back), price * per);
  return (line_response){o.force * a->share, o.slope * a->share * per, o.conjugate * a->worth};
}

/* Power [W] of a force of an actuator within its tables, of planes below 0 in reverse. */
real fl_power_of_force(const real *block, int i, real force) {
  return fl_power_and_price(block, i, force, 0);
}

/* The same, and the price [W/N] at which the force is given. */
real fl_power_and_price(const real *block, int i, real force, real *price) {
  const fl_actuator *a = ACTUATOR(block, i);
  const real *table = table_of(block, a, force < 0);
  const real power = a->worth * fl_marginal_cost(table, FABS(force) / a->share, price);
  if (price) *price *= a->worth / a->share;
  return power;
}

/* What follows from the limits of a set, but for its angles. */
static void set_ends(int plane, fl_set *set) {
  real least = set->high > 0 ? NOTHING * set->high_cost / set->high : 0;
  if (set->low > 0) least = MAX(least, (set->half <= NARROW ? CLOSE : TURNING) * set->low_cost / set->low);
  set->gap2 = least * least + TINY;
  set->forked = plane && set->half < PI && (set->half > PI / 2 || (set->low > 0 && set->half > 0));
}

void fl_prepare_set(const real *block, int i, fl_set *set) {
  set_ends(is_plane(ACTUATOR(block, i)), set);
  set->cos_middle = COS(set->middle), set->sin_middle = SIN(set->middle);
  set->cos_half = COS(set->half), set->sin_half = SIN(set->half);
}

/* Leaves of an interval of forces what is outside of a dead band, and rest: commands within the band give no force. */
static void without_band(real band, real *low, real *high) {
  const int touches = *low < band && *high > -band;
  if (!(band > 0) || !touches) return;
  if (*low > -band) *low = 0;
  if (*high < band) *high = 0;
}

/* A set between two forces [N], of planes below 0 against their direction, in an arc [rad]. */
void fl_limit_set(const real *block, int i, fl_set *set, real low, real high, real middle, real half) {
  without_band(ACTUATOR(block, i)->band, &low, &high);
  int plane = is_plane(ACTUATOR(block, i)), back = plane && low < 0;
  set->flipped = back && high <= 0, set->tangent = 0;
  set->turn = set->at = set->cut = set->steepest = 0, set->jumps = 0;
  real near = set->flipped ? high : back ? 0 : low, far = set->flipped ? low : high;
  set->low_cost = fl_power_of_force(block, i, near), set->high_cost = fl_power_of_force(block, i, far);
  set->low = plane ? FABS(near) : near, set->high = plane ? FABS(far) : far;
  set->reverse = back && !set->flipped ? -low : 0;
  set->reverse_cost = back ? fl_power_of_force(block, i, low) : set->low_cost;
  set->middle = middle + (set->flipped ? PI : 0), set->half = half;
  fl_prepare_set(block, i, set);
}

/* The set of an actuator that is lost: rest, at no power. */
void fl_empty_set(const real *block, int i, fl_set *set) {
  memset(set, 0, sizeof *set);
  if (is_plane(ACTUATOR(block, i))) set->half = PI;
  fl_prepare_set(block, i, set);
}

/* A set of one force and nothing else. */
void fl_fix_force(const real *block, int i, fl_set *set, const real *force) {
  int plane = is_plane(ACTUATOR(block, i));
  real size = plane ? size_of(force) : force[0];
  real within = CLIP(size, set->low, set->high);
  set->low_cost = set->high_cost = fl_power_of_force(block, i, set->flipped ? -within : within);
  set->low = set->high = size;
  if (plane) set->middle = ATAN2(force[1], force[0]), set->half = 0, set->reverse = 0;
  fl_prepare_set(block, i, set);
}

/* The force that is worth most at a price along it, between the limits of a set. */
line_response fl_limited_response(const real *block, const fl_actuator *a, const fl_set *set, int line, real price) {
  int back = set->flipped, narrow = !line && set->half < PI;
  real sign = line && price < 0 ? -1 : 1, size = sign * price;
  if (line) back = price < 0;
  line_response o = at_price(block, a, back, narrow ? MAX(size, 0) : size);
  o.force *= sign;
  if (narrow && !(size > 0)) o.slope = 0;
  if (o.force <= set->low)
    o = (line_response){set->low, 0, price * set->low - set->low_cost};
  else if (o.force >= set->high)
    o = (line_response){set->high, 0, price * set->high - set->high_cost};
  return o;
}

/* What a plane that pushes either way gives in reverse. */
fl_set fl_reversed_set(const fl_set *set) {
  fl_set r = *set;
  r.low = 0, r.high = set->reverse, r.high_cost = set->reverse_cost, r.reverse = 0, r.flipped = 1;
  r.at = set->at + PI, r.middle = set->middle + PI, r.cos_middle = -set->cos_middle, r.sin_middle = -set->sin_middle;
  set_ends(1, &r);
  return r;
}

/* The largest slope of a table of force over price, of all of its cubics: no slope is above the control points of its
   parabola, which are the slopes at both knots and one between them. */
static real steepest_in(const real *table) {
  const int cells = (int)table[1];
  const real *knot = table + 3;
  real most = 0;
  if (knot[0] > 0) return R(1e30); /* a force at no price is a jump */
  for (int k = 0; k < cells; k++, knot += 3) {
    real first = (real)k / (real)cells;
    real last = (real)(k + 1) / (real)cells;
    first *= first;
    last *= last;
    const real width = (last * last - first * first) * table[0];
    const real middle = 3 * (knot[3] - knot[0]) / width - knot[1] - knot[4];
    most = MAX(MAX(most, middle), MAX(knot[1], knot[4]));
  }
  return most;
}

/* The largest slope of the force of an actuator by its price [N^2/W]. */
real fl_largest_slope(const real *block, int i) {
  const fl_actuator *a = ACTUATOR(block, i);
  const real most = MAX(steepest_in(table_of(block, a, 0)), steepest_in(table_of(block, a, 1)));
  return most * a->share * a->share / a->worth;
}
