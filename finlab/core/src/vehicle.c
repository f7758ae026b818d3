/* One body in water that moves, after Fossen: its rate of change, and steps in time.

   finlab/swim/vehicle/vehicle.py calls it, finlab/swim/vehicle/fossen.py has the equations with
   their source. A state is 13 numbers: position in the world (z up) [m], quaternion (w, x, y, z),
   velocity over ground [m/s] and angular rates [rad/s] in the body frame. */
#include "internal.h"

#define STABLE_STEP R(1.5) /* step times the fastest rate of change in it; Runge-Kutta bears 2.8 */
#define PARTS_MOST 500     /* parts of a period, of a body that water stops almost at once */

/* Numbers of a body, which is what the pointer `body` of all functions here points at. */
typedef struct {
  real inertia[6];        /* diagonal of M: mass and moments with those of the water [kg, kg m^2] */
  real linear_damping[6]; /* [N s/m, N m s] */
  real quadratic_damping[6];  /* [N s^2/m^2, N m s^2] */
  real weight;                /* [N] */
  real buoyancy;              /* [N] */
  real center_of_buoyancy[3]; /* from the centre of gravity [m] */
  real munk_rate;             /* rate of change by Munk's moments, per speed [1/m] */
  real current[3];            /* velocity of the water in the world [m/s] */
} body_numbers;

enum { STATE_SIZE = 13 };

typedef real vector[3];

/* The body's axes x, y and z as the world sees them, of a quaternion of unit length. */
static void axes_of(const real *quaternion, vector *axes) {
  const real w = quaternion[0];
  const real x = quaternion[1];
  const real y = quaternion[2];
  const real z = quaternion[3];
  axes[0][0] = 1 - 2 * (y * y + z * z);
  axes[0][1] = 2 * (x * y + w * z);
  axes[0][2] = 2 * (x * z - w * y);
  axes[1][0] = 2 * (x * y - w * z);
  axes[1][1] = 1 - 2 * (x * x + z * z);
  axes[1][2] = 2 * (y * z + w * x);
  axes[2][0] = 2 * (x * z + w * y);
  axes[2][1] = 2 * (y * z - w * x);
  axes[2][2] = 1 - 2 * (x * x + y * y);
}

/* nu_r' = M^-1 (tau - C(nu_r) nu_r - D(nu_r) nu_r - g(eta)); `up` is the world's z axis in the body
   frame, all that g depends on. */
static void accelerations(const body_numbers *b, const real *nu_r, const real *up, const real *tau,
                          real *acceleration) {
  const real *v_r = nu_r;
  const real *omega = nu_r + 3;
  vector p;          /* linear momentum of the body with the water that goes along */
  vector h;          /* the same of the angular momentum */
  vector omega_x_p;  /* C(nu_r) nu_r = (omega x p, omega x h + v_r x p) */
  vector omega_x_h;  /* gyroscopic moment */
  vector v_x_p;      /* Munk's moment */
  vector lever_x_up; /* moment of a buoyant force of 1 N */
  for (int k = 0; k < 3; k++) p[k] = b->inertia[k] * v_r[k];
  for (int k = 0; k < 3; k++) h[k] = b->inertia[3 + k] * omega[k];
  cross(omega, p, omega_x_p);
  cross(omega, h, omega_x_h);
  cross(v_r, p, v_x_p);
  cross(b->center_of_buoyancy, up, lever_x_up);
  const real net_buoyancy = b->buoyancy - b->weight;
  for (int k = 0; k < 6; k++) {
    /* D(nu_r) nu_r = (d_1 + d_2 |nu_r|) nu_r */
    const real d = b->linear_damping[k] + b->quadratic_damping[k] * FABS(nu_r[k]);
    const real damping = d * nu_r[k];
    real sum;
    if (k < 3) {
      sum = tau[k] - omega_x_p[k] - damping + net_buoyancy * up[k];
    } else {
      const int axis = k - 3;
      const real righting = b->buoyancy * lever_x_up[axis];
      sum = tau[k] - omega_x_h[axis] - v_x_p[axis] - damping + righting;
    }
    acceleration[k] = sum / b->inertia[k];
  }
}

void fl_body_rates(const real *body, const real *state, const real *tau, real *rates) {
  const body_numbers *b = (const body_numbers *)body;
  const real *quaternion = state + 3;
  const real *velocity = state + 7;
  const real *omega = state + 10;
  vector axes[3];
  axes_of(quaternion, axes);

  vector current; /* in the body frame */
  vector up;
  real nu_r[6];
  for (int k = 0; k < 3; k++) {
    current[k] = dot(axes[k], b->current, 3);
    up[k] = axes[k][2];
    nu_r[k] = velocity[k] - current[k];
    nu_r[3 + k] = omega[k];
  }
  real acceleration[6];
  accelerations(b, nu_r, up, tau, acceleration);

  for (int k = 0; k < 3; k++) {
    rates[k] = axes[0][k] * velocity[0] + axes[1][k] * velocity[1] + axes[2][k] * velocity[2];
  }
  /* The quaternion's rate is half its product with (0, omega). */
  const real w = quaternion[0];
  const real x = quaternion[1];
  const real y = quaternion[2];
  const real z = quaternion[3];
  rates[3] = R(0.5) * (-x * omega[0] - y * omega[1] - z * omega[2]);
  rates[4] = R(0.5) * (w * omega[0] + y * omega[2] - z * omega[1]);
  rates[5] = R(0.5) * (w * omega[1] + z * omega[0] - x * omega[2]);
  rates[6] = R(0.5) * (w * omega[2] + x * omega[1] - y * omega[0]);
  /* The water moves without rotation: nu' = nu_r' - omega x (current in the body frame). */
  vector omega_x_current;
  cross(omega, current, omega_x_current);
  for (int k = 0; k < 3; k++) rates[7 + k] = acceleration[k] - omega_x_current[k];
  for (int k = 0; k < 3; k++) rates[10 + k] = acceleration[3 + k];
}

real fl_body_fastest_rate(const real *body, const real *state) {
  const body_numbers *b = (const body_numbers *)body;
  const real *nu = state + 7;
  const real current_speed = FABS(b->current[0]) + FABS(b->current[1]) + FABS(b->current[2]);
  real damping = 0;
  real speed = 0;
  real turning = 0;
  for (int k = 0; k < 6; k++) {
    if (nu[k] != nu[k]) return INFINITY;
    const real along = FABS(nu[k]) + (k < 3 ? current_speed : 0);
    /* The derivative of D(nu_r) nu_r: the quadratic part counts twice. */
    const real d = b->linear_damping[k] + b->quadratic_damping[k] * (2 * along);
    damping = larger(damping, d / b->inertia[k]);
    if (k < 3) {
      speed = larger(speed, along);
    } else {
      turning = larger(turning, along);
    }
  }
  return damping + b->munk_rate * speed + turning;
}

int fl_body_parts(const real *body, const real *state, real step) {
  const real rate = fl_body_fastest_rate(body, state);
  const real parts = rate * step / STABLE_STEP;
  if (!(parts <= PARTS_MOST)) return 0;
  if (parts <= 1) return 1;
  return -(int)FLOOR(-parts);
}

/* y + h rates, component by component. */
static void advance(const real *y, const real *rates, real h, real *result) {
  for (int k = 0; k < STATE_SIZE; k++) result[k] = y[k] + h * rates[k];
}

/* Divides a quaternion by its length, however small or large that is. */
static void normalize(real *quaternion) {
  real largest = 0;
  for (int k = 0; k < 4; k++) largest = larger(largest, FABS(quaternion[k]));
  real squares = 0;
  for (int k = 0; k < 4; k++) {
    const real share = quaternion[k] / largest;
    squares += share * share;
  }
  const real length = largest * SQRT(squares);
  for (int k = 0; k < 4; k++) quaternion[k] /= length;
}

/* y <- y + h/6 (k1 + 2 k2 + 2 k3 + k4), the classical rule of order 4. */
static void runge_kutta_step(const real *body, const real *tau, real h, real *y) {
  real k1[STATE_SIZE];
  real k2[STATE_SIZE];
  real k3[STATE_SIZE];
  real k4[STATE_SIZE];
  real between[STATE_SIZE];
  fl_body_rates(body, y, tau, k1);
  advance(y, k1, R(0.5) * h, between);
  fl_body_rates(body, between, tau, k2);
  advance(y, k2, R(0.5) * h, between);
  fl_body_rates(body, between, tau, k3);
  advance(y, k3, h, between);
  fl_body_rates(body, between, tau, k4);
  for (int k = 0; k < STATE_SIZE; k++) y[k] += h / 6 * (k1[k] + 2 * (k2[k] + k3[k]) + k4[k]);
}

/* y <- y + h f(y + h/2 f(y)), of order 2. */
static void midpoint_step(const real *body, const real *tau, real h, real *y) {
  real rates[STATE_SIZE];
  real between[STATE_SIZE];
  fl_body_rates(body, y, tau, rates);
  advance(y, rates, R(0.5) * h, between);
  fl_body_rates(body, between, tau, rates);
  advance(y, rates, h, y);
}

int fl_body_steps(const real *body, const real *wrench, int count, real step, real *states) {
  for (int i = 0; i < count; i++) {
    const real *before = states + (size_t)i * STATE_SIZE;
    real *after = states + (size_t)(i + 1) * STATE_SIZE;
    const int parts = fl_body_parts(body, before, step);
    if (parts == 0) return i;
    memcpy(after, before, STATE_SIZE * sizeof(real));
    for (int part = 0; part < parts; part++) {
      runge_kutta_step(body, wrench + (size_t)i * 6, step / (real)parts, after);
      normalize(after + 3);
    }
  }
  return count;
}

int fl_body_coarse_step(const real *body, const real *wrench, real step, real *state) {
  const int parts = fl_body_parts(body, state, step);
  for (int part = 0; part < parts; part++) {
    midpoint_step(body, wrench, step / (real)parts, state);
  }
  return parts > 0;
}
