/* The farthest forces of sets within power budgets (Eq. 30), for ray_reach.c.

       h(m) = min over mu >= 0 of  sum over buses b of  mu_b P_b
              + sum over actuators i of b of  max over y in Y_i of  s_i.y - mu_b c_i(y)

   with the prices s_i = B_i' m. The inner maximum is that of the best side of a set: a force g f
   of it, a share g of one of its largest forces f, costs C(g), so that f is the farthest of them
   and g maximizes g s.f - mu C(g). The power of a bus falls with mu; where it jumps over the
   budget, as where s.f is 0 or C is piecewise linear, a mixture of the forces on both sides of the
   jump takes just the budget, and is as far. */
#include "internal.h"

#ifdef FL_WITH_POWER_SETS

#define SIDES_MOST 32    /* sides of an actuator: the halves of the arcs that barred zones leave */
#define MU_FACTOR 4      /* from one multiplier to the next until two bracket the budget */
#define MU_TRIES 100     /* of these, at most */
#define MU_STEPS 100     /* between both of them, at most */
#define MU_CLOSE 1e-14   /* share to which multipliers, and powers, are known */
#define LEAST_RATIO 1e-9 /* share of the bracket that a step leaves on either side */

typedef struct {
  wide reach;    /* s.f */
  wide force[2]; /* f [N] */
} full_force;

/* Forces of one bus at a multiplier. */
typedef struct {
  wide multiplier;
  wide power; /* [W] */
  wide worth; /* sum of s.y */
  wide share[FL_MOST];
  int side[FL_MOST]; /* the one of its sides that is taken */
} bus_response;

/* The largest force of a side that is farthest along prices s (2,). */
static full_force farthest_of_side(const fl_power_sets *sets, const fl_power_side *side,
                                   const wide *s) {
  full_force best = {-LARGEST_NUMBER, {0, 0}};
  if (side->polygon > 0) {
    const real *polygon = sets->tables + (int)side->polygon;
    for (int k = 0; k < (int)polygon[0]; k++) {
      const wide x = polygon[1 + 2 * k];
      const wide y = polygon[2 + 2 * k];
      const wide reach = s[0] * x + s[1] * y;
      if (!(reach > best.reach)) continue;
      best.reach = reach;
      best.force[0] = x;
      best.force[1] = y;
    }
    return best;
  }
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

/* The share of a curve's points (share, W) that is best at a multiplier, and its power: as far as
   the slope is below the reach over the multiplier. */
static wide best_of_curve(const real *curve, wide reach, wide multiplier, wide *watts) {
  const real *point = curve + 1;
  int low = 0;
  int high = (int)curve[0] - 1;
  while (low < high) {
    const int middle = (low + high + 1) / 2;
    const real *to = point + 2 * middle;
    const wide rise = multiplier * (to[1] - to[-1]);
    if (reach * (to[0] - to[-2]) > rise)
      low = middle;
    else
      high = middle - 1;
  }
  *watts = point[2 * low + 1];
  return point[2 * low];
}

/* The best share of the largest forces of a side, and its power. */
static wide best_share(const fl_power_sets *sets, const fl_power_side *side, wide reach,
                       wide multiplier, wide *watts) {
  if (side->curve > 0)
    return best_of_curve(sets->tables + (int)side->curve, reach, multiplier, watts);
  wide share = side->least_share;
  if (reach > 0) {
    const wide slope_at_most = multiplier * side->watts * side->exponent;
    wide wanted = 1;
    if (reach < slope_at_most) wanted = pow(reach / slope_at_most, 1 / (side->exponent - 1.0));
    share = larger_wide(share, wanted);
  }
  *watts = side->watts * pow(share, side->exponent);
  return share;
}

/* What the actuators of a bus, or of none (-1), give at a multiplier of its budget. */
static void respond(const fl_power_sets *sets, int n, int bus, full_force (*full)[SIDES_MOST],
                    wide multiplier, bus_response *out) {
  out->multiplier = multiplier;
  out->power = 0;
  out->worth = 0;
  for (int i = 0; i < n; i++) {
    const real *numbers = sets->actuator + NUMBERS_OF_ACTUATOR * i;
    if ((int)numbers[2] != bus || !(numbers[3] > 0)) continue;
    const fl_power_side *side = sets->side + (int)numbers[0];
    wide best_profit = -LARGEST_NUMBER;
    wide power = 0;
    for (int k = 0; k < (int)numbers[1]; k++) {
      const wide reach = full[i][k].reach;
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
    out->worth += out->share[i] * full[i][out->side[i]].reach;
  }
}

/* Two multipliers between which the power of a bus comes down to its budget: `above` takes more
   than that. 0 where no multiplier keeps the budget: then `below` takes least. */
static int bracket(const fl_power_sets *sets, int n, int bus, full_force (*full)[SIDES_MOST],
                   bus_response *above, bus_response *below) {
  const wide budget = sets->budget[bus];
  /* Profits are not below 0 where actuators can rest: so mu P is not above what all is worth. */
  wide multiplier = larger_wide(above->worth, TINY_WIDE) / budget;
  for (int k = 0;; k++) {
    respond(sets, n, bus, full, multiplier, below);
    if (below->power <= budget) break;
    if (k == MU_TRIES) return 0;
    *above = *below;
    multiplier *= MU_FACTOR;
  }
  for (int k = 0; k < MU_TRIES && !(above->multiplier > 0); k++) {
    bus_response nearer;
    respond(sets, n, bus, full, below->multiplier / MU_FACTOR, &nearer);
    if (nearer.power > budget)
      *above = nearer;
    else
      *below = nearer;
  }
  return 1;
}

/* Brings two multipliers of a bus together, by the secant of the logarithms of multiplier and
   power, which a power law makes straight, and halves where that leaves most of the bracket. */
static void close_in(const fl_power_sets *sets, int n, int bus, full_force (*full)[SIDES_MOST],
                     bus_response *above, bus_response *below) {
  const wide budget = sets->budget[bus];
  for (int k = 0; k < MU_STEPS; k++) {
    const wide low = log(larger_wide(above->multiplier, TINY_WIDE));
    const wide high = log(below->multiplier);
    const int is_close = high - low <= MU_CLOSE;
    if (is_close || budget - below->power <= MU_CLOSE * budget) return;
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
static void take_forces(const fl_power_sets *sets, int n, int bus, full_force (*full)[SIDES_MOST],
                        const bus_response *above, const bus_response *below, wide part,
                        wide force[][2]) {
  for (int i = 0; i < n; i++) {
    const real *numbers = sets->actuator + NUMBERS_OF_ACTUATOR * i;
    if ((int)numbers[2] != bus || !(numbers[3] > 0)) continue;
    const wide *far = full[i][above->side[i]].force;
    const wide *near = full[i][below->side[i]].force;
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
  full_force full[FL_MOST][SIDES_MOST];
  for (int i = 0; i < n; i++) {
    const real *numbers = sets->actuator + NUMBERS_OF_ACTUATOR * i;
    const fl_power_side *side = sets->side + (int)numbers[0];
    wide s[2] = {0, 0};
    for (int k = 0; k < 6; k++) {
      s[0] += numbers[4 + k] * normal[k];
      s[1] += numbers[10 + k] * normal[k];
    }
    force[i][0] = 0;
    force[i][1] = 0;
    for (int k = 0; k < (int)numbers[1]; k++) full[i][k] = farthest_of_side(sets, side + k, s);
  }
  for (int bus = -1; bus < sets->buses; bus++) {
    bus_response above;
    bus_response below;
    respond(sets, n, bus, full, 0, &above);
    if (bus >= 0) sets->multiplier[bus] = 0;
    if (bus < 0 || above.power <= sets->budget[bus]) {
      take_forces(sets, n, bus, full, &above, &above, 0, force);
      continue;
    }
    wide part = 0;
    if (bracket(sets, n, bus, full, &above, &below)) {
      close_in(sets, n, bus, full, &above, &below);
      part = (sets->budget[bus] - below.power) / (above.power - below.power);
    }
    sets->multiplier[bus] = below.multiplier + part * (above.multiplier - below.multiplier);
    take_forces(sets, n, bus, full, &above, &below, part, force);
  }
}

#else
typedef int fl_no_power_sets; /* a file of C has to declare something */
#endif
