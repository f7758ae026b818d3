/* Numbers that follow their commands as lags of first order with a largest rate; called by
   finlab/swim/vehicle/actuator_motion.py. */
#include "internal.h"

/* One number of a command. */
typedef struct {
  real rate;          /* largest [per s] */
  real time_constant; /* [s] */
  real is_angle;      /* 1 where it stays when its actuator stops, else 0 */
  real is_on_circle;  /* 1 of an angle that may take any value, else 0 */
} lag_numbers;

/* What is left of an error after a time: it falls at the largest rate down to the corner, which is
   rate times time constant, and exponentially from there. */
static real error_after(const lag_numbers *lag, real error, real time) {
  const real corner = lag->rate * lag->time_constant;
  const real size = FABS(error);
  const real time_at_rate = smaller(larger(size - corner, 0) / lag->rate, time);
  const real size_at_corner = size - time_at_rate * lag->rate;
  const real size_after = size_at_corner * EXP((time_at_rate - time) / lag->time_constant);
  if (error < 0) return -size_after;
  return size_after;
}

/* The error of a value beside its command, the shorter way round on a circle. */
static real error_of(const lag_numbers *lag, real command, real value) {
  const real error = command - value;
  if (lag->is_on_circle > 0) return error - 2 * PI * RINT(error / (2 * PI));
  return error;
}

void fl_follow_lags(const real *lags, const real *command, int count, real step, int steps,
                    real *values) {
  const lag_numbers *lag = (const lag_numbers *)lags;
  for (int i = 0; i < count; i++) {
    const real start = values[i];
    const int is_stopped = command[i] != command[i];
    const real error = error_of(&lag[i], command[i], start);
    for (int k = 1; k <= steps; k++) {
      real *value = values + (size_t)k * (size_t)count + i;
      if (is_stopped) {
        *value = lag[i].is_angle > 0 ? start : 0;
      } else {
        *value = start + (error - error_after(&lag[i], error, (real)k * step));
      }
    }
  }
}
