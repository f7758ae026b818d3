/* The response of a pod to a price where turning costs, from tick to tick: Eq. 16 and 17.

   The force is y = T b(alpha) with b = (cos alpha, sin alpha), and T between the least and the
   largest force, below 0 in reverse. At a price s = p (cos theta, sin theta) a newton at the angle
   alpha is worth v = s.b = p cos(alpha - theta), and the best size is T(v), worth
   C(v) = max over T of v T - c(T). Turning from alpha- by d = alpha - alpha- costs kappa / 2 d^2:

       value     h(alpha)  = C(v) - kappa / 2 d^2         c*(s) = max over alpha in the window
       slope     h'        = T v' - kappa d
       bend      h''       = T' v'^2 + T v'' - kappa
       gradient  grad c*(s) = y = T b                     (envelope)
       Hessian   T' b b' + m m' / (-h'')   inside the window,  m = T' v' b + T b'
                 T' b b'                   at its ends

   Where kappa is large beside p T, h is concave and there is one response: a pod that pushes
   either way passes through rest without turning. A bound of h'' proves it for most prices, and
   Newton's method then goes uphill from anywhere. Else there may be two maxima, which are looked
   for in cells of the window, and the response jumps between them as the price moves:
   dual_newton.c sees it. */
#include "internal.h"

/* Width [rad] of the cells of a window in which h' is taken to change its sign once at most. */
#define CELL R(0.12)
#define MOST_CELLS 48
#define ROOT_STEPS 60 /* of a root of h' in a cell */
/* Of a step of Newton's method on the angle [rad]: what so short a turn leaves out beyond first
   order is rounding. */
#define SHORT_TURN (SQRT(ROUNDING))
#define SIDE R(1e-3) /* of the largest force: a change of sides that is no rounding around rest */

/* One pod at one price. */
typedef struct {
  const real *block;
  const fl_actuator *a;
  const fl_set *set;
  real price[2]; /* s [W/N] */
} pod_at_price;

/* What the pod gives at one angle. */
typedef struct {
  real alpha; /* [rad] */
  real b[2];  /* direction of the angle */
  real value; /* h [W] */
  real slope; /* h' */
  real bend;  /* h'' */
  real T, dT; /* best size [N], and its derivative T' by the price along it */
  real v, dv; /* price along the direction [W/N], and its derivative v' by the angle */
} at_angle;

/* Best size along a direction at a price v along it: a pod that pushes either way is a line
   there. */
static line_response best_along(const pod_at_price *x, real v) {
  const fl_set *set = x->set;
  const int is_line = set->force_max_reverse > 0;
  if (is_line || v >= 0) return fl_limited_response(x->block, x->a, set, is_line, v);
  return (line_response){set->force_min, 0, v * set->force_min - set->cost_at_min};
}

/* What the pod gives at an angle whose cosine and sine are c and s. */
static void look_towards(const pod_at_price *x, real alpha, real c, real s, at_angle *o) {
  o->alpha = alpha;
  o->b[0] = c;
  o->b[1] = s;
  const real v = x->price[0] * c + x->price[1] * s;
  const real dv = x->price[1] * c - x->price[0] * s;
  const real ddv = -v;
  const line_response best = best_along(x, v);
  const real kappa = x->set->turn_cost;
  const real d = alpha - x->set->turn_origin;
  o->v = v;
  o->dv = dv;
  o->T = best.force;
  o->dT = best.slope;
  o->value = best.conjugate - kappa / 2 * d * d;
  o->slope = o->T * dv - kappa * d;
  o->bend = o->dT * dv * dv + o->T * ddv - kappa;
}

static void look_at(const pod_at_price *x, real alpha, at_angle *o) {
  look_towards(x, alpha, COS(alpha), SIN(alpha), o);
}

/* Turns by a very short step: what it gives to first order, h to second; slopes hardly change. */
static void turn_a_little(at_angle *o, real step) {
  const real c = o->b[0];
  const real s = o->b[1];
  o->b[0] = c - step * s;
  o->b[1] = s + step * c;
  o->T += o->dT * o->dv * step;
  o->value += o->slope * step / 2;
}

/* Goes from an angle to the root of h' between two angles at which it is above 0 and not above 0:
   Newton's method, kept in the bracket. Where the ends are open, nobody has looked there, and h'
   may have one sign up to an end, which is the response then. */
static void go_to_root(const pod_at_price *x, at_angle *o, real low, real high, int is_open) {
  for (int k = 0; k < ROOT_STEPS; k++) {
    if (o->slope > 0) {
      low = o->alpha;
    } else {
      high = o->alpha;
    }
    real next = (low + high) / 2;
    if (o->bend < 0) {
      const real newton = o->alpha - o->slope / o->bend;
      const int is_within = newton >= low && newton <= high;
      if (is_within) {
        next = newton;
      } else if (is_open) {
        next = low;
        if (o->slope > 0) next = high;
        is_open = 0;
      }
    }
    const real step = next - o->alpha;
    if (FABS(step) <= SHORT_TURN) {
      turn_a_little(o, step);
      o->alpha = next;
      return;
    }
    look_at(x, next, o);
  }
}

/* The least and largest angles [rad] of the window: its arc, or a turn around the angle before. */
static void window_of(const fl_set *set, real *low, real *high) {
  *low = set->sector_center - set->sector_half_angle;
  *high = set->sector_center + set->sector_half_angle;
  if (set->sector_half_angle >= PI) {
    *low = set->turn_origin - PI;
    *high = set->turn_origin + PI;
  }
}

/* Whether h is concave all over the window: only T' v'^2 can bend it up, and T v'' of a least force
   that is held against the price. At the start v' is known, and it changes by the price times the
   angle at most; `farthest` is how far the window reaches from there [rad]. */
static int is_concave(const pod_at_price *x, const at_angle *start, real farthest) {
  const fl_set *set = x->set;
  const real p = size_of(x->price);
  const real most_dv = smaller(FABS(start->dv) + p * farthest, p);
  const real least_v = larger(start->v - p * farthest, -p);
  real held = 0; /* T v'' of the least force */
  if (set->force_min > 0) held = set->force_min * larger(-least_v, 0);
  const real kappa = set->turn_cost;
  return set->slope_max * most_dv * most_dv + held < kappa;
}

/* Goes to the largest h of any window: the best of its ends, of the angle from which the pod turns,
   and of the roots of h' that cells show by a change of its sign. */
static void go_to_best_cell(const pod_at_price *x, at_angle *best, real low, real high) {
  at_angle before;
  look_at(x, clipped(x->set->turn_origin, low, high), best);
  look_at(x, low, &before);
  if (before.slope <= 0 && before.value > best->value) *best = before;
  const int cells = (int)clipped((high - low) / CELL + 2, 2, MOST_CELLS);
  for (int k = 1; k <= cells && high > low; k++) {
    real to = high;
    if (k < cells) to = low + (high - low) * (real)k / (real)cells;
    at_angle after;
    look_at(x, to, &after);
    if (before.slope > 0 && after.slope <= 0) {
      at_angle top;
      look_at(x, (before.alpha + to) / 2, &top);
      go_to_root(x, &top, before.alpha, to, 0);
      if (top.value > best->value) *best = top;
    }
    before = after;
  }
  if (before.slope > 0 && before.value > best->value) *best = before;
}

/* The angle of the largest h, and what the pod gives there. */
static at_angle best_angle(const pod_at_price *x, real low, real high) {
  const fl_set *set = x->set;
  at_angle best;
  if (set->sector_half_angle < PI) {
    look_towards(x, set->sector_center, set->cos_center, set->sin_center, &best);
  } else {
    look_at(x, set->turn_origin, &best);
  }
  if (is_concave(x, &best, smaller(set->sector_half_angle, PI))) {
    go_to_root(x, &best, low, high, 1);
  } else {
    go_to_best_cell(x, &best, low, high);
  }
  return best;
}

/* The response of a pod within a set to the price (2,) of its force [W/N], where turning costs. */
response fl_response_with_turning(const real *block, int i, const fl_set *set, const real *price) {
  fl_set signed_set = *set; /* its least force is the largest one in reverse */
  if (set->force_max_reverse > 0) {
    signed_set.force_min = -set->force_max_reverse;
    signed_set.cost_at_min = set->cost_at_max_reverse;
  }
  const pod_at_price x = {block, ACTUATOR(block, i), &signed_set, {price[0], price[1]}};
  real low;
  real high;
  window_of(set, &low, &high);
  const at_angle best = best_angle(&x, low, high);

  /* Eq. 17; its second part is left out at the ends of the window. */
  const real *b = best.b;
  const real db[2] = {-b[1], b[0]};
  const real dT_dalpha = best.dT * best.dv;
  const real m[2] = {dT_dalpha * b[0] + best.T * db[0], dT_dalpha * b[1] + best.T * db[1]};
  /* A pod that stands at an end of its arc may be off by rounding. */
  const real edge = ROUNDING * (1 + FABS(best.alpha));
  const int is_inside = best.alpha > low + edge && best.alpha < high - edge;
  real over_bend = 0; /* 1 / -h'' */
  if (is_inside && best.bend < 0) {
    const real least = NOTHING * (set->turn_cost + FABS(best.T) * size_of(price)) + TINY;
    over_bend = 1 / larger(-best.bend, least);
  }
  response y;
  y.force[0] = best.T * b[0];
  y.force[1] = best.T * b[1];
  y.xx = best.dT * b[0] * b[0] + over_bend * m[0] * m[0];
  y.xy = best.dT * b[0] * b[1] + over_bend * m[0] * m[1];
  y.yy = best.dT * b[1] * b[1] + over_bend * m[1] * m[1];
  y.conjugate = best.value;
  y.angle = best.alpha;
  return y;
}

/* The size of what a pod gives in a state, below 0 in reverse [N]. */
static real signed_size(const fl_state *state, int i) {
  const real *y = state->force[i];
  return y[0] * COS(state->push_angle[i]) + y[1] * SIN(state->push_angle[i]);
}

/* How far [N] a force moved beyond what its derivatives (xx, xy, yy) say of a step of its price. */
static real moved_beyond(const real *moved, const real *dy_ds, const real *step) {
  const real beyond[2] = {moved[0] - dy_ds[0] * step[0] - dy_ds[1] * step[1],
                          moved[1] - dy_ds[1] * step[0] - dy_ds[2] * step[1]};
  return size_of(beyond);
}

/* Whether the response of a pod jumps between two states near to each other: its force changes
   sides, or moves by far more than its derivatives at both say. `step` (2,) is the step of its
   price [W/N], `is_short` whether that is very short. */
int fl_has_jumped(const real *block, int i, const fl_set *set, const fl_state *one,
                  const fl_state *other, const real *step, int is_short) {
  const real largest_force = ACTUATOR(block, i)->row_force_max[0];
  const real *y = one->force[i];
  const real *z = other->force[i];
  const real moved[2] = {z[0] - y[0], z[1] - y[1]};
  const real distance = size_of(moved);
  const real size_y = signed_size(one, i);
  const real size_z = signed_size(other, i);
  const int is_two_sided = set->force_max_reverse > 0;
  const int begins_or_ends_at_rest = (size_y == 0) != (size_z == 0);
  const int changes_sides = size_y * size_z < 0 || (begins_or_ends_at_rest && is_two_sided);
  if (distance > SIDE * largest_force && changes_sides) return 1;
  if (!is_short || !(distance > FINE * largest_force)) return 0;
  const real beyond_one = moved_beyond(moved, one->dy_ds[i], step);
  const real beyond_other = moved_beyond(moved, other->dy_ds[i], step);
  return beyond_one > distance / 2 && beyond_other > distance / 2;
}

/* Marks a pod whose response jumps from one angle to another [rad], and where it is to be cut:
   between them, or in the middle of its window where both are the same to rounding. */
void fl_mark_jump(fl_set *set, real one, real other) {
  real low;
  real high;
  window_of(set, &low, &high);
  set->has_jumped = 1;
  set->jump_angle = (one + other) / 2;
  if (FABS(one - other) < NEARLY * (high - low)) set->jump_angle = (low + high) / 2;
}
