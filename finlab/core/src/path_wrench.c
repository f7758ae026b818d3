/* The wrenches that a path takes of a robot that swims along it, nose ahead; called by
   finlab/swim/control/observer.py. */
#include "internal.h"

#define LEAST_SPEED R(1e-3) /* [m/s] by which a rate of the speed is divided at least */

enum { SURGE, SWAY, HEAVE, YAW };

/* How the water damps the motion along one axis, alone. */
typedef struct {
  real linear;    /* d_1 [N s/m, N m s] */
  real quadratic; /* d_2 [N s^2/m^2, N m s^2] */
  real inertia;   /* m [kg, kg m^2] */
} axis_numbers;

/* m x'' + (d_1 + d_2 |x'|) x': the force along an axis for an acceleration at a speed. */
static real force_along(const axis_numbers *axis, real acceleration, real speed) {
  const real damping = axis->linear + axis->quadratic * FABS(speed);
  return axis->inertia * (acceleration + damping / axis->inertia * speed);
}

/* Yaw rate [rad/s] of a point of the path, which counts less and less below a slow speed. */
static real turning_at(const real *velocity, const real *acceleration, const real *current,
                       real slow) {
  const real x = velocity[0] - current[0];
  const real y = velocity[1] - current[1];
  const real speed_squared = x * x + y * y;
  const real turning = x * acceleration[1] - y * acceleration[0];
  return turning / larger(speed_squared, slow * slow);
}

void fl_path_wrenches(const real *axes, const real *velocity, const real *acceleration, int count,
                      const real *current, real slow, real period, real *wrenches) {
  const axis_numbers *axis = (const axis_numbers *)axes;
  for (int k = 0; k < count; k++) {
    const real *v = velocity + 3 * k;
    const real *a = acceleration + 3 * k;
    real *wrench = wrenches + 6 * k;
    const real x = v[0] - current[0];
    const real y = v[1] - current[1];
    const real speed = SQRT(x * x + y * y);
    const real surge_rate = (x * a[0] + y * a[1]) / larger(speed, LEAST_SPEED);
    for (int i = 0; i < 6; i++) wrench[i] = 0;
    wrench[0] = force_along(&axis[SURGE], surge_rate, speed);
    wrench[2] = force_along(&axis[HEAVE], a[2], v[2]);

    /* Central differences of the yaw rate, one-sided ones at the ends. */
    const int before = k == 0 ? 0 : k - 1;
    const int after = k + 1 == count ? k : k + 1;
    const real from = turning_at(velocity + 3 * before, acceleration + 3 * before, current, slow);
    const real to = turning_at(velocity + 3 * after, acceleration + 3 * after, current, slow);
    const real turning_rate = (to - from) / ((real)(after - before) * period);
    wrench[5] = force_along(&axis[YAW], turning_rate, turning_at(v, a, current, slow));
  }
}
