/* Tables of force over price, cubic between their knots, and gauges of forces that differ by
   direction. */
#include "internal.h"

/* Steps of Newton's method to a size of force in a cell: an error of the price that is left counts
   squared in the power. */
#define CUBIC_STEPS 12

#define THIRD (R(1.0) / 3)

static const real *knots(const real *table) { return table + 3; }

/* A cubic between two knots: value + t (m0 + t (b + t c)), t from 0 to 1 (Hermite). */
typedef struct {
  real value, m0, b, c;
} cubic;

static cubic cubic_between(real first, real last, real m0, real m1) {
  const real rise = last - first;
  return (cubic){first, m0, 3 * rise - 2 * m0 - m1, m0 + m1 - 2 * rise};
}

static real value_of(const cubic *p, real t) {
  return p->value + t * (p->m0 + t * (p->b + t * p->c));
}

static real slope_of(const cubic *p, real t) { return p->m0 + t * (2 * p->b + 3 * t * p->c); }

/* Price of knot j of k, over that of the largest force: (j / k)^4. */
static real fourth_power(real share) {
  const real squared = share * share;
  return squared * squared;
}

/* Force T(v), its derivative and the conjugate at a price v from 0 on, Eq. 5. */
line_response fl_force_of_price(const real *table, real price) {
  const real price_max = table[0];
  const int cells = (int)table[1];
  const real *knot = knots(table);
  price = larger(price, 0); /* NaN is 0, too */
  if (!(price < price_max)) {
    const real *last = knot + 3 * cells;
    const real force_max = last[0];
    return (line_response){force_max, 0, last[2] + (price - price_max) * force_max};
  }
  real dt_dv = 1 / price_max;
  real t = price * dt_dv; /* place in the cell, from 0 to 1 */
  real scale = price_max; /* price of the width of a cell */
  if (cells > 1) {
    int cell = (int)(SQRT(SQRT(t)) * (real)cells);
    if (cell > cells - 1) cell = cells - 1;
    const real each = 1 / (real)cells;
    const real begin = fourth_power((real)cell * each);
    const real width = fourth_power((real)(cell + 1) * each) - begin;
    const real over = 1 / width;
    t = (t - begin) * over;
    dt_dv *= over;
    scale *= width;
    knot += 3 * cell;
  }
  const cubic force = cubic_between(knot[0], knot[3], knot[1] * scale, knot[4] * scale);
  /* The integral of the cubic over t: the conjugate is that of the force over the price. */
  const real integral = knot[0] +
                        t * (force.m0 * R(0.5) + t * (force.b * THIRD + t * force.c * R(0.25)));
  line_response answer;
  answer.force = value_of(&force, t);
  answer.slope = slope_of(&force, t) * dt_dv;
  answer.conjugate = knot[2] + scale * t * integral;
  return answer;
}

/* The cell of a table in which a size of force lies. */
static int cell_of_force(const real *knot, int cells, real size) {
  int low = 0;
  int high = cells;
  while (high - low > 1) {
    const int between = (low + high) / 2;
    if (knot[3 * between] < size)
      low = between;
    else
      high = between;
  }
  return low;
}

/* Where in a cell, from 0 to 1, a cubic gives a size of force: by Newton's method. */
static real solve_cubic(const cubic *force, real rise, real size, int is_first) {
  real t = 0;
  if (rise > 0) t = larger((size - force->value) / rise, 0);
  if (is_first) t = SQRT(t); /* as of costs ~ T^1.5 */
  for (int k = 0; k < CUBIC_STEPS; k++) {
    const real slope = slope_of(force, t);
    const real before = t;
    if (slope > 0) t = clipped(t - (value_of(force, t) - size) / slope, 0, 1);
    if (FABS(t - before) <= ROUNDING) break;
  }
  return t;
}

/* Power of a size of force within the table, and the price at which it is given. */
real fl_marginal_cost(const real *table, real size, real *price) {
  const int cells = (int)table[1];
  const int cell = cell_of_force(knots(table), cells, size);
  const real *knot = knots(table) + 3 * cell;
  const real begin = fourth_power((real)cell / (real)cells);
  const real width = fourth_power((real)(cell + 1) / (real)cells) - begin;
  const real price_max = table[0];
  const real scale = price_max * width;
  const cubic force = cubic_between(knot[0], knot[3], knot[1] * scale, knot[4] * scale);
  const real t = solve_cubic(&force, knot[3] - knot[0], size, cell == 0);
  const real paid = price_max * begin + scale * t;
  if (price) *price = paid;
  const real integral = knot[0] + t * (force.m0 / 2 + t * (force.b / 3 + t * force.c / 4));
  const real conjugate = knot[2] + scale * t * integral;
  return paid * size - conjugate;
}

/* Where an angle lies among the points of a gauge; 0 where it is no number. */
static real position_of(const real *gauge, real angle) {
  const real points = gauge[0];
  const real turns = angle / (2 * PI);
  const real position = points * (turns - FLOOR(turns));
  if (position < points) return position;
  return 0;
}

/* Support function of a gauge in the direction (x, y) of the price, and its two derivatives
   by the angle. */
gauge_point fl_gauge_support(const real *gauge, real x, real y) {
  const int points = (int)gauge[0];
  const real step = 2 * PI / (real)points;
  const real position = position_of(gauge, ATAN2(y, x));
  const int cell = (int)position;
  const int next = (cell + 1) % points;
  const real t = position - FLOOR(position);
  const real *first = gauge + 1 + 4 * cell;
  const real *last = gauge + 1 + 4 * next;
  const cubic support = cubic_between(first[0], last[0], first[1] * step, last[1] * step);
  gauge_point point;
  point.value = value_of(&support, t);
  point.slope = slope_of(&support, t) / step;
  point.bend = (2 * support.b + 6 * t * support.c) / (step * step);
  return point;
}

/* The gauge itself in a direction of the force: a cubic whose slope at a point is that of
   the line through its neighbours. */
real fl_gauge_radius(const real *gauge, real angle) {
  const int points = (int)gauge[0];
  const real position = position_of(gauge, angle);
  const int cell = (int)position;
  const real t = position - FLOOR(position);
  real radius[4]; /* at the points around the cell */
  for (int k = 0; k < 4; k++) {
    const int point = (cell + k - 1 + points) % points;
    radius[k] = gauge[1 + 4 * point + 2];
  }
  const real m0 = (radius[2] - radius[0]) / 2;
  const real m1 = (radius[3] - radius[1]) / 2;
  const cubic between = cubic_between(radius[1], radius[2], m0, m1);
  return value_of(&between, t);
}

/* Angle from the command's direction to that of the force, in a direction of the force. */
real fl_gauge_lean(const real *gauge, real angle) {
  const int points = (int)gauge[0];
  const real position = position_of(gauge, angle);
  const int cell = (int)position;
  const int next = (cell + 1) % points;
  const real first = gauge[1 + 4 * cell + 3];
  const real last = gauge[1 + 4 * next + 3];
  return first + fl_wrap_angle(last - first) * (position - FLOOR(position));
}
