/* Tables of force over price, cubic between their knots, and gauges of forces that differ by direction. */
#include "internal.h"

#define THIRD (R(1.0) / 3)

static const real *knots(const real *table) { return table + 3; }

/* Force, its derivative and the conjugate at a price from 0 on. */
line_response fl_force_of_price(const real *table, real price) {
  price = MAX(price, 0); /* NaN is 0, too */
  real top = table[0], per = 1 / top, t = price * per, scale = top;
  int cells = (int)table[1];
  const real *knot = knots(table);
  if (!(price < top)) {
    knot += 3 * cells;
    return (line_response){knot[0], 0, knot[2] + (price - top) * knot[0]};
  }
  if (cells > 1) {
    int cell = MIN((int)(SQRT(SQRT(t)) * (real)cells), cells - 1);
    real each = 1 / (real)cells, first = (real)cell * each, last = (real)(cell + 1) * each;
    first *= first, last *= last;
    real begin = first * first, width = last * last - begin, over = 1 / width;
    t = (t - begin) * over, per *= over, scale *= width;
    knot += 3 * cell;
  }
  real m0 = knot[1] * scale, m1 = knot[4] * scale, rise = knot[3] - knot[0];
  real b = 3 * rise - 2 * m0 - m1, c = m0 + m1 - 2 * rise;
  return (line_response){knot[0] + t * (m0 + t * (b + t * c)), (m0 + t * (2 * b + 3 * t * c)) * per,
                 knot[2] + scale * t * (knot[0] + t * (m0 * R(0.5) + t * (b * THIRD + t * c * R(0.25))))};
}

/* Power of a size of force within the table, and the price at which it is given. */
real fl_marginal_cost(const real *table, real size, real *price) {
  int cells = (int)table[1], low = 0, high = cells;
  const real *knot = knots(table);
  while (high - low > 1) {
    int between = (low + high) / 2;
    if (knot[3 * between] < size)
      low = between;
    else
      high = between;
  }
  real first = (real)low / (real)cells, last = (real)high / (real)cells;
  first *= first, last *= last;
  real begin = first * first, width = last * last - begin, scale = table[0] * width;
  knot += 3 * low;
  real m0 = knot[1] * scale, m1 = knot[4] * scale, rise = knot[3] - knot[0];
  real b = 3 * rise - 2 * m0 - m1, c = m0 + m1 - 2 * rise;
  real t = rise > 0 ? MAX((size - knot[0]) / rise, 0) : 0;
  if (low == 0) t = SQRT(t); /* as of costs ~ T^1.5 */
  for (int k = 0; k < ROUNDS; k++) { /* an error of the price counts squared in the power */
    real slope = m0 + t * (2 * b + 3 * t * c), before = t;
    if (slope > 0) t = CLIP(t - (knot[0] + t * (m0 + t * (b + t * c)) - size) / slope, 0, 1);
    if (FABS(t - before) <= ROUNDING) break;
  }
  real paid = table[0] * begin + scale * t;
  if (price) *price = paid;
  return paid * size - (knot[2] + scale * t * (knot[0] + t * (m0 / 2 + t * (b / 3 + t * c / 4))));
}

/* Where an angle lies among the points of a gauge; 0 where it is no number. */
static real place_of(const real *gauge, real angle) {
  real place = angle / (2 * PI);
  place = gauge[0] * (place - FLOOR(place));
  return place < gauge[0] ? place : 0;
}

/* Support function of a gauge in the direction (x, y) of the price, and its two derivatives by the angle. */
gauge_point fl_gauge_support(const real *gauge, real x, real y) {
  int points = (int)gauge[0];
  real step = 2 * PI / (real)points, place = place_of(gauge, ATAN2(y, x));
  int cell = (int)place, next = (cell + 1) % points;
  real t = place - FLOOR(place);
  const real *a = gauge + 1 + 4 * cell, *z = gauge + 1 + 4 * next;
  real m0 = a[1] * step, m1 = z[1] * step, rise = z[0] - a[0];
  real b = 3 * rise - 2 * m0 - m1, c = m0 + m1 - 2 * rise;
  return (gauge_point){a[0] + t * (m0 + t * (b + t * c)), (m0 + t * (2 * b + 3 * t * c)) / step,
                   (2 * b + 6 * t * c) / (step * step)};
}

/* The gauge itself in a direction of the force. */
real fl_gauge_radius(const real *gauge, real angle) {
  int points = (int)gauge[0];
  real place = place_of(gauge, angle);
  int cell = (int)place;
  real t = place - FLOOR(place), at[4];
  for (int k = 0; k < 4; k++) at[k] = gauge[1 + 4 * ((cell + k - 1 + points) % points) + 2];
  real m0 = (at[2] - at[0]) / 2, m1 = (at[3] - at[1]) / 2, rise = at[2] - at[1];
  return at[1] + t * (m0 + t * (3 * rise - 2 * m0 - m1 + t * (m0 + m1 - 2 * rise)));
}

/* Angle from the command's direction to that of the force, in a direction of the force. */
real fl_gauge_lean(const real *gauge, real angle) {
  int points = (int)gauge[0];
  real place = place_of(gauge, angle);
  int cell = (int)place;
  real first = gauge[1 + 4 * cell + 3], last = gauge[1 + 4 * ((cell + 1) % points) + 3];
  return first + fl_wrap_angle(last - first) * (place - FLOOR(place));
}
