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
   without turning. Else there may be two maxima, and the answer jumps between them as the price moves: dual_newton.c sees it. */
#include "internal.h"

#define CELL R(0.12)   /* width [rad] of the cells of a window in which h' is taken to change its sign once at most */
#define MOST_CELLS 48
#define ROOT_STEPS 60  /* of a root of h' in a cell */

typedef struct { /* one pod at one price */
  const real *block;
  const fl_actuator *a;
  const fl_set *set;
  real p, sigma; /* size and angle of the price */
} pod_at_price;

typedef struct { /* what the pod gives at one angle */
  real value, slope, bend; /* h, h', h'' */
  real T, dT;              /* best force, and its derivative by the price along it */
  real dv;                 /* v' */
} at_angle;

/* Best force along a direction at a price v of a newton along it: ahead, or in reverse where it pushes either way. */
static line_response best_along(const pod_at_price *x, real v) {
  const fl_set *set = x->set;
  if (v >= 0) return fl_limited_response(x->block, x->a, set, 0, v);
  if (set->reverse > 0) {
    const fl_set back = fl_reversed_set(set);
    line_response o = fl_limited_response(x->block, x->a, &back, 0, -v);
    o.force = -o.force;
    return o;
  }
  return (line_response){set->low, 0, v * set->low - set->low_cost};
}

static at_angle look_at(const pod_at_price *x, real alpha) {
  at_angle o;
  const real v = x->p * COS(alpha - x->sigma);
  const real ddv = -v;
  o.dv = -x->p * SIN(alpha - x->sigma);
  const line_response best = best_along(x, v);
  const real kappa = x->set->turn;
  const real d = alpha - x->set->at;
  o.T = best.force;
  o.dT = best.slope;
  o.value = best.conjugate - kappa / 2 * d * d;
  o.slope = o.T * o.dv - kappa * d;
  o.bend = o.dT * o.dv * o.dv + o.T * ddv - kappa;
  return o;
}

/* The root of h' between two angles at which it is above 0 and not above 0: Newton's method, kept in the bracket. */
static real root_between(const pod_at_price *x, real low, real high) {
  real alpha = (low + high) / 2;
  for (int k = 0; k < ROOT_STEPS; k++) {
    const at_angle o = look_at(x, alpha);
    if (o.slope > 0)
      low = alpha;
    else
      high = alpha;
    real next = (low + high) / 2;
    if (o.bend < 0) {
      const real newton = alpha - o.slope / o.bend;
      if (newton > low && newton < high) next = newton;
    }
    const real moved = FABS(next - alpha);
    alpha = next;
    if (moved <= 4 * ROUNDING * R(0.01) * (1 + FABS(alpha))) break;
  }
  return alpha;
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

response fl_response_with_turning(const real *block, int i, const fl_set *set, const real *price) {
  const fl_actuator *a = ACTUATOR(block, i);
  pod_at_price x = {block, a, set, size_of(price), 0};
  if (x.p > 0) x.sigma = ATAN2(price[1], price[0]);

  real low, high;
  window_of(set, &low, &high);
  real best_alpha = CLIP(set->at, low, high);
  at_angle best = look_at(&x, best_alpha);
  const int cells = (int)CLIP((high - low) / CELL + 2, 2, MOST_CELLS);
  real from = low;
  at_angle before = look_at(&x, from);
  if (before.slope <= 0 && before.value > best.value) {
    best = before;
    best_alpha = from;
  }
  for (int k = 1; k <= cells && high > low; k++) {
    const real to = k == cells ? high : low + (high - low) * (real)k / (real)cells;
    const at_angle after = look_at(&x, to);
    if (before.slope > 0 && after.slope <= 0) {
      const real alpha = root_between(&x, from, to);
      const at_angle top = look_at(&x, alpha);
      if (top.value > best.value) {
        best = top;
        best_alpha = alpha;
      }
    }
    from = to;
    before = after;
  }
  if (before.slope > 0 && before.value > best.value) {
    best = before;
    best_alpha = high;
  }

  /* Eq. of the head: y = T b, and its derivatives by the price. */
  const real c = COS(best_alpha);
  const real s = SIN(best_alpha);
  const real b[2] = {c, s};
  const real db[2] = {-s, c};
  const real m[2] = {best.dT * best.dv * b[0] + best.T * db[0], best.dT * best.dv * b[1] + best.T * db[1]};
  const int is_inside = best_alpha > low && best_alpha < high;
  real over = 0;
  if (is_inside && best.bend < 0) {
    const real least = NOTHING * (set->turn + FABS(best.T) * x.p) + TINY;
    over = 1 / MAX(-best.bend, least);
  }
  response o;
  o.force[0] = best.T * b[0];
  o.force[1] = best.T * b[1];
  o.xx = best.dT * b[0] * b[0] + over * m[0] * m[0];
  o.xy = best.dT * b[0] * b[1] + over * m[0] * m[1];
  o.yy = best.dT * b[1] * b[1] + over * m[1] * m[1];
  o.conjugate = best.value;
  o.angle = best_alpha;
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
