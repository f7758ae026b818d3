/* Control of the steps of Newton's method on a concave function: which are kept, and how the
   damping mu of Eq. 8 follows. Steps are judged by the slopes of the function along them. */
#ifndef FL_STEP_CONTROL_H
#define FL_STEP_CONTROL_H
#include "internal.h"

#define OVERSHOT R(-0.3)     /* share of the slope below which a kept step went too far, too */
#define SEARCH_STEPS 12      /* of the search for where a step that went too far is to end */
#define SLOPE_ENOUGH R(0.05) /* share of the slope that it may leave */

/* What a trial step brought: slopes of the value along it at both of its ends, and its
   rise [W]. */
typedef struct {
  real slope_begin, slope_end, rise;
  real slope_left; /* l, Eq. 10 */
} step_result;

static inline step_result step_result_of(real slope_begin, real slope_end, real rise) {
  step_result result;
  result.slope_begin = slope_begin;
  result.slope_end = slope_end;
  result.slope_left = slope_end / larger(slope_begin, TINY);
  result.rise = rise;
  return result;
}

/* A step is kept that ends uphill, or where the value rose, or is the same and the residual
   fell: with saturated actuators the residual may fall while the value does, too. */
static inline int is_step_kept(const step_result *result, real value, real size_before,
                               real size_after) {
  const real slack = ROUNDING * FABS(value);
  if (result->slope_left >= 0 || result->rise > 0) return 1;
  return result->rise > -slack && size_after < FELL * size_before;
}

static inline real mu_after_kept(real mu, const step_result *result) {
  real factor = clipped(FABS(result->slope_left) / 2, MU_KEPT_LEAST, 1);
  if (result->slope_left > R(0.5)) factor = MU_KEPT_EARLY;
  return larger(mu * factor, ROUNDING);
}

/* The mu that a share of the step asks for, at which the cubic along it, of both values and slopes,
   is largest. */
static inline real mu_after_refused(real mu, real nu, const step_result *result) {
  const real a = 3 * (result->slope_begin + result->slope_end - 2 * result->rise);
  const real b = result->slope_end - result->slope_begin - a;
  const real discriminant = b * b - 4 * a * result->slope_begin;
  real share = R(0.5);
  if (discriminant > 0) share = 2 * result->slope_begin / (SQRT(discriminant) - b);
  const real factor = larger(nu, 1 / clipped(share, SHARE_LEAST_AT_KINK, SHARE_MOST));
  return mu * factor;
}
#endif
