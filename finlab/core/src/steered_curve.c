/* The forces of a propeller with a rudder in its slipstream by direction. Over the thrust of the
   slipstream they are the curve g(d) = (1 - sigma CD, sigma CL) of the deflection d, which the
   grid of its law is: no table of directions comes near enough to where the lift ends.

   The curve is convex: with d rise the angle of g and that of its normal. So the deflection of a
   force, and the one that is worth most at a price s, are each the root of a falling function:

       cross(g, e) = 0 at the force along e,      s.g' = 0 at the price s. */
#include "internal.h"

#if FL_SLIPSTREAMS

#define MOST_TRIALS 60     /* of a root between two deflections; ten are usual */
#define CURVE_STEP R(1e-3) /* deflection [rad] over which g'' is taken */

enum { POSITION, TANGENT }; /* of the curve: g, g' */

/* A place on the curve. */
typedef struct {
  real g[2];     /* force over the slipstream's thrust [1] */
  real slope[2]; /* its derivative by the deflection [1/rad] */
} curve_point;

static curve_point curve_at(const real *block, int i, real deflection) {
  const real thrust = 1 + ACTUATOR(block, i)->pressure_area; /* of the slipstream, by 1 N */
  const real command[3] = {deflection, 1, 0};
  real force[3];
  real by[3][3];
  fl_force_of_command(block, i, command, force, by);
  curve_point point;
  for (int k = 0; k < 2; k++) {
    point.g[k] = force[1 + k] / thrust;
    point.slope[k] = by[0][1 + k] / thrust;
  }
  return point;
}

/* What falls with the deflection: n.g or n.g'. */
static real falling(const real *block, int i, real deflection, const real *n, int what) {
  const curve_point point = curve_at(block, i, deflection);
  if (what == POSITION) return dot(n, point.g, 2);
  return dot(n, point.slope, 2);
}

/* The deflection at which it is 0, or the end of the curve that is nearer: by regula falsi, with
   half the value at an end that stays (Illinois). */
static real root_on_curve(const real *block, int i, const real *n, int what) {
  const real *ends = block + (int)ACTUATOR(block, i)->command_table + 1;
  real low = ends[1];
  real high = ends[3];
  real at_low = falling(block, i, low, n, what);
  real at_high = falling(block, i, high, n, what);
  if (!(at_low > 0)) return low;
  if (!(at_high < 0)) return high;
  const real enough = ROUNDING / 10 * (at_low - at_high);
  real between = low;
  int last_side = 0;
  for (int k = 0; k < MOST_TRIALS; k++) {
    between = low + (high - low) * at_low / (at_low - at_high);
    const real value = falling(block, i, between, n, what);
    const int side = value > 0 ? 1 : -1;
    if (FABS(value) <= enough) break;
    if (side > 0) {
      low = between;
      at_low = value;
      if (last_side > 0) at_high /= 2;
    } else {
      high = between;
      at_high = value;
      if (last_side < 0) at_low /= 2;
    }
    last_side = side;
  }
  return between;
}

/* Deflection [rad] for a force in a direction [rad]. */
real fl_steered_deflection(const real *block, int i, real angle) {
  const real across[2] = {SIN(angle), -COS(angle)};
  return root_on_curve(block, i, across, POSITION);
}

/* Size of g in a direction of the force [rad]. */
real fl_steered_radius(const real *block, int i, real angle) {
  return size_of(curve_at(block, i, fl_steered_deflection(block, i, angle)).g);
}

/* The support function of the curve in the direction (x, y) of a price, and its two derivatives by
   the angle: with the slope, sigma + sigma'' is the radius of curvature |g'|^2 / (n.-g''). */
gauge_point fl_steered_support(const real *block, int i, real x, real y) {
  const real n[2] = {x, y};
  const real deflection = root_on_curve(block, i, n, TANGENT);
  const curve_point at = curve_at(block, i, deflection);
  const real after = falling(block, i, deflection + CURVE_STEP, n, TANGENT);
  const real before = falling(block, i, deflection - CURVE_STEP, n, TANGENT);
  const real falls = (before - after) / (2 * CURVE_STEP);
  gauge_point point;
  point.value = dot(n, at.g, 2);
  point.slope = x * at.g[1] - y * at.g[0];
  point.bend = -point.value;
  if (falls > 0) point.bend += dot(at.slope, at.slope, 2) / falls;
  return point;
}

#else

typedef int nothing_steered; /* C99 has no empty file */

#endif
