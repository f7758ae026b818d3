/* The motion of a robot of which much is not known, linearized, for the fault monitor;
   finlab/swim/control/motion_model.py calls it and has the equation with its source.

   A state z is d = 49 + 4 n + h numbers, in the order of the enum below: those that move by
   themselves, then what only drifts, then the strengths of n actuators, how far each is from its
   place in the layout (3 numbers), and the h numbers of what stuck ones give. Derivatives by z are
   rows of d numbers. */
#include "internal.h"

enum {
  VELOCITY = 0,  /* over ground, body frame [m/s] */
  RATES = 3,     /* angular rates [rad/s] */
  ROLL = 6,      /* [rad] */
  PITCH = 7,     /* positive with the nose down [rad] */
  DEPTH = 8,     /* [m] */
  MOVING = 9,    /* how many numbers move by themselves */
  CURRENT = 9,   /* velocity of the water in the world [m/s] */
  UNKNOWN = 12,  /* a wrench that stays, body frame [N, N m] */
  INERTIA = 18,  /* shares of the diagonal of M above the layout's */
  COUPLING = 24, /* entries of M beside it, over the geometric mean of two diagonal ones */
  DAMPING = 39,  /* shares of the damping above the layout's */
  RIGHTING = 45, /* the same of the righting moment */
  BIAS = 46,     /* of an accelerometer [m/s^2]: it moves nothing */
  FIRST_ACTUATOR = 49
};

#define SHARE_MIN R(-0.7)       /* least share of inertia and damping above the layout's */
#define SHARE_MAX R(3.0)        /* greatest of them */
#define COUPLING_MAX R(0.15)    /* greatest coupling */
#define COS_PITCH_MIN R(0.05)   /* cosine of the pitch from which on roll rates are computed */
#define EXPONENT_MAX R(0.5)     /* norm of A dt up to which the series is exact to 1e-7 */
#define EXPONENT_LIMIT R(100.0) /* norm of A dt at which all is over, or has no bounds */

typedef real matrix[6][6];
typedef real moving_matrix[MOVING][MOVING];

/* Numbers of a body, which is what the pointer `body` points at. */
typedef struct {
  real inertia[6];            /* mass and moments with those of the water [kg, kg m^2] */
  real linear_damping[6];     /* [N s/m, N m s] */
  real quadratic_damping[6];  /* [N s^2/m^2, N m s^2] */
  real net_buoyancy;          /* buoyancy less weight [N] */
  real buoyancy;              /* [N] */
  real center_of_buoyancy[3]; /* from the centre of gravity [m] */
} body_numbers;

/* What pushes: n actuators at full strength, then the h units of what stuck ones give. */
typedef struct {
  int n;                /* actuators */
  int count;            /* n + h */
  int d;                /* numbers of a state */
  const real *wrenches; /* of each (count, 6), at the layout's places [N, N m] */
  const int *owners;    /* actuator of each (count,) */
} pushers;

/* Number of the state by which a pusher's wrench counts: a strength, or what a stuck one gives. */
static int size_of_pusher(const pushers *all, int i) {
  if (i < all->n) return FIRST_ACTUATOR + i;
  return FIRST_ACTUATOR + 3 * all->n + i;
}

/* The first of three numbers of how far a pusher is from its place. */
static int place_of_pusher(const pushers *all, int i) {
  return FIRST_ACTUATOR + all->n + 3 * all->owners[i];
}

/* The wrench of a pusher from where it is: f, and its torque with that of f at the distance. */
static void wrench_of_pusher(const pushers *all, const real *z, int i, real *wrench) {
  const real *nominal = all->wrenches + 6 * i;
  real by_place[3];
  cross(z + place_of_pusher(all, i), nominal, by_place);
  for (int k = 0; k < 3; k++) {
    wrench[k] = nominal[k];
    wrench[3 + k] = nominal[3 + k] + by_place[k];
  }
}

/* Where the robot heels, and how it moves through the water. */
typedef struct {
  real sin_roll;
  real cos_roll;
  real sin_pitch;
  real cos_pitch;
  real tan_pitch;  /* bounded near the vertical */
  real axes[3][3]; /* rows: the world's axes in the body frame, the last one up */
  real current[3]; /* velocity of the water in the body frame [m/s] */
  real nu_r[6];    /* motion through the water [m/s, rad/s] */
} posture;

/* The equation M nu_r' = tau - T M nu_r - D nu_r - g, T of the momentum. */
typedef struct {
  matrix M;         /* [kg, kg m, kg m^2] */
  matrix inverse;   /* M^-1 */
  matrix T;         /* of a momentum (p, h): (omega x p, omega x h + v x p) */
  real momentum[6]; /* M nu_r */
  real coriolis[6]; /* T M nu_r */
  real share[6];    /* of the layout's damping */
  real drag[6];     /* the layout's, D nu_r */
  real righting_share;
  real righting[3];     /* the layout's righting moment, b x B up [N m] */
  real acceleration[6]; /* nu_r' */
} dynamics;

/* Entry beside the diagonal of row i and column j, in the order of COUPLING. */
static int coupling_of(int i, int j) {
  if (i > j) return coupling_of(j, i);
  return i * 5 - i * (i - 1) / 2 + (j - i - 1);
}

static real variance_of(const real *P, int d, int number) { return P[number * d + number]; }

static void cross_rows(const real *a, real rows[6][6], int row, int column) {
  rows[row][column + 1] = -a[2];
  rows[row][column + 2] = a[1];
  rows[row + 1][column] = a[2];
  rows[row + 1][column + 2] = -a[0];
  rows[row + 2][column] = -a[1];
  rows[row + 2][column + 1] = a[0];
}

static posture posture_of(const real *z, real yaw) {
  posture at;
  at.sin_roll = SIN(z[ROLL]);
  at.cos_roll = COS(z[ROLL]);
  at.sin_pitch = SIN(z[PITCH]);
  at.cos_pitch = COS(z[PITCH]);
  real bounded = larger(FABS(at.cos_pitch), COS_PITCH_MIN);
  if (at.cos_pitch < 0) bounded = -bounded;
  at.tan_pitch = at.sin_pitch / bounded;
  const real sin_yaw = SIN(yaw);
  const real cos_yaw = COS(yaw);
  at.axes[0][0] = cos_yaw * at.cos_pitch;
  at.axes[0][1] = cos_yaw * at.sin_pitch * at.sin_roll - sin_yaw * at.cos_roll;
  at.axes[0][2] = cos_yaw * at.sin_pitch * at.cos_roll + sin_yaw * at.sin_roll;
  at.axes[1][0] = sin_yaw * at.cos_pitch;
  at.axes[1][1] = sin_yaw * at.sin_pitch * at.sin_roll + cos_yaw * at.cos_roll;
  at.axes[1][2] = sin_yaw * at.sin_pitch * at.cos_roll - cos_yaw * at.sin_roll;
  at.axes[2][0] = -at.sin_pitch;
  at.axes[2][1] = at.cos_pitch * at.sin_roll;
  at.axes[2][2] = at.cos_pitch * at.cos_roll;
  for (int k = 0; k < 3; k++) {
    at.current[k] = 0;
    for (int axis = 0; axis < 3; axis++) at.current[k] += at.axes[axis][k] * z[CURRENT + axis];
    at.nu_r[k] = z[VELOCITY + k] - at.current[k];
    at.nu_r[3 + k] = z[RATES + k];
  }
  return at;
}

static void righting_moment(const body_numbers *b, const real *up, real *moment) {
  cross(b->center_of_buoyancy, up, moment);
  for (int k = 0; k < 3; k++) moment[k] *= b->buoyancy;
}

/* M by a state; its inverse, without couplings where no body has them. */
static void set_inertia(const body_numbers *b, const real *z, dynamics *at) {
  for (int i = 0; i < 6; i++) {
    const real share = clipped(z[INERTIA + i], SHARE_MIN, SHARE_MAX);
    at->M[i][i] = b->inertia[i] * (1 + share);
    for (int j = i + 1; j < 6; j++) {
      const real coupling = clipped(z[COUPLING + coupling_of(i, j)], -COUPLING_MAX, COUPLING_MAX);
      at->M[i][j] = coupling * SQRT(b->inertia[i] * b->inertia[j]);
      at->M[j][i] = at->M[i][j];
    }
  }
  matrix factor;
  memcpy(factor, at->M, sizeof factor);
  if (!fl_factor(factor)) {
    for (int i = 0; i < 6; i++) {
      for (int j = 0; j < 6; j++) {
        if (i != j) at->M[i][j] = 0;
      }
    }
    memcpy(factor, at->M, sizeof factor);
    fl_factor(factor);
  }
  for (int i = 0; i < 6; i++) {
    real unit[6] = {0};
    unit[i] = 1;
    fl_solve(factor, unit, at->inverse[i]);
  }
}

/* The equation at a state, by a wrench tau (6,) of all that pushes. */
static void set_dynamics(const body_numbers *b, const real *z, const posture *where,
                         const real *tau, dynamics *at) {
  set_inertia(b, z, at);
  memset(at->T, 0, sizeof at->T);
  cross_rows(z + RATES, at->T, 0, 0);
  cross_rows(z + RATES, at->T, 3, 3);
  cross_rows(where->nu_r, at->T, 3, 0);
  const real *up = where->axes[2];
  righting_moment(b, up, at->righting);
  at->righting_share = 1 + clipped(z[RIGHTING], SHARE_MIN, SHARE_MAX);
  for (int k = 0; k < 6; k++) at->momentum[k] = dot(at->M[k], where->nu_r, 6);
  real right[6];
  for (int k = 0; k < 6; k++) {
    at->coriolis[k] = dot(at->T[k], at->momentum, 6);
    at->share[k] = 1 + clipped(z[DAMPING + k], SHARE_MIN, SHARE_MAX);
    const real slowness = b->linear_damping[k] + b->quadratic_damping[k] * FABS(where->nu_r[k]);
    at->drag[k] = slowness * where->nu_r[k];
    right[k] = tau[k] - at->coriolis[k] - at->share[k] * at->drag[k];
    if (k < 3) {
      right[k] += b->net_buoyancy * up[k];
    } else {
      right[k] += at->righting_share * at->righting[k - 3];
    }
  }
  for (int k = 0; k < 6; k++) at->acceleration[k] = dot(at->inverse[k], right, 6);
}

/* Rates of change (9,) of what moves by itself. */
static void set_rates(const real *z, const posture *where, const dynamics *at, real *rates) {
  const real *omega = z + RATES;
  real turning[3]; /* the water moves without rotation: nu' = nu_r' - omega x c */
  cross(omega, where->current, turning);
  for (int k = 0; k < 6; k++) rates[k] = at->acceleration[k];
  for (int k = 0; k < 3; k++) rates[k] -= turning[k];
  const real about_down = omega[1] * where->sin_roll + omega[2] * where->cos_roll;
  rates[ROLL] = omega[0] + where->tan_pitch * about_down;
  rates[PITCH] = omega[1] * where->cos_roll - omega[2] * where->sin_roll;
  rates[DEPTH] = -dot(where->axes[2], z + VELOCITY, 3);
}

/* Derivatives (6, 6) of the acceleration by the motion through the water. */
static void set_slope_by_flow(const body_numbers *b, const posture *where, const dynamics *at,
                              matrix by_flow) {
  matrix inner;
  /* d(T m)/d nu of a momentum m = (p, h) that stays: -(p x omega', h x omega' + p x v'). */
  memset(inner, 0, sizeof inner);
  cross_rows(at->momentum, inner, 0, 3);
  cross_rows(at->momentum, inner, 3, 0);
  cross_rows(at->momentum + 3, inner, 3, 3);
  for (int i = 0; i < 6; i++) {
    for (int k = 0; k < 6; k++) {
      for (int j = 0; j < 6; j++) inner[i][j] -= at->T[i][k] * at->M[k][j];
    }
    const real quadratic = b->quadratic_damping[i] * FABS(where->nu_r[i]);
    inner[i][i] -= at->share[i] * (b->linear_damping[i] + 2 * quadratic);
  }
  for (int i = 0; i < 6; i++) {
    for (int j = 0; j < 6; j++) {
      by_flow[i][j] = 0;
      for (int k = 0; k < 6; k++) by_flow[i][j] += at->inverse[i][k] * inner[k][j];
    }
  }
}

/* Derivatives by roll or pitch, `column`: how `up` turns by it, and about which axis (3,). */
static void set_slope_by_tilt(const body_numbers *b, const real *z, const posture *where,
                              const dynamics *at, matrix by_flow, int column, const real *turned_up,
                              const real *about, int d, real *slope) {
  real by_tilt[6];
  righting_moment(b, turned_up, by_tilt + 3);
  for (int k = 0; k < 3; k++) {
    by_tilt[k] = b->net_buoyancy * turned_up[k];
    by_tilt[3 + k] *= at->righting_share;
  }
  /* Turned by a little about an axis, the body sees the current c as c x axis less of it. */
  real current_turned[3];
  cross(where->current, about, current_turned);
  real by_current[3];
  cross(z + RATES, current_turned, by_current);
  for (int k = 0; k < 6; k++) {
    real sum = dot(at->inverse[k], by_tilt, 6) - dot(by_flow[k], current_turned, 3);
    if (k < 3) sum -= by_current[k];
    slope[k * d + column] = sum;
  }
  slope[DEPTH * d + column] = -dot(turned_up, z + VELOCITY, 3);
}

/* Derivatives of the rates of roll, pitch and depth by motion and tilt. */
static void set_slope_of_tilt(const real *z, const posture *where, int d, real *slope) {
  const real q = z[RATES + 1];
  const real r = z[RATES + 2];
  const real about_down = q * where->sin_roll + r * where->cos_roll;
  const real about_side = q * where->cos_roll - r * where->sin_roll;
  real *of_roll = slope + ROLL * d;
  real *of_pitch = slope + PITCH * d;
  of_roll[ROLL] = where->tan_pitch * about_side;
  of_roll[PITCH] = (1 + where->tan_pitch * where->tan_pitch) * about_down;
  of_pitch[ROLL] = -about_down;
  of_roll[RATES] = 1;
  of_roll[RATES + 1] = where->tan_pitch * where->sin_roll;
  of_roll[RATES + 2] = where->tan_pitch * where->cos_roll;
  of_pitch[RATES + 1] = where->cos_roll;
  of_pitch[RATES + 2] = -where->sin_roll;
  for (int k = 0; k < 3; k++) slope[DEPTH * d + VELOCITY + k] = -where->axes[2][k];
}

/* Derivatives of the acceleration by the entries of M: -M^-1 (E nu_r' + T E nu_r) of an entry E. */
static void set_slope_by_inertia(const body_numbers *b, const posture *where, const dynamics *at,
                                 int d, real *slope) {
  const real *nu_r = where->nu_r;
  for (int k = 0; k < 6; k++) {
    real of_momentum[6]; /* row k of M^-1 T */
    for (int j = 0; j < 6; j++) {
      of_momentum[j] = 0;
      for (int i = 0; i < 6; i++) of_momentum[j] += at->inverse[k][i] * at->T[i][j];
    }
    real *row = slope + k * d;
    for (int i = 0; i < 6; i++) {
      const real own = at->inverse[k][i] * at->acceleration[i] + of_momentum[i] * nu_r[i];
      row[INERTIA + i] = -b->inertia[i] * own;
      for (int j = i + 1; j < 6; j++) {
        const real first = at->inverse[k][i] * at->acceleration[j] + of_momentum[i] * nu_r[j];
        const real second = at->inverse[k][j] * at->acceleration[i] + of_momentum[j] * nu_r[i];
        const real entry = SQRT(b->inertia[i] * b->inertia[j]);
        row[COUPLING + coupling_of(i, j)] = -entry * (first + second);
      }
    }
  }
}

/* Derivatives of the acceleration by what else only drifts: current, unknown wrench, damping and
   righting moment. */
static void set_slope_by_drifting(const real *z, const posture *where, const dynamics *at,
                                  matrix by_flow, int d, real *slope) {
  for (int axis = 0; axis < 3; axis++) {
    const real *seen = where->axes[axis]; /* a current along an axis of the world */
    real turning[3];
    cross(z + RATES, seen, turning);
    for (int k = 0; k < 6; k++) {
      real sum = -dot(by_flow[k], seen, 3);
      if (k < 3) sum -= turning[k];
      slope[k * d + CURRENT + axis] = sum;
    }
  }
  for (int k = 0; k < 6; k++) {
    const real *inverse = at->inverse[k];
    real *row = slope + k * d;
    for (int j = 0; j < 6; j++) {
      row[UNKNOWN + j] = inverse[j];
      row[DAMPING + j] = -inverse[j] * at->drag[j];
    }
    row[RIGHTING] = dot(inverse + 3, at->righting, 3);
  }
}

/* The same by strengths, by what stuck ones give, and by the places of actuators: a step e of one
   adds the torque e x f. */
static void set_slope_by_pushers(const pushers *all, const real *z, const dynamics *at,
                                 real *slope) {
  for (int i = 0; i < all->count; i++) {
    real wrench[6];
    wrench_of_pusher(all, z, i, wrench);
    const int column = size_of_pusher(all, i);
    const int first = place_of_pusher(all, i);
    for (int k = 0; k < 6; k++) slope[k * all->d + column] = dot(at->inverse[k], wrench, 6);
    if (z[column] == 0) continue;
    for (int axis = 0; axis < 3; axis++) {
      real step[3] = {0};
      step[axis] = z[column];
      real torque[3];
      cross(step, wrench, torque);
      for (int k = 0; k < 6; k++) {
        slope[k * all->d + first + axis] += dot(at->inverse[k] + 3, torque, 3);
      }
    }
  }
}

/* All derivatives (9, d) of the rates of what moves by itself. */
static void set_slope(const body_numbers *b, const real *z, const posture *where,
                      const dynamics *at, const pushers *all, real *slope) {
  const int d = all->d;
  memset(slope, 0, (size_t)(MOVING * d) * sizeof(real));
  matrix by_flow;
  set_slope_by_flow(b, where, at, by_flow);
  for (int i = 0; i < 6; i++) {
    for (int j = 0; j < 6; j++) slope[i * d + j] = by_flow[i][j];
  }
  const real *current = where->current; /* nu' = nu_r' - omega x c, by omega: c x omega' */
  slope[0 * d + RATES + 1] -= current[2];
  slope[0 * d + RATES + 2] += current[1];
  slope[1 * d + RATES] += current[2];
  slope[1 * d + RATES + 2] -= current[0];
  slope[2 * d + RATES] -= current[1];
  slope[2 * d + RATES + 1] += current[0];
  const real up_by_roll[3] = {0, where->cos_pitch * where->cos_roll,
                              -where->cos_pitch * where->sin_roll};
  const real up_by_pitch[3] = {-where->cos_pitch, -where->sin_pitch * where->sin_roll,
                               -where->sin_pitch * where->cos_roll};
  const real about_roll[3] = {1, 0, 0};
  const real about_pitch[3] = {0, where->cos_roll, -where->sin_roll};
  set_slope_by_tilt(b, z, where, at, by_flow, ROLL, up_by_roll, about_roll, d, slope);
  set_slope_by_tilt(b, z, where, at, by_flow, PITCH, up_by_pitch, about_pitch, d, slope);
  set_slope_of_tilt(z, where, d, slope);
  set_slope_by_inertia(b, where, at, d, slope);
  set_slope_by_drifting(z, where, at, by_flow, d, slope);
  set_slope_by_pushers(all, z, at, slope);
}

/* product = A B. */
static void multiply(moving_matrix A, moving_matrix B, moving_matrix product) {
  for (int i = 0; i < MOVING; i++) {
    real row[MOVING] = {0};
    for (int k = 0; k < MOVING; k++) {
      const real factor = A[i][k];
      for (int j = 0; j < MOVING; j++) row[j] += factor * B[k][j];
    }
    memcpy(product[i], row, sizeof row);
  }
}

static void set_identity(moving_matrix A) {
  memset(A, 0, sizeof(moving_matrix));
  for (int i = 0; i < MOVING; i++) A[i][i] = 1;
}

/* F = e^X and phi = phi_1(X) = (e^X - 1) / X of a matrix, by their series and by doubling:
   phi_1(2 X) = (e^X + 1) phi_1(X) / 2, e^(2 X) = (e^X)^2. X is changed. */
static void exponential(moving_matrix X, moving_matrix F, moving_matrix phi) {
  real norm = 0;
  for (int i = 0; i < MOVING; i++) {
    real sum = 0;
    for (int j = 0; j < MOVING; j++) sum += FABS(X[i][j]);
    norm = larger(norm, sum);
  }
  real scale = 1;
  if (norm > EXPONENT_LIMIT) scale = EXPONENT_LIMIT / norm;
  int halvings = 0;
  for (real size = norm * scale; size > EXPONENT_MAX; size *= R(0.5)) {
    scale *= R(0.5);
    halvings++;
  }
  for (int i = 0; i < MOVING; i++) {
    for (int j = 0; j < MOVING; j++) X[i][j] *= scale;
  }
  moving_matrix product;
  /* phi_1 = 1 + X/2 + X^2/6 + X^3/24 + X^4/120 + X^5/720, by Horner's rule */
  set_identity(phi);
  for (int divisor = 6; divisor >= 2; divisor--) {
    multiply(X, phi, product);
    set_identity(phi);
    for (int i = 0; i < MOVING; i++) {
      for (int j = 0; j < MOVING; j++) phi[i][j] += product[i][j] / (real)divisor;
    }
  }
  /* e^X = 1 + X phi_1 */
  multiply(X, phi, F);
  for (int i = 0; i < MOVING; i++) F[i][i] += 1;
  for (int step = 0; step < halvings; step++) {
    multiply(F, phi, product);
    for (int i = 0; i < MOVING; i++) {
      for (int j = 0; j < MOVING; j++) phi[i][j] = R(0.5) * (product[i][j] + phi[i][j]);
    }
    multiply(F, F, product);
    memcpy(F, product, sizeof product);
  }
}

/* z <- z + dt phi_1(A dt) rates, and its derivatives (9, d): dt phi_1 slope, e^(A dt) by what
   moves by itself. */
static void set_transition(const real *rates, const real *slope, real dt, int d, real *z,
                           real *transition) {
  moving_matrix A_dt;
  moving_matrix F;
  moving_matrix phi;
  for (int i = 0; i < MOVING; i++) {
    for (int j = 0; j < MOVING; j++) A_dt[i][j] = slope[i * d + j] * dt;
  }
  exponential(A_dt, F, phi);
  for (int i = 0; i < MOVING; i++) {
    z[i] += dt * dot(phi[i], rates, MOVING);
    real *row = transition + i * d;
    memset(row, 0, (size_t)d * sizeof(real));
    for (int k = 0; k < MOVING; k++) {
      const real factor = dt * phi[i][k];
      for (int j = MOVING; j < d; j++) row[j] += factor * slope[k * d + j];
    }
    memcpy(row, F[i], sizeof F[i]);
  }
}

/* Squares of accelerations (6,) that the terms of the equation come to, one by one. */
static void set_terms(const body_numbers *b, const real *z, const dynamics *at, const pushers *all,
                      real *terms) {
  for (int k = 0; k < 6; k++) {
    const real inertial = dot(at->M[k], at->acceleration, 6);
    real sum = at->drag[k] * at->drag[k] + at->coriolis[k] * at->coriolis[k] + inertial * inertial;
    for (int i = 0; i < all->n; i++) {
      const real pushed = z[FIRST_ACTUATOR + i] * all->wrenches[6 * i + k];
      sum += pushed * pushed;
    }
    terms[k] = sum / (b->inertia[k] * b->inertia[k]);
  }
}

/* Covariance (3, 3) of the velocity through the water, v less the current in the body frame. */
static void set_flow_covariance(const posture *where, const real *P, int d, real Sigma[3][3]) {
  const int numbers[6] = {VELOCITY, VELOCITY + 1, VELOCITY + 2, CURRENT, CURRENT + 1, CURRENT + 2};
  real J[3][6] = {{0}};
  for (int k = 0; k < 3; k++) {
    J[k][k] = 1;
    for (int axis = 0; axis < 3; axis++) J[k][3 + axis] = -where->axes[axis][k];
  }
  for (int i = 0; i < 3; i++) {
    real of_row[6] = {0};
    for (int l = 0; l < 6; l++) {
      for (int m = 0; m < 6; m++) of_row[m] += J[i][l] * P[numbers[l] * d + numbers[m]];
    }
    for (int j = 0; j < 3; j++) Sigma[i][j] = dot(of_row, J[j], 6);
  }
}

/* Variance of a product m a b beyond what is linear in the errors, where m is known on average and
   errors of m go with those of a and of b. */
static real product_with(real variance, real a, real variance_a, real b, real variance_b) {
  return variance * (a * a * variance_b + b * b * variance_a + variance_a * variance_b);
}

/* Squares of angular accelerations that are off by what is not linear in Munk's moment v x M v: of
   a velocity that is in doubt with itself, and with the entries of M. Of axis i, with j and k next
   to it in turn, and entries m of M:

     (m_kk - m_jj) v_j v_k + m_ik v_i v_j + m_jk (v_j^2 - v_k^2) - m_ij v_i v_k */
static void set_products(const body_numbers *b, const posture *where, const dynamics *at,
                         const real *P, int d, real *products) {
  real Sigma[3][3];
  set_flow_covariance(where, P, d, Sigma);
  const real *v = where->nu_r;
  for (int i = 0; i < 3; i++) {
    const int j = (i + 1) % 3;
    const int k = (i + 2) % 3;
    const real m_ii = b->inertia[i];
    const real m_jj = b->inertia[j];
    const real m_kk = b->inertia[k];
    const real S_ii = Sigma[i][i];
    const real S_jj = Sigma[j][j];
    const real S_kk = Sigma[k][k];
    const real difference = at->M[k][k] - at->M[j][j];
    const real of_velocity = S_jj * S_kk + Sigma[j][k] * Sigma[j][k];
    const real var_jj = variance_of(P, d, INERTIA + j) * m_jj * m_jj;
    const real var_kk = variance_of(P, d, INERTIA + k) * m_kk * m_kk;
    const real var_ij = variance_of(P, d, COUPLING + coupling_of(i, j)) * m_ii * m_jj;
    const real var_ik = variance_of(P, d, COUPLING + coupling_of(i, k)) * m_ii * m_kk;
    const real var_jk = variance_of(P, d, COUPLING + coupling_of(j, k)) * m_jj * m_kk;
    real sum = difference * difference * of_velocity;
    sum += product_with(var_jj + var_kk, v[j], S_jj, v[k], S_kk);
    sum += product_with(var_ik, v[i], S_ii, v[j], S_jj);
    sum += product_with(var_ij, v[i], S_ii, v[k], S_kk);
    sum += var_jk * (4 * v[j] * v[j] * S_jj + 2 * S_jj * S_jj);
    sum += var_jk * (4 * v[k] * v[k] * S_kk + 2 * S_kk * S_kk);
    products[i] = 0;
    products[3 + i] = sum / (b->inertia[3 + i] * b->inertia[3 + i]);
  }
}

void fl_motion_step(const real *body, const real *wrenches, const int *owners, int strengths,
                    int held, real yaw, real dt, const real *covariance, real *state,
                    real *transition, real *rates, real *slope, real *terms) {
  const body_numbers *b = (const body_numbers *)body;
  pushers all;
  all.n = strengths;
  all.count = strengths + held;
  all.d = FIRST_ACTUATOR + 3 * strengths + all.count;
  all.wrenches = wrenches;
  all.owners = owners;
  const posture where = posture_of(state, yaw);
  real tau[6];
  for (int k = 0; k < 6; k++) tau[k] = state[UNKNOWN + k];
  for (int i = 0; i < all.count; i++) {
    real wrench[6];
    wrench_of_pusher(&all, state, i, wrench);
    const real size = state[size_of_pusher(&all, i)];
    for (int k = 0; k < 6; k++) tau[k] += size * wrench[k];
  }
  dynamics at;
  set_dynamics(b, state, &where, tau, &at);
  set_rates(state, &where, &at, rates);
  set_slope(b, state, &where, &at, &all, slope);
  set_terms(b, state, &at, &all, terms);
  memset(terms + 6, 0, 6 * sizeof(real));
  if (covariance != 0) set_products(b, &where, &at, covariance, all.d, terms + 6);
  set_transition(rates, slope, dt, all.d, state, transition);
}
