/* The answer of a pod to a price where turning costs, from tick to tick.

   The force is y = r b(alpha) with b = (cos alpha, sin alpha), and r between the least and the largest force, below 0 in
   reverse. At a price s = p (cos sigma, sin sigma) a newton at the angle alpha is worth v = s.b = p cos(alpha - sigma), and
   the best size is T(v), worth C(v) = max over r of v r - c(r). Turning from alpha- by d = alpha - alpha- costs
   kappa / 2 d^2:

       value     h(alpha)  = C(v) - kappa / 2 d^2         c*(s) = max over alpha in the window
       slope     h'        = T v' - kappa d
       bend      h''       = T' v'^2 + T v'' - kappa
       gradient  grad c*(s) = y = T b                     (envelope)
       Hessian   T' b b' + m m' / (-h'')   inside the window,  m = T' v' b + T b'
                 T' b b'                   at its ends

   Where kappa is large beside p T, h is concave and there is one answer: a pod that pushes either way passes through rest
   without turning. A bound of h'' proves it for most prices, and Newton's method then goes uphill from anywhere. Else
   there may be two maxima, which are looked for in cells of the window, and the answer jumps between them as the price
   moves: dual_newton.c sees it. */
#include "internal.h"

#define CELL R(0.12)   /* width [rad] of the cells of a window in which h' is taken to change its sign once at most */
#define MOST_CELLS 48
#define ROOT_STEPS 60  /* of a root of h' in a cell */
#define SHORT_STEP (SQRT(ROUNDING)) /* [rad]: what such a step leaves out beyond first order is rounding */

typedef struct { /* one pod at one price */
  const real *block;
  const fl_actuator *a;
  const fl_set *set;
  real price[2];
} pod_at_price;

typedef struct { /* what the pod gives at one angle */
  real alpha;
  real b[2];               /* direction of the angle */
  real value, slope, bend; /* h, h', h'' */
  real T, dT;              /* best force, and its derivative by the price along it */
  real v, dv;              /* v, v' */
} at_angle;

/* Best force along a direction at a price v of a newton along it: a pod that pushes either way is a line there. */
static line_response best_along(const pod_at_price *x, real v) {
  const fl_set *set = x->set;
  const int is_line = set->reverse > 0;
  if (is_line || v >= 0) return fl_limited_response(x->block, x->a, set, is_line, v);
  return (line_response){set->low, 0, v * set->low - set->low_cost};
}

/* What the pod gives at an angle (cos, sin). */
static void look_towards(const pod_at_price *x, real alpha, real c, real s, at_angle *o) {
  o->alpha = alpha;
  o->b[0] = c;
  o->b[1] = s;
  const real v = x->price[0] * c + x->price[1] * s;
  const real dv = x->price[1] * c - x->price[0] * s;
  const real ddv = -v;
  const line_response best = best_along(x, v);
  const real kappa = x->set->turn;
  const real d = alpha - x->set->at;
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

/* Goes from an angle to the root of h' between two angles at which it is above 0 and not above 0: Newton's method, kept
   in the bracket. Where the ends are open, nobody has looked there, and h' may have one sign up to an end, which is the
   answer then. */
static void go_to_root(const pod_at_price *x, at_angle *o, real low, real high, int is_open) {
  for (int k = 0; k < ROOT_STEPS; k++) {
    if (o->slope > 0)
      low = o->alpha;
    else
      high = o->alpha;
    real next = (low + high) / 2;
    if (o->bend < 0) {
      const real newton = o->alpha - o->slope / o->bend;
      const int is_within = newton >= low && newton <= high;
      if (is_within)
        next = newton;
      else if (is_open) {
        next = o->slope > 0 ? high : low;
        is_open = 0;
      }
    }
    const real step = next - o->alpha;
    if (FABS(step) <= SHORT_STEP) {
      turn_a_little(o, step);
      o->alpha = next;
      return;
    }
    look_at(x, next, o);
  }
}

/* The least and largest angles of the window, around the angle before. */
static void window_of(const fl_set *set, real *low, real *high) {
  *low = set->middle - set->half;
  *high = set->middle + set->half;
  if (set->half >= PI) {
    *low = set->at - PI;
    *high = set->at + PI;
  }
}

/* Whether h is concave all over the window: only T' v'^2 can bend it up, and T v'' of a least force that is held against
   the price. At the start v' is known, and it changes by the price times the angle at most. */
static int is_concave(const pod_at_price *x, const at_angle *start, real farthest) {
  const fl_set *set = x->set;
  const real p = size_of(x->price);
  const real most_dv = MIN(FABS(start->dv) + p * farthest, p);
  const real least_v = MAX(start->v - p * farthest, -p);
  const real held = set->low > 0 ? set->low * MAX(-least_v, 0) : 0;
  return set->steepest * most_dv * most_dv + held < set->turn;
}

/* The largest h of any window, by cells. */
static void go_to_best_cell(const pod_at_price *x, at_angle *best, real low, real high) {
  at_angle before;
  at_angle after;
  look_at(x, CLIP(x->set->at, low, high), best);
  look_at(x, low, &before);
  if (before.slope <= 0 && before.value > best->value) *best = before;
  const int cells = (int)CLIP((high - low) / CELL + 2, 2, MOST_CELLS);
  for (int k = 1; k <= cells && high > low; k++) {
    const real to = k == cells ? high : low + (high - low) * (real)k / (real)cells;
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

response fl_response_with_turning(const real *block, int i, const fl_set *set, const real *price) {
  fl_set signed_set = *set; /* its least force is the largest one in reverse */
  if (set->reverse > 0) {
    signed_set.low = -set->reverse;
    signed_set.low_cost = set->reverse_cost;
  }
  const pod_at_price x = {block, ACTUATOR(block, i), &signed_set, {price[0], price[1]}};
  real low, high;
  window_of(set, &low, &high);
  at_angle best;
  if (set->half < PI)
    look_towards(&x, set->middle, set->cos_middle, set->sin_middle, &best);
  else
    look_at(&x, set->at, &best);
  if (is_concave(&x, &best, MIN(set->half, PI)))
    go_to_root(&x, &best, low, high, 1);
  else
    go_to_best_cell(&x, &best, low, high);

  /* Eq. of the head: y = T b, and its derivatives by the price. */
  const real *b = best.b;
  const real db[2] = {-b[1], b[0]};
  const real m[2] = {best.dT * best.dv * b[0] + best.T * db[0], best.dT * best.dv * b[1] + best.T * db[1]};
  const real edge = ROUNDING * (1 + FABS(best.alpha)); /* a pod that stands at an end of its arc may be off by rounding */
  const int is_inside = best.alpha > low + edge && best.alpha < high - edge;
  real over = 0;
  if (is_inside && best.bend < 0) {
    const real least = NOTHING * (set->turn + FABS(best.T) * size_of(price)) + TINY;
    over = 1 / MAX(-best.bend, least);
  }
  response o;
  o.force[0] = best.T * b[0];
  o.force[1] = best.T * b[1];
  o.xx = best.dT * b[0] * b[0] + over * m[0] * m[0];
  o.xy = best.dT * b[0] * b[1] + over * m[0] * m[1];
  o.yy = best.dT * b[1] * b[1] + over * m[1] * m[1];
  o.conjugate = best.value;
  o.angle = best.alpha;
  return o;
}

/* Whether the answer of a pod jumps between two prices near to each other: its force changes sides, or moves by far more
   than its slopes at both say. `step` is the step of its price, `is_short` whether that is very short. */
int fl_has_jumped(const real *block, int i, const fl_set *set, const fl_state *one, const fl_state *other,
               const real *step, int is_short) {
  const real top = ACTUATOR(block, i)->most[0];
  const real *y = one->force[i];
  const real *z = other->force[i];
  const real way[2] = {z[0] - y[0], z[1] - y[1]};
  const real moved = size_of(way);
  const real size_y = y[0] * COS(one->angle[i]) + y[1] * SIN(one->angle[i]);
  const real size_z = z[0] * COS(other->angle[i]) + z[1] * SIN(other->angle[i]);
  const int is_two_sided = set->reverse > 0;
  const int starts = (size_y == 0) != (size_z == 0);
  if (moved > R(1e-3) * top && (size_y * size_z < 0 || (starts && is_two_sided))) return 1;
  if (!is_short || !(moved > FINE * top)) return 0;
  const real *p = one->slope[i];
  const real *q = other->slope[i];
  const real off_y[2] = {way[0] - p[0] * step[0] - p[1] * step[1], way[1] - p[1] * step[0] - p[2] * step[1]};
  const real off_z[2] = {way[0] - q[0] * step[0] - q[1] * step[1], way[1] - q[1] * step[0] - q[2] * step[1]};
  return size_of(off_y) > moved / 2 && size_of(off_z) > moved / 2;
}

/* Marks a pod whose answer jumps, and where it is to be cut. */
void fl_mark_jump(fl_set *set, real one, real other) {
  real low, high;
  window_of(set, &low, &high);
  set->jumps = 1;
  set->cut = (one + other) / 2;
  if (FABS(one - other) < NEARLY * (high - low)) set->cut = (low + high) / 2;
}
