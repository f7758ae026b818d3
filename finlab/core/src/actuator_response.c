/* The response of one actuator to a price s of its force: y = argmax s.y - c(y), with its
   derivative and the conjugate c*(s), Eq. 4 and 5.

   A line responds with T(|s|) sign(s), a plane with T(v) g where v = s.g and g is the direction of
   the force. Where it may choose between two responses, the ends of a wide arc or the two ways of a
   pod, it gives a blend of both: the gradient of a smooth maximum of their conjugates, Eqs. 25 to
   27.

   A foil gives lift and with it drag, whose price s_2 makes lift as dear as r = 1 - s_2/U times its
   power, Eq. 19. Where drag is welcome r < 0: r is softened to q(r) > 0, Eq. 20, and the chord of
   the power stands for the power in what q has more than r, Eqs. 21 to 23.

   Prices are in W/N along the actuator's own rows, forces in N. */
#include "internal.h"

#define SOFT R(0.2)         /* rho of Eq. 20: r of a foil below which it is softened */
#define SOFT_LEAST R(0.005) /* epsilon of Eq. 20: least q over rho */

/* A direction in which a plane may push. */
typedef struct {
  real v;          /* price along it [W/N] */
  real x, y;       /* g: force per newton of size; of length 1 but for a gauge */
  real xx, xy, yy; /* how g turns with the price, dg/ds [N/W] */
  int is_beyond;   /* whether the price lies beyond an end of the arc, which g then is */
  real other_end;  /* angle of the other end then [rad] */
} push_direction;

/* Whether what a plane pushes depends on the direction: by a gauge, or by the curve of a rudder in
   a slipstream. In reverse nothing meets that rudder. */
static int has_gauge(const fl_actuator *a, const fl_set *set) {
  if (FL_SLIPSTREAMS && set->is_flipped) return 0;
  return has_gauge_table(a) || is_steered(a);
}

/* How far a plane pushes ahead in a direction [rad], over the size that limits hold: 1 of most. */
real fl_radius(const real *block, int i, real angle) {
  const fl_actuator *a = ACTUATOR(block, i);
#if FL_SLIPSTREAMS
  if (is_steered(a)) return fl_steered_radius(block, i, angle);
#endif
  if (has_gauge_table(a)) return fl_gauge_radius(block + (int)a->gauge_table, angle);
  return 1;
}

/* The support function of what has a gauge in the direction (x, y) of a price. */
static gauge_point support_at(const real *block, int i, real x, real y) {
  const fl_actuator *a = ACTUATOR(block, i);
#if FL_SLIPSTREAMS
  if (is_steered(a)) return fl_steered_support(block, i, x, y);
#endif
  return fl_gauge_support(block + (int)a->gauge_table, x, y);
}

/* Size of a plane's force [N] that the limits of its set hold: of a gauge its size over the radius
   in its direction. */
real fl_limited_size(const real *block, int i, const fl_set *set, const real *force) {
  const real size = size_of(force);
  if (!has_gauge(ACTUATOR(block, i), set)) return size;
  return size / fl_radius(block, i, ATAN2(force[1], force[0]));
}

/* An end of an arc as a direction, which no price turns. */
static push_direction end_of_arc(const real *block, int i, const fl_set *set, real angle,
                                 const real *price) {
  real rho = 1;
  if (has_gauge(ACTUATOR(block, i), set)) rho = fl_radius(block, i, angle);
  push_direction end = {0, rho * COS(angle), rho * SIN(angle), 0, 0, 0, 0, 0};
  end.v = price[0] * end.x + price[1] * end.y;
  return end;
}

/* The direction g in which a plane responds to a price s: that of s, and of a gauge
   g = sigma e + sigma' e_across with e = s / |s|. `floor_squared` is added to |s|^2: below its root
   a price is rounding. */
static push_direction direction_of(const real *block, int i, const fl_set *set, const real *price,
                                   real floor_squared) {
  const real size = SQRT(price[0] * price[0] + price[1] * price[1] + floor_squared);
  const real x = price[0] / size;
  const real y = price[1] / size;
  real turning = 1 / size; /* of g across e per price across e; sigma + sigma'' of a gauge */
  push_direction g = {size, x, y, 0, 0, 0, 0, 0};
  if (has_gauge(ACTUATOR(block, i), set)) {
    const gauge_point sigma = support_at(block, i, x, y);
    g.x = sigma.value * x - sigma.slope * y;
    g.y = sigma.value * y + sigma.slope * x;
    turning *= larger(sigma.value + sigma.bend, 0);
    g.v *= sigma.value;
  }
  if (set->sector_half_angle < PI) {
    const real along_middle = g.x * set->cos_center + g.y * set->sin_center;
    const real across_middle = g.y * set->cos_center - g.x * set->sin_center;
    if (FABS(across_middle) * set->cos_half_angle > along_middle * set->sin_half_angle) {
      /* The nearer end by the price itself: by the force, both are alike where the arc has no
         width. */
      real nearer = 1;
      if (price[1] * set->cos_center - price[0] * set->sin_center < 0) nearer = -1;
      const real angle = set->sector_center + nearer * set->sector_half_angle;
      push_direction end = end_of_arc(block, i, set, angle, price);
      end.is_beyond = 1;
      end.other_end = set->sector_center - nearer * set->sector_half_angle;
      g = end;
      turning = 0;
    }
  }
  g.xx = turning * (1 - x * x);
  g.xy = -turning * x * y;
  g.yy = turning * (1 - y * y);
  return g;
}

/* Blends a response with another one: c* becomes the smooth maximum of both conjugates, Eq. 25, and
   all else follows from its derivatives by the price, Eqs. 26 and 27. `omega` is in W. */
static void blend(response *own, const response *other, real omega) {
  const real delta = own->conjugate - other->conjugate;
  const real root = SQRT(delta * delta + omega * omega);
  const real p = (1 + delta / root) / 2;                    /* weight of the one */
  const real q = 1 - p;                                     /* of the other */
  const real dp = omega * omega / (2 * root * root * root); /* dp / ddelta [1/W] */
  const real dx = own->force[0] - other->force[0];
  const real dy = own->force[1] - other->force[1];
  own->force[0] = p * own->force[0] + q * other->force[0];
  own->force[1] = p * own->force[1] + q * other->force[1];
  own->xx = p * own->xx + q * other->xx + dp * dx * dx;
  own->xy = p * own->xy + q * other->xy + dp * dx * dy;
  own->yy = p * own->yy + q * other->yy + dp * dy * dy;
  own->conjugate += (root - delta) / 2; /* c1 + (R - delta) / 2 = (c1 + c2 + R) / 2 */
}

/* The response of a size T along a direction g: y = T g, dy/ds = T' g g' + T dg/ds. */
static response along_direction(line_response T, const push_direction *g) {
  response y;
  y.force[0] = T.force * g->x;
  y.force[1] = T.force * g->y;
  y.xx = T.slope * g->x * g->x + T.force * g->xx;
  y.xy = T.slope * g->x * g->y + T.force * g->xy;
  y.yy = T.slope * g->y * g->y + T.force * g->yy;
  y.conjugate = T.conjugate;
  y.angle = 0;
  return y;
}

/* The response of a plane that pushes ahead alone. */
static response sector_response(const real *block, int i, const fl_set *set, const real *price) {
  const fl_actuator *a = ACTUATOR(block, i);
  const push_direction g = direction_of(block, i, set, price, set->price_floor_squared);
  response own = along_direction(fl_limited_response(block, a, set, 0, g.v), &g);
  if (set->is_forked && g.is_beyond) {
    const push_direction end = end_of_arc(block, i, set, g.other_end, price);
    const response other = along_direction(fl_limited_response(block, a, set, 0, end.v), &end);
    blend(&own, &other, blend_width(set->cost_at_max));
  }
  return own;
}

/* The response of a plane: of one that pushes either way a blend of both. */
static response plane_response(const real *block, int i, const fl_set *set, const real *price) {
  response own = sector_response(block, i, set, price);
  if (set->force_max_reverse > 0) {
    const fl_set reversed = fl_reversed_set(set);
    const response other = sector_response(block, i, &reversed, price);
    blend(&own, &other, blend_width(reversed.cost_at_max));
  }
  return own;
}

/* P_0 of Eq. 19, the power [W] of a foil without lift: its drag is there all the same. */
static real power_at_rest(const real *block, const fl_actuator *a) {
  const real *table = block + (int)a->force_table;
  return a->power_scale * table[2];
}

/* r of a foil, Eq. 19, and q(r), Eq. 20. */
typedef struct {
  real r, q;
  real dq;  /* q'(r), 0 where q is held at its least value */
  real ddq; /* q''(r) */
} soft_ratio;

static soft_ratio soft_ratio_of(real r) {
  soft_ratio ratio = {r, r, 0, 0};
  const real exponent = smaller(r / SOFT - 1, 0);
  const real decay = EXP(exponent);
  if (decay > SOFT_LEAST) ratio.dq = decay; /* 1 where q = r */
  if (exponent < 0) {
    ratio.q = SOFT * larger(decay, SOFT_LEAST);
    ratio.ddq = ratio.dq / SOFT;
  }
  return ratio;
}

/* The chord of a foil's power, beyond that without lift, between the limits of its lift. */
typedef struct {
  real at_zero; /* at no lift [W] */
  real at_lift; /* at the lift of the response [W] */
  real slope;   /* [W/N] */
} power_chord;

/* The response of a foil to the prices s of its lift and its drag, Eqs. 21 to 23. */
static response foil_response(const real *block, const fl_actuator *a, const fl_set *set,
                              const real *price) {
  const real U = a->flow_speed;
  const soft_ratio ratio = soft_ratio_of(1 - price[1] / U);
  const real q = ratio.q;
  const real excess = q - ratio.r;
  const real P_0 = power_at_rest(block, a);

  power_chord chord;
  const real range = larger(set->force_max - set->force_min, TINY);
  chord.slope = (set->cost_at_max - set->cost_at_min) / range;
  const real v = (price[0] + excess * chord.slope) / q;
  const line_response lift = fl_limited_response(block, a, set, 1, v); /* y = T(v), with P_0 + P */
  const real P = v * lift.force - lift.conjugate - P_0;
  chord.at_lift = set->cost_at_min - P_0 + chord.slope * (lift.force - set->force_min);
  chord.at_zero = set->cost_at_min - P_0 - chord.slope * set->force_min;

  const real dy = lift.slope / q; /* dy/ds_1 */
  const real D_y = (ratio.dq * v + (1 - ratio.dq) * chord.slope) / U;
  const real softening = (chord.at_lift - P) * ratio.ddq / (U * U);

  response y;
  y.force[0] = lift.force;
  y.force[1] = (ratio.dq * P + (1 - ratio.dq) * chord.at_lift) / U;
  y.xx = dy;
  y.xy = dy * D_y;
  y.yy = dy * D_y * D_y + softening;
  y.conjugate = q * (lift.conjugate + P_0) + excess * chord.at_zero - P_0;
  y.angle = 0;
  return y;
}

/* The response of a foil near to a command, Eq. 24: a step d [rad] of its angle from there, where
   the force is y_0 + d y' and the cost c_0 + d c' + d^2 c'' / 2. */
static response tangent_response(const fl_set *set, const real *price) {
  const fl_tangent *t = set->tangent;
  const real gain = dot(price, t->force_slope, 2) - t->cost_slope; /* s.y' - c' [W/rad] */
  const real d = clipped(gain / t->curvature, set->force_min, set->force_max);
  real dd = 0; /* derivative of d by the gain; 0 at the limits */
  if (d > set->force_min && d < set->force_max) dd = 1 / t->curvature;
  const real x = t->force_slope[0];
  const real y = t->force_slope[1];
  response o;
  o.force[0] = t->force[0] + d * x;
  o.force[1] = t->force[1] + d * y;
  o.xx = dd * x * x;
  o.xy = dd * x * y;
  o.yy = dd * y * y;
  o.conjugate = dot(price, t->force, 2) + d * (gain - d * t->curvature / 2) - t->cost;
  o.angle = 0;
  return o;
}

/* The response of an actuator within a set to the price (2,) of its force [W/N]. */
response fl_response(const real *block, int i, const fl_set *set, const real *price) {
  const fl_actuator *a = ACTUATOR(block, i);
  if (a->rows == 1) {
    const line_response line = fl_limited_response(block, a, set, 1, price[0]);
    return (response){{line.force, 0}, line.slope, 0, 0, line.conjugate, 0};
  }
  if (set->tangent) return tangent_response(set, price);
  if (is_foil(a)) return foil_response(block, a, set, price);
  if (set->turn_cost > 0) return fl_response_with_turning(block, i, set, price);
  return plane_response(block, i, set, price);
}

/* Drag [N], beyond that at rest, of a foil's lift [N]. */
real fl_drag_of_lift(const real *block, int i, real force) {
  const fl_actuator *a = ACTUATOR(block, i);
  if (!is_foil(a)) return 0;
  return (fl_power_of_force(block, i, force) - power_at_rest(block, a)) / a->flow_speed;
}

/* Lift and drag of a foil that are worth most at a price, whatever their power. Where drag is dear
   that is a response to the price of lift over that of drag; else one end of the lift. */
static void farthest_foil(const real *block, int i, const fl_set *set, const real *price,
                          wide *force) {
  const fl_actuator *a = ACTUATOR(block, i);
  const real drag_cost = -price[1];
  real lift;
  if (drag_cost > 0) {
    lift = fl_limited_response(block, a, set, 1, price[0] * a->flow_speed / drag_cost).force;
  } else {
    const real drag_low = fl_drag_of_lift(block, i, set->force_min);
    const real drag_high = fl_drag_of_lift(block, i, set->force_max);
    const real worth_low = price[0] * set->force_min - drag_cost * drag_low;
    const real worth_high = price[0] * set->force_max - drag_cost * drag_high;
    lift = set->force_min;
    if (worth_high > worth_low) lift = set->force_max;
  }
  force[0] = lift;
  force[1] = fl_drag_of_lift(block, i, lift);
}

/* The direction in which a plane's farthest force lies: of an uneven fin beyond an end of its arc
   the farther end may be worth more. */
static push_direction farthest_direction(const real *block, int i, const fl_set *set,
                                         const real *price) {
  const int is_unpriced = size_of(price) * size_of(price) <= TINY;
  if (is_unpriced) { /* any force will do, but it must be one of the set */
    const real middle[2] = {set->cos_center, set->sin_center};
    push_direction any = direction_of(block, i, set, middle, TINY);
    any.v = 0;
    return any;
  }
  const push_direction g = direction_of(block, i, set, price, TINY);
  if (g.is_beyond) {
    const push_direction end = end_of_arc(block, i, set, g.other_end, price);
    if (end.v > g.v) return end;
  }
  return g;
}

/* The force of a set that is worth most at a price (2,), whatever its power: what of it adds to the
   support function of Eq. 12. Returns the price along it [W/N], of planes that push either way
   along what they push ahead. `slope` (3,) becomes the derivative of the force by the price, xx, xy
   and yy [N^2/W], of planes alone; 0 for none. */
real fl_support_of_set(const real *block, int i, const fl_set *set, const real *price, wide *force,
                       real *slope) {
  const fl_actuator *a = ACTUATOR(block, i);
  force[1] = 0;
  if (slope) memset(slope, 0, 3 * sizeof *slope);
  if (a->rows == 1) {
    force[0] = set->force_min;
    if (price[0] > 0) force[0] = set->force_max;
    return price[0];
  }
  if (has_arc(set)) {
    fl_farthest_on_arc(set, price, force);
    return price[0];
  }
  if (is_foil(a)) {
    farthest_foil(block, i, set, price, force);
    return price[0];
  }
  const push_direction g = farthest_direction(block, i, set, price);
  real size = set->force_min;
  if (g.v > 0) size = set->force_max;
  force[0] = g.x;
  force[1] = g.y;
  /* Without a gauge its length is 1 but for rounding, which would be that of the set: a step of
     Newton's method for the inverse root takes it off. */
  wide length_squared = 1;
  if (!has_gauge(a, set)) length_squared = dot_wide(force, force, 2);
  const wide times = size / 2 * (3 - length_squared);
  force[0] *= times;
  force[1] *= times;
  if (slope) {
    slope[0] = size * g.xx;
    slope[1] = size * g.xy;
    slope[2] = size * g.yy;
  }
  if (set->force_max_reverse > 0) {
    const fl_set reversed = fl_reversed_set(set);
    wide other[2];
    real other_slope[3];
    const real v = fl_support_of_set(block, i, &reversed, price, other, other_slope);
    if (v > 0 && reversed.force_max * v > size * g.v) {
      force[0] = other[0];
      force[1] = other[1];
      if (slope) memcpy(slope, other_slope, sizeof other_slope);
    }
  }
  return g.v;
}

/* Whether a plane that pushes either way responds rather ahead than in reverse, and how far its
   blend is from that force: `off` [N]. */
int fl_undecided(const real *block, int i, const fl_set *set, const real *price, real *off) {
  const fl_set reversed = fl_reversed_set(set);
  const response ahead = sector_response(block, i, set, price);
  const response reverse = sector_response(block, i, &reversed, price);
  const real delta = ahead.conjugate - reverse.conjugate;
  const real omega = blend_width(reversed.cost_at_max);
  const real root = SQRT(delta * delta + omega * omega);
  const real p = (1 + delta / root) / 2; /* Eq. 26 */
  const real dx = ahead.force[0] - reverse.force[0];
  const real dy = ahead.force[1] - reverse.force[1];
  *off = smaller(p, 1 - p) * SQRT(dx * dx + dy * dy);
  return p >= R(0.5);
}
