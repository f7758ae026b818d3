/* The farthest forces of sets within power budgets (Eq. 30), for ray_reach.c.

       h(m) = min over xi >= 0 of  sum over buses b of  xi_b P_b
              + sum over actuators i of b of  max over y in Y_i of  s_i.y - xi_b c_i(y)

   with the prices s_i = B_i' m. The inner maximum is that of the best side of a set: a force g f
   of it, a share g of one of its largest forces f, costs C(g), so that f is the farthest of them
   and g maximizes g s.f - xi C(g). The power of a bus falls with xi; where it jumps over the
   budget, as where s.f is 0 or C is piecewise linear, a mixture of the forces on both sides of the
   jump takes just the budget, and is as far. */
#include "internal.h"

#ifdef FL_WITH_POWER_SETS

#define XI_FACTOR 1.2 /* from the multiplier that is expected to the one beside it */
#define XI_GROWTH 3   /* of the logarithm of this factor, until two bracket the budget */
#define XI_TRIES 12   /* of these, at most: then it is a factor of 1e42000, or no number */
#define XI_STEPS 100  /* between both of them, at most */
#define XI_CLOSE 1e-7 /* logarithm of their ratio at which they are mixed: the rest is its square */
#define POWER_CLOSE 1e-9 /* share of the budget to which one of them is mixed in all but alone */
#define LEAST_RATIO 1e-9 /* share of the bracket that a step leaves on either side */

typedef struct {
  wide reach;    /* s.f */
  wide force[2]; /* f [N] */
} full_force;

/* The farthest forces of all sides. */
typedef struct {
  int begin[FL_MOST]; /* the first side of each actuator */
  full_force side[FL_SIDES_MOST];
} side_pool;

/* Forces of one bus at a multiplier. */
typedef struct {
  wide multiplier;
  wide power; /* [W] */
  wide worth; /* sum of s.y */
  wide share[FL_MOST];
  int side[FL_MOST]; /* the one of its sides that is taken */
} bus_response;

/* The corner of a convex polygon that is farthest along prices s (2,): uphill from the one that was
   the farthest before, as corners are in order; `corner` becomes what is found. */
static full_force farthest_corner(const real *polygon, const wide *s, int *corner) {
  const int count = (int)polygon[0];
  const real *point = polygon + 1;
  int at = *corner;
  wide reach = s[0] * point[2 * at] + s[1] * point[2 * at + 1];
  int step = 1;
  int n_turns = 0;
  for (int k = 0; k < 2 * count && n_turns < 2; k++) {
    const int to = (at + step + count) % count;
    const wide other = s[0] * point[2 * to] + s[1] * point[2 * to + 1];
    if (other > reach) {
      at = to;
      reach = other;
      continue;
    }
    step = -step;
    n_turns++;
  }
  *corner = at;
  const full_force best = {reach, {point[2 * at], point[2 * at + 1]}};
  return best;
}

/* The largest force of a side that is farthest along prices s (2,). */
static full_force farthest_of_side(fl_power_sets *sets, int i, const wide *s) {
  const fl_power_side *side = sets->side + i;
  if (side->polygon > 0)
    return farthest_corner(sets->tables + (int)side->polygon, s, sets->corner + i);
  full_force best = {-LARGEST_NUMBER, {0, 0}};
  const wide size = sqrt(s[0] * s[0] + s[1] * s[1]);
  const wide turn = remainder(atan2(s[1], s[0]) - side->center, 2 * PI);
  if (size > 0 && fabs(turn) <= side->half_angle) {
    best.reach = side->radius * size;
    best.force[0] = side->radius * s[0] / size;
    best.force[1] = side->radius * s[1] / size;
    return best;
  }
  for (int end = -1; end <= 1; end += 2) {
    const wide angle = side->center + end * side->half_angle;
    const wide x = side->radius * cos(angle);
    const wide y = side->radius * sin(angle);
    const wide reach = s[0] * x + s[1] * y;
    if (!(reach > best.reach)) continue;
    best.reach = reach;
    best.force[0] = x;
    best.force[1] = y;
  }
  return best;
}

/* The share of a curve's knots (share, power, its slope) that is best at a multiplier, where the
   slope is the reach over the multiplier, and its power [W]; the slope is linear between knots. */
static wide best_of_curve(const real *curve, wide reach, wide multiplier, wide *watts) {
  const real *knot = curve + 1;
  int low = 0;
  int high = (int)curve[0] - 1;
  while (low < high) {
    const int middle = (low + high + 1) / 2;
    if (reach > multiplier * knot[3 * middle + 2])
      low = middle;
    else
      high = middle - 1;
  }
  const real *begin = knot + 3 * low;
  wide share = begin[0];
  *watts = begin[1];
  const int is_between = low < (int)curve[0] - 1 && reach > multiplier * begin[2];
  if (!is_between) return share;
  const wide rise = reach / multiplier - begin[2];
  const wide further = (begin[3] - begin[0]) * rise / (begin[5] - begin[2]);
  share += further;
  *watts += further * (begin[2] + rise / 2);
  return share;
}

/* The best share of the largest forces of a side, and its power. */
static wide best_share(const fl_power_sets *sets, const fl_power_side *side, wide reach,
                       wide multiplier, wide *watts) {
  if (side->curve > 0)
    return best_of_curve(sets->tables + (int)side->curve, reach, multiplier, watts);
  const int is_ideal = side->exponent == 1.5; /* of a propeller; spares two powers */
  wide share = side->least_share;
  if (reach > 0) {
    const wide slope_at_most = multiplier * side->watts * side->exponent;
    const wide ratio = reach / slope_at_most;
    wide wanted = 1;
    if (reach < slope_at_most && is_ideal) wanted = ratio * ratio;
    if (reach < slope_at_most && !is_ideal) wanted = pow(ratio, 1 / (side->exponent - 1));
    share = larger_wide(share, wanted);
  }
  if (is_ideal)
    *watts = side->watts * share * sqrt(share);
  else
    *watts = side->watts * pow(share, side->exponent);
  return share;
}

static int works(const real *numbers) { return numbers[3] > 0 && numbers[1] > 0; }

/* What the actuators of a bus, or of none (-1), give at a multiplier of its budget. */
static void respond(const fl_power_sets *sets, int n, int bus, const side_pool *full,
                    wide multiplier, bus_response *out) {
  out->multiplier = multiplier;
  out->power = 0;
  out->worth = 0;
  for (int i = 0; i < n; i++) {
    const real *numbers = sets->actuator + NUMBERS_OF_ACTUATOR * i;
    if ((int)numbers[2] != bus || !works(numbers)) continue;
    const fl_power_side *side = sets->side + (int)numbers[0];
    wide best_profit = -LARGEST_NUMBER;
    wide power = 0;
    for (int k = 0; k < (int)numbers[1]; k++) {
      const wide reach = full->side[full->begin[i] + k].reach;
      wide watts = 0;
      const wide share = best_share(sets, side + k, reach, multiplier, &watts);
      const wide profit = share * reach - multiplier * watts;
      if (!(profit > best_profit)) continue;
      best_profit = profit;
      power = watts;
      out->share[i] = share;
      out->side[i] = k;
    }
    out->power += power;
    out->worth += out->share[i] * full->side[full->begin[i] + out->side[i]].reach;
  }
}

/* Two multipliers between which the power of a bus comes down to its budget: `above` takes more
   than that, at first at a multiplier of 0; they begin beside the one that is expected. 0 where no
   multiplier keeps the budget: then `below` takes least. */
static int bracket(const fl_power_sets *sets, int n, int bus, const side_pool *full, wide expected,
                   bus_response *above, bus_response *below) {
  const wide budget = sets->budget[bus];
  bus_response next;
  wide factor = XI_FACTOR;
  respond(sets, n, bus, full, expected, &next);
  const int is_below = next.power <= budget;
  if (is_below)
    *below = next;
  else
    *above = next;
  for (int k = 0; k < XI_TRIES; k++) {
    wide multiplier = next.multiplier * factor;
    if (is_below) multiplier = next.multiplier / factor;
    factor = pow(factor, XI_GROWTH);
    if (is_below && !(multiplier > TINY_WIDE)) return 1;
    respond(sets, n, bus, full, multiplier, &next);
    const int is_other_side = (next.power <= budget) != is_below;
    if (next.power <= budget)
      *below = next;
    else
      *above = next;
    if (is_other_side) return 1;
  }
  if (!is_below) *below = next;
  return is_below;
}

/* Brings two multipliers of a bus together, by the secant of the logarithms of multiplier and
   power, which a power law makes straight, and halves where that leaves most of the bracket. */
static void close_in(const fl_power_sets *sets, int n, int bus, const side_pool *full,
                     bus_response *above, bus_response *below) {
  const wide budget = sets->budget[bus];
  for (int k = 0; k < XI_STEPS; k++) {
    const wide low = log(larger_wide(above->multiplier, TINY_WIDE));
    const wide high = log(below->multiplier);
    const int is_close = high - low <= XI_CLOSE;
    const wide enough = POWER_CLOSE * budget;
    if (is_close || budget - below->power <= enough || above->power - budget <= enough) return;
    wide part = 0.5;
    if (k % 3 != 2 && below->power > 0) {
      const wide excess = log(above->power / budget);
      part = excess / (excess - log(below->power / budget));
      part = larger_wide(part, LEAST_RATIO);
      if (part > 1 - LEAST_RATIO) part = 1 - LEAST_RATIO;
    }
    bus_response between;
    respond(sets, n, bus, full, exp(low + part * (high - low)), &between);
    if (between.power > budget)
      *above = between;
    else
      *below = between;
  }
}

/* Takes the forces of a bus: those of two responses, mixed so that they take just the budget. */
static void take_forces(const fl_power_sets *sets, int n, int bus, const side_pool *full,
                        const bus_response *above, const bus_response *below, wide part,
                        wide force[][2]) {
  for (int i = 0; i < n; i++) {
    const real *numbers = sets->actuator + NUMBERS_OF_ACTUATOR * i;
    if ((int)numbers[2] != bus || !works(numbers)) continue;
    const wide *far = full->side[full->begin[i] + above->side[i]].force;
    const wide *near = full->side[full->begin[i] + below->side[i]].force;
    for (int q = 0; q < 2; q++) {
      const wide y_above = above->share[i] * far[q];
      const wide y_below = below->share[i] * near[q];
      force[i][q] = y_below + part * (y_above - y_below);
    }
  }
}

/* The forces (n, 2) [N] within all budgets that are farthest along a normal (6,), and the
   multipliers of the budgets there. */
void fl_farthest_within_budgets(fl_power_sets *sets, int n, const wide *normal, wide force[][2]) {
  side_pool pool;
  const side_pool *full = &pool;
  const wide length = norm_wide(normal);
  int count = 0;
  for (int i = 0; i < n; i++) {
    const real *numbers = sets->actuator + NUMBERS_OF_ACTUATOR * i;
    wide s[2] = {0, 0};
    for (int k = 0; k < 6; k++) {
      s[0] += numbers[4 + k] * normal[k];
      s[1] += numbers[10 + k] * normal[k];
    }
    force[i][0] = 0;
    force[i][1] = 0;
    pool.begin[i] = count;
    for (int k = 0; k < (int)numbers[1]; k++) {
      pool.side[count] = farthest_of_side(sets, (int)numbers[0] + k, s);
      count++;
    }
  }
  for (int bus = -1; bus < sets->buses; bus++) {
    bus_response above;
    bus_response below;
    respond(sets, n, bus, full, 0, &above);
    if (bus < 0) {
      take_forces(sets, n, bus, full, &above, &above, 0, force);
      continue;
    }
    if (above.power <= sets->budget[bus]) {
      sets->multiplier[bus] = 0;
      take_forces(sets, n, bus, full, &above, &above, 0, force);
      continue;
    }
    /* Profits are not below 0 where actuators can rest: so xi P is not above what all is worth. */
    wide expected = larger_wide(above.worth, TINY_WIDE) / sets->budget[bus];
    if (sets->expected[bus] > 0) expected = sets->expected[bus] * length;
    wide part = 0;
    if (bracket(sets, n, bus, full, expected, &above, &below)) {
      close_in(sets, n, bus, full, &above, &below);
      part = (sets->budget[bus] - below.power) / (above.power - below.power);
    }
    sets->multiplier[bus] = below.multiplier + part * (above.multiplier - below.multiplier);
    sets->expected[bus] = sets->multiplier[bus] / length;
    take_forces(sets, n, bus, full, &above, &below, part, force);
  }
}

/* The steps of fl_smooth_normal. */
#define NORMAL_STEPS 40 /* at most */
#define SEARCH_STEPS 12 /* of one of them, at most: shorter or longer ones */
#define FIRST_STEP 0.3  /* of the normal, over its length */
#define LESS 1e-4       /* of the fall along a step that is expected, which is enough */
#define FLATTER 0.9     /* of the slope along a step, which is flat enough */
#define FLAT 1e-13      /* step over the normal that is rounding */

typedef struct {
  wide normal[6];
  wide value;       /* h(m) - c.m */
  wide gradient[6]; /* of that, across the ray: how the farthest point is off the ray */
} dual_point;

/* The dual at a normal. */
static void evaluate(const real *block, const fl_work *work, const wide *from, const wide *ray,
                     dual_point *p) {
  wide force[FL_MOST][2];
  wide way[6];
  fl_farthest_within_budgets(work->power_sets, COUNT(block), p->normal, force);
  fl_point_of_forces(block, work, force, way);
  add_scaled(way, -1, from);
  p->value = dot_wide(way, p->normal, 6);
  memcpy(p->gradient, way, sizeof way);
  add_scaled(p->gradient, -dot_wide(way, ray, 6) / dot_wide(ray, ray, 6), ray);
}

/* Whether any budget binds at the last normal. */
static int binds(const fl_power_sets *sets) {
  for (int bus = 0; bus < sets->buses; bus++) {
    if (sets->multiplier[bus] > 0) return 1;
  }
  return 0;
}

/* A step from a point along a direction to where the dual is less and flatter (weak conditions of
   Wolfe); 0 where there is none. */
static int search_step(const real *block, const fl_work *work, const wide *from, const wide *ray,
                       const dual_point *begin, const wide *direction, dual_point *end) {
  const wide slope = dot_wide(begin->gradient, direction, 6);
  wide low = 0;
  wide high = 0;
  wide step = 1;
  for (int k = 0; k < SEARCH_STEPS; k++) {
    memcpy(end->normal, begin->normal, sizeof end->normal);
    add_scaled(end->normal, step, direction);
    evaluate(block, work, from, ray, end);
    const int is_less = end->value <= begin->value + LESS * step * slope;
    const int is_flat = dot_wide(end->gradient, direction, 6) >= FLATTER * slope;
    if (is_less && is_flat) return 1;
    if (is_less)
      low = step;
    else
      high = step;
    step *= 2;
    if (high > 0) step = (low + high) / 2;
  }
  return 0;
}

/* Improves the inverse of the Hessian by a step and by how the gradient changed (BFGS). */
static void improve_inverse(wide inverse[6][6], const wide *step, const wide *change,
                            int is_first) {
  const wide curvature = dot_wide(step, change, 6);
  const wide size = dot_wide(change, change, 6);
  if (!(curvature > 0)) return;
  if (is_first) {
    for (int k = 0; k < 6; k++) inverse[k][k] = curvature / size;
  }
  wide turned[6];
  for (int k = 0; k < 6; k++) turned[k] = dot_wide(inverse[k], change, 6);
  const wide along = 1 + dot_wide(turned, change, 6) / curvature;
  for (int k = 0; k < 6; k++) {
    for (int j = 0; j < 6; j++) {
      inverse[k][j] += along * step[k] * step[j] / curvature;
      inverse[k][j] -= (turned[k] * step[j] + step[k] * turned[j]) / curvature;
    }
  }
}

/* The normal of the plane that bounds a ray within budgets, by a quasi-Newton method: what budgets
   bind has no kinks, as costs are strictly convex. Where there are, it ends near to that normal,
   and Wolfe's algorithm goes on (nearest_point.c). */
void fl_smooth_normal(const real *block, const fl_work *work, const wide *from, const wide *ray,
                      wide close, wide *normal) {
  const wide size = dot_wide(ray, ray, 6);
  wide inverse[6][6];
  dual_point here;
  memset(inverse, 0, sizeof inverse);
  for (int k = 0; k < 6; k++) {
    here.normal[k] = ray[k] / size;
    inverse[k][k] = 1;
  }
  evaluate(block, work, from, ray, &here);
  for (int k = 0; k < NORMAL_STEPS; k++) {
    const wide off_ray = norm_wide(here.gradient);
    if (off_ray <= close || !binds(work->power_sets)) break;
    wide direction[6];
    for (int j = 0; j < 6; j++) direction[j] = -dot_wide(inverse[j], here.gradient, 6);
    if (k == 0) {
      const wide scale = FIRST_STEP * norm_wide(here.normal) / off_ray;
      for (int j = 0; j < 6; j++) direction[j] *= scale;
    }
    dual_point next;
    if (!search_step(block, work, from, ray, &here, direction, &next)) break;
    wide step[6];
    wide change[6];
    memcpy(step, next.normal, sizeof step);
    memcpy(change, next.gradient, sizeof change);
    add_scaled(step, -1, here.normal);
    add_scaled(change, -1, here.gradient);
    here = next;
    if (norm_wide(step) <= FLAT * norm_wide(here.normal)) break;
    improve_inverse(inverse, step, change, k == 0);
  }
  memcpy(normal, here.normal, sizeof here.normal);
}

#else
typedef int fl_no_power_sets; /* a file of C has to declare something */
#endif
