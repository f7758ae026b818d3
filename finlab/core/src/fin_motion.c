/* Fins that follow their commands, from beat to beat and within the beat; called by
   finlab/swim/vehicle/fin_motion.py. */
#include "internal.h"

#define SLOW_BEAT R(1e-9) /* frequency below which no amplitude is too large [Hz] */

static const real FULL_TURN = 2 * PI;

/* The exact step of one critically damped filter towards a constant target. With the error
   e = x - target, (e, x') becomes [[error_by_error, error_by_rate], [rate_by_error, rate_by_rate]]
   (e, x'). */
typedef struct {
  real error_by_error;
  real error_by_rate; /* [s] */
  real rate_by_error; /* [1/s] */
  real rate_by_rate;
} lag_step;

/* Numbers of one fin that stay. */
typedef struct {
  lag_step lag[3];     /* of amplitude, frequency and zero direction */
  real turns_fully;    /* 1 where the zero direction may be any angle, else 0 */
  real speed_limit;    /* of its servo [rad/s] */
  real turn_speed_min; /* that flapping leaves to turn the fin, however fast it is [rad/s] */
  real inertia;        /* J of the blade and the water that it carries [kg m^2] */
  real drag;           /* K of the blade [N m s^2] */
  real own_inertia;    /* I of the blade alone [kg m^2] */
  real copper_loss;    /* heat in the motor's windings [W/(N m)^2] */
} fin_numbers;

/* What one fin does. */
typedef struct {
  real value[3]; /* half amplitude [rad], frequency [Hz], zero direction [rad], over the seam on */
  real rate[3];  /* the same per second */
  real phase;    /* of the flapping [rad] */
} fin_state;

/* What one fin did in a step. */
typedef struct {
  real mean_value[3];  /* mean of fin_state.value over the step, the zero direction wrapped */
  real beats;          /* 1 where that mean beats, else 0 */
  real angle;          /* at its end [rad] */
  real phase;          /* at its end [rad] */
  real speed;          /* at its end [rad/s] */
  real acceleration;   /* [rad/s^2] */
  real inertial_power; /* at its end [W] */
  real driving_power;  /* at its end [W] */
} fin_step;

/* The amplitude that the servo's speed leaves at a frequency, 2 pi A f at most that speed. */
static real bounded_amplitude(const fin_numbers *fin, real amplitude, real frequency) {
  const real largest = fin->speed_limit / FULL_TURN / larger(frequency, SLOW_BEAT);
  return smaller(amplitude, largest);
}

/* Where a fin stops at once and hangs still. */
static void stop(fin_state *state) {
  state->value[0] = 0;
  state->value[1] = 0;
  for (int k = 0; k < 3; k++) state->rate[k] = 0;
}

/* Takes one step of the filters towards a command (3,), whose numbers are no NaN. */
static void follow(const fin_numbers *fin, const real *command, fin_state *state) {
  real target[3];
  target[0] = bounded_amplitude(fin, command[0], command[1]);
  target[1] = command[1];
  real turn = command[2] - state->value[2];
  if (fin->turns_fully > 0) turn -= FULL_TURN * RINT(turn / FULL_TURN);
  target[2] = state->value[2] + turn;
  for (int k = 0; k < 3; k++) {
    const lag_step *lag = &fin->lag[k];
    const real error = state->value[k] - target[k];
    const real rate = state->rate[k];
    state->value[k] = target[k] + lag->error_by_error * error + lag->error_by_rate * rate;
    state->rate[k] = lag->rate_by_error * error + lag->rate_by_rate * rate;
  }
  state->value[0] = bounded_amplitude(fin, state->value[0], state->value[1]);
}

void fl_follow_fins(const real *fins, const real *command, int count, real *states) {
  const fin_numbers *fin = (const fin_numbers *)fins;
  fin_state *state = (fin_state *)states;
  for (int i = 0; i < count; i++) {
    if (command[3 * i] == command[3 * i]) {
      follow(&fin[i], command + 3 * i, &state[i]);
    } else {
      stop(&state[i]);
    }
  }
}

/* Differentiates theta = A sin(phase) + phi, phase' = omega, twice. */
static void differentiate(const fin_state *before, const fin_state *state, real step,
                          fin_step *made) {
  const real amplitude = state->value[0];
  const real omega = FULL_TURN * state->value[1];
  const real swing = amplitude * omega;
  const real sine = SIN(state->phase);
  const real cosine = COS(state->phase);
  const real amplitude_rate = state->rate[0];
  const real omega_rate = FULL_TURN * state->rate[1];
  const real phi_rate = state->rate[2];
  const real amplitude_acceleration = (amplitude_rate - before->rate[0]) / step;
  const real phi_acceleration = (phi_rate - before->rate[2]) / step;
  const real by_sine = amplitude_acceleration - swing * omega;
  const real by_cosine = 2 * amplitude_rate * omega + amplitude * omega_rate;
  made->angle = amplitude * sine + state->value[2];
  made->speed = phi_rate + amplitude_rate * sine + swing * cosine;
  made->acceleration = phi_acceleration + by_sine * sine + by_cosine * cosine;
}

/* The power of a rigid plate that turns in still water, by two measures. */
static void measure_power(const fin_numbers *fin, fin_step *made) {
  const real omega = made->speed;
  const real alpha = made->acceleration;
  /* tau = J alpha + K omega |omega| */
  const real torque = fin->inertia * alpha + fin->drag * omega * FABS(omega);
  made->inertial_power = FABS(fin->own_inertia * alpha * omega);
  made->driving_power = larger(torque * omega, 0) + fin->copper_loss * torque * torque;
}

/* One fin over one step. */
static void move(const fin_numbers *fin, const real *command, real step, fin_state *state,
                 fin_step *made) {
  const fin_state before = *state;
  const int hangs = command[0] != command[0];
  if (hangs) {
    stop(state);
  } else {
    follow(fin, command, state);
  }
  /* What flapping leaves of the servo's speed is there to turn the fin. */
  const real swing = state->value[0] * (FULL_TURN * state->value[1]);
  const real turn_speed = larger(fin->speed_limit - swing, fin->turn_speed_min);
  const real turn = state->value[2] - before.value[2];
  state->value[2] = before.value[2] + clipped(turn, -turn_speed * step, turn_speed * step);
  state->rate[2] = clipped(state->rate[2], -turn_speed, turn_speed);

  const real *from = hangs ? state->value : before.value;
  for (int k = 0; k < 3; k++) made->mean_value[k] = R(0.5) * (from[k] + state->value[k]);
  const real phase = before.phase + FULL_TURN * step * made->mean_value[1];
  state->phase = phase - FULL_TURN * FLOOR(phase / FULL_TURN);
  made->phase = state->phase;
  made->mean_value[2] = fl_wrap_angle(made->mean_value[2]);
  made->beats = made->mean_value[0] > 0 && made->mean_value[1] > 0;
  differentiate(&before, state, step, made);
  measure_power(fin, made);
}

void fl_move_fins(const real *fins, const real *command, int count, real step, int steps,
                  real *states, real *moves) {
  const fin_numbers *fin = (const fin_numbers *)fins;
  fin_state *state = (fin_state *)states;
  fin_step *made = (fin_step *)moves;
  for (int k = 0; k < steps; k++) {
    for (int i = 0; i < count; i++) {
      move(&fin[i], command + 3 * i, step, &state[i], &made[k * count + i]);
    }
  }
}
