/* Answers of one actuator to a price: the force that is worth most, less its power, and its derivative.

   A line answers T(|s|) sign(s), a plane T(v) g with v = s.g and g the direction of the force. Where it may
   choose between two answers, the ends of a wide arc or the two ways of a pod, it gives a blend of both: what
   the smooth larger one of their conjugates asks for. A foil gives lift and with it drag; with drag paid a
   [W/N], lift is as dear as r = 1 - a/U times its power: it answers v as v/r. Where r < 0 drag is welcome:
   then r is softened to s(r) > 0, and (s - r) times the chord of the power is on top of the conjugate. */
#include "internal.h"

#define SOFT R(0.2)

typedef struct { real along, x, y, xx, xy, yy, other; int beyond; } fan;

static real gauge_or_one(const real *gauge, real angle) { return gauge ? fl_gauge_radius(gauge, angle) : 1; }

/* The direction in which a plane answers a price, with its gauge, and how it turns. */
static fan direction_of(const fl_set *set, const real *gauge, const real *price, real gap2) {
  real size = SQRT(price[0] * price[0] + price[1] * price[1] + gap2), x = price[0] / size, y = price[1] / size;
  real tangent = 1 / size;
  fan o = {size, x, y, 0, 0, 0, 0, 0};
  if (gauge) {
    gauge_point s = fl_gauge_support(gauge, x, y);
    o.x = s.value * x - s.slope * y, o.y = s.value * y + s.slope * x;
    tangent *= MAX(s.value + s.bend, 0);
    o.along *= s.value;
  }
  if (set->half < PI) {
    real c = set->cos_middle, d = set->sin_middle, ahead = o.x * c + o.y * d, aside = o.y * c - o.x * d;
    if (FABS(aside) * set->cos_half > ahead * set->sin_half) {
      /* The nearer end by the price itself: by the force, both are alike where the arc has no width. */
      real nearer = price[1] * c - price[0] * d < 0 ? -1 : 1, end = set->middle + nearer * set->half;
      real rho = gauge_or_one(gauge, end);
      o.x = rho * COS(end), o.y = rho * SIN(end);
      o.along = price[0] * o.x + price[1] * o.y;
      o.beyond = 1, o.other = set->middle - nearer * set->half;
      tangent = 0;
    }
  }
  o.xx = tangent * (1 - x * x), o.xy = -tangent * x * y, o.yy = tangent * (1 - y * y);
  return o;
}

/* Blends an answer with another one, in a width [W] of their conjugates. */
static void blend(response *own, const response *other, real width) {
  real ahead = own->conjugate - other->conjugate, root = SQRT(ahead * ahead + width * width);
  real share = (1 + ahead / root) / 2, rest = 1 - share, turn = width * width / (2 * root * root * root);
  real dx = own->force[0] - other->force[0], dy = own->force[1] - other->force[1];
  own->force[0] = share * own->force[0] + rest * other->force[0];
  own->force[1] = share * own->force[1] + rest * other->force[1];
  own->xx = share * own->xx + rest * other->xx + turn * dx * dx;
  own->xy = share * own->xy + rest * other->xy + turn * dx * dy;
  own->yy = share * own->yy + rest * other->yy + turn * dy * dy;
  own->conjugate += (root - ahead) / 2;
}

static response along_fan(line_response o, const fan *f) {
  return (response){{o.force * f->x, o.force * f->y},
                 o.slope * f->x * f->x + o.force * f->xx,
                 o.slope * f->x * f->y + o.force * f->xy,
                 o.slope * f->y * f->y + o.force * f->yy,
                 o.conjugate, 0};
}

static response one_way(const real *block, const fl_actuator *a, const fl_set *set, const real *gauge,
                     const real *price) {
  fan f = direction_of(set, gauge, price, set->gap2);
  response own = along_fan(fl_limited_response(block, a, set, 0, f.along), &f);
  if (set->forked && f.beyond) {
    real rho = gauge_or_one(gauge, f.other);
    fan g = {0, rho * COS(f.other), rho * SIN(f.other), 0, 0, 0, 0, 0};
    response other = along_fan(fl_limited_response(block, a, set, 0, price[0] * g.x + price[1] * g.y), &g);
    blend(&own, &other, FINE * set->high_cost + R(1e-12));
  }
  return own;
}

static response plane(const real *block, const fl_actuator *a, const fl_set *set, const real *price) {
  response own = one_way(block, a, set, a->gauge > 0 ? block + (int)a->gauge : 0, price);
  if (set->reverse > 0) {
    fl_set back = fl_reversed_set(set);
    response other = one_way(block, a, &back, 0, price);
    blend(&own, &other, FINE * back.high_cost + R(1e-12));
  }
  return own;
}

static real rest_of(const real *block, const fl_actuator *a) { return a->worth * block[(int)a->ahead + 2]; }

static response foil(const real *block, const fl_actuator *a, const fl_set *set, const real *price) {
  real ratio = 1 - price[1] / a->speed, below = MIN(ratio / SOFT - 1, 0), power = EXP(below);
  real rate = power > CLOSE ? power : 0, soft = below < 0 ? SOFT * MAX(power, CLOSE) : ratio;
  real rise = (set->high_cost - set->low_cost) / MAX(set->high - set->low, TINY);
  real bend = below < 0 ? rate / SOFT : 0, rest = rest_of(block, a), own = (price[0] + (soft - ratio) * rise) / soft;
  line_response o = fl_limited_response(block, a, set, 1, own);
  real cost = own * o.force - o.conjugate - rest, most = set->low_cost - rest + rise * (o.force - set->low);
  o.conjugate = soft * (o.conjugate + rest) + (soft - ratio) * (set->low_cost - rest - rise * set->low) - rest;
  o.slope /= soft;
  real lean = (rate * own + (1 - rate) * rise) / a->speed;
  return (response){{o.force, (rate * cost + (1 - rate) * most) / a->speed},
                 o.slope,
                 o.slope * lean,
                 o.slope * lean * lean + (most - cost) * bend / (a->speed * a->speed),
                 o.conjugate, 0};
}

static response on_tangent(const fl_set *set, const real *price) {
  const fl_tangent *t = set->tangent;
  real gain = dot(price, t->slope, 2) - t->pay, step = CLIP(gain / t->bend, set->low, set->high);
  real x = t->slope[0], y = t->slope[1], free = step > set->low && step < set->high ? 1 / t->bend : 0;
  return (response){{t->force[0] + step * x, t->force[1] + step * y}, free * x * x, free * x * y, free * y * y,
                 dot(price, t->force, 2) + step * (gain - step * t->bend / 2) - t->cost, 0};
}

response fl_response(const real *block, int i, const fl_set *set, const real *price) {
  const fl_actuator *a = ACTUATOR(block, i);
  if (a->rows == 1) {
    line_response o = fl_limited_response(block, a, set, 1, price[0]);
    return (response){{o.force, 0}, o.slope, 0, 0, o.conjugate, 0};
  }
  if (set->tangent) return on_tangent(set, price);
  if (a->speed > 0) return foil(block, a, set, price);
  if (set->turn > 0) return fl_response_with_turning(block, i, set, price);
  return plane(block, a, set, price);
}

/* Drag [N], beyond that at rest, of a foil's lift [N]. */
real fl_drag_of_lift(const real *block, int i, real force) {
  const fl_actuator *a = ACTUATOR(block, i);
  return a->speed > 0 ? (fl_power_of_force(block, i, force) - rest_of(block, a)) / a->speed : 0;
}

static void farthest_foil(const real *block, int i, const fl_set *set, const real *price, wide *force) {
  const fl_actuator *a = ACTUATOR(block, i);
  real cost = -price[1];
  if (cost > 0)
    force[0] = fl_limited_response(block, a, set, 1, price[0] * a->speed / cost).force;
  else {
    real low = price[0] * set->low - cost * fl_drag_of_lift(block, i, set->low);
    force[0] = price[0] * set->high - cost * fl_drag_of_lift(block, i, set->high) > low ? set->high : set->low;
  }
  force[1] = fl_drag_of_lift(block, i, (real)force[0]);
}

/* The force that is worth most at a price, whatever its power; returns the price along it, of planes that push either
   way along what they push ahead. */
real fl_support_of_set(const real *block, int i, const fl_set *set, const real *price, wide *force) {
  const fl_actuator *a = ACTUATOR(block, i);
  force[1] = 0;
  if (a->rows == 1) {
    force[0] = price[0] > 0 ? set->high : set->low;
    return price[0];
  }
  if (a->speed > 0) {
    farthest_foil(block, i, set, price, force);
    return price[0];
  }
  const real *gauge = a->gauge > 0 ? block + (int)a->gauge : 0;
  const real middle[2] = {set->cos_middle, set->sin_middle};
  const int is_free = size_of(price) * size_of(price) <= TINY; /* then any force will do, but it must be one of the set */
  fan f = direction_of(set, gauge, is_free ? middle : price, TINY);
  if (is_free) f.along = 0;
  if (f.beyond) { /* of an uneven fin the farther end may be worth more */
    const real rho = gauge_or_one(gauge, f.other);
    const real other[2] = {rho * COS(f.other), rho * SIN(f.other)};
    const real along = dot(price, other, 2);
    if (along > f.along) {
      f.along = along;
      f.x = other[0];
      f.y = other[1];
    }
  }
  real size = f.along > 0 ? set->high : set->low;
  force[0] = f.x, force[1] = f.y;
  wide length = a->gauge > 0 ? 1 : product(force, force, 2); /* 1 but for rounding, which would be that of the set */
  wide times = size / 2 * (3 - length);
  force[0] *= times, force[1] *= times;
  if (set->reverse > 0) {
    fl_set back = fl_reversed_set(set);
    wide other[2];
    real along = fl_support_of_set(block, i, &back, price, other);
    if (along > 0 && back.high * along > size * f.along) force[0] = other[0], force[1] = other[1];
  }
  return f.along;
}

/* Whether a plane that pushes either way answers rather forward, and how far [N] its blend is from that. */
int fl_undecided(const real *block, int i, const fl_set *set, const real *price, real *off) {
  const fl_actuator *a = ACTUATOR(block, i);
  fl_set back = fl_reversed_set(set);
  response ahead = one_way(block, a, set, 0, price), other = one_way(block, a, &back, 0, price);
  real gain = ahead.conjugate - other.conjugate, width = FINE * back.high_cost + R(1e-12);
  real share = (1 + gain / SQRT(gain * gain + width * width)) / 2;
  real dx = ahead.force[0] - other.force[0], dy = ahead.force[1] - other.force[1];
  *off = MIN(share, 1 - share) * SQRT(dx * dx + dy * dy);
  return share >= R(0.5);
}
