/* What a command gives and takes where the laws of all actuators are formulas: no grid or table
   stands between. Called by Python, which judges single answers with it.

   The formulas are written in Python too, in finlab/actuators; tests/core/test_actuator_formulas.py
   holds the two together. */
#include "internal.h"

#define BESSEL_TERMS 17 /* of the series of J1, for |x| <= 4 in double precision */

/* Bessel function J1(x) = (x/2) sum_k (-1)^k (x/2)^(2k) / (k! (k+1)!), |x| <= 4. */
static real bessel_j1(real x) {
  const real half = x / 2;
  const real half_squared = half * half;
  real term = 1;
  real sum = 1;
  for (int k = 1; k < BESSEL_TERMS; k++) {
    term *= -half_squared / (real)(k * (k + 1));
    sum += term;
  }
  return half * sum;
}

/* Size of a fin's force [N], by half amplitude A [rad], frequency f [Hz] and zero direction phi
   [rad]. */
static real thrust_of_fin(const fl_formula *law, const real *command) {
  const real A = command[0];
  const real f = command[1];
  const real phi = command[2];
  if (law->kind == FL_DRAG) { /* T = c f^2 sin^2 A */
    const real beat = f * SIN(A);
    return law->coefficient * beat * beat;
  }
  if (law->kind == FL_LIGHTHILL) { /* T = c f^2 A J1(A) */
    return law->coefficient * f * f * A * bessel_j1(A);
  }
  /* T = k x^p / (1 + (x / x0)^q) (1 + e cos(phi - phi_e)) with x = A f */
  const real x = A * f;
  const real rise = law->coefficient * POW(x, law->rise_exponent);
  const real fall = POW(x / law->fall_begin, law->fall_exponent);
  const real uneven = 1 + law->unevenness * COS(phi - law->unevenness_angle);
  return rise / (1 + fall) * uneven;
}

/* Mean mechanical power of a fin's blade [W], 8 pi^2 f^3 A^2 (k A + j): k and j are the parts of
   the drag K and of the inertia J. */
static real power_of_blade(const fl_formula *law, const real *command) {
  const real A = command[0];
  const real f = command[1];
  const real K = law->blade_drag;
  const real J = law->blade_inertia;
  /* The torque changes sign where s0 = (K A / J) (1 - s0^2). */
  const real twice_ratio = 2 * K / J * A;
  const real s0 = twice_ratio / (1 + SQRT(1 + twice_ratio * twice_ratio));
  const real k = K * (s0 * (1 - s0 * s0 / 3) + R(2.0) / 3);
  const real j = J * (1 - s0 * s0) / 2;
  const real beat = A * f;
  return 8 * PI * PI * f * beat * beat * (k * A + j);
}

/* Force of a propeller [N], of which there is none in its dead band. */
static real thrust_of_propeller(const fl_formula *law, real wanted) {
  if (FABS(wanted) < law->dead_band * (1 - NOTHING)) return 0;
  return wanted;
}

/* Power of a propeller [W], P = c |F|^e. */
static real power_of_propeller(const fl_formula *law, real thrust) {
  real c = law->coefficient;
  if (thrust < 0) c = law->coefficient_reverse;
  return c * POW(FABS(thrust), law->power_exponent);
}

/* Force (3,) of one actuator along its own axes [N], zeros before; returns its power [W]. */
static real force_and_power(const fl_formula *law, const real *command, real *force) {
  if (law->kind == FL_FIXED_PROPELLER) {
    force[0] = thrust_of_propeller(law, command[0]);
    return power_of_propeller(law, force[0]);
  }
  if (law->kind == FL_TURNING_PROPELLER) {
    const real thrust = thrust_of_propeller(law, command[1]);
    force[1] = thrust * COS(command[0]);
    force[2] = thrust * SIN(command[0]);
    return power_of_propeller(law, thrust);
  }
  const real thrust = thrust_of_fin(law, command);
  const real direction = command[2] + law->lean_angle;
  force[1] = thrust * COS(direction);
  force[2] = thrust * SIN(direction);
  return power_of_blade(law, command);
}

/* Power of a measured propeller [W], by its curve of fl_use_laws. */
static real power_on_curve(const real *curve, real thrust) {
  const int count = (int)curve[0];
  const real *force = curve + 1;
  const real *power = force + count;
  const real *marginal = power + count;
  int low = 0;
  int high = count - 1;
  while (high - low > 1) {
    const int middle = (low + high) / 2;
    if (thrust < force[middle]) {
      high = middle;
    } else {
      low = middle;
    }
  }
  const real step = thrust - force[low];
  const real curvature = (marginal[high] - marginal[low]) / (force[high] - force[low]);
  return power[low] + step * (marginal[low] + curvature * step / 2);
}

/* Power of an actuator by its law: fl_work.law_power. */
static real power_by_law(const fl_work *work, int i, const real *command) {
  const fl_formula *law = work->laws + i;
  const real *const *curves = work->curves;
  const real *curve = curves[i];
  real force[3];
  if (!curve) return force_and_power(law, command, force);
  real wanted = command[0];
  if (law->kind == FL_TURNING_PROPELLER) wanted = command[1];
  return power_on_curve(curve, thrust_of_propeller(law, wanted));
}

void fl_use_laws(fl_work *work, const fl_formula *laws, const real *const *curves) {
  work->laws = laws;
  work->curves = curves;
  work->law_power = power_by_law;
}

/* Whether a command (3,) is that of a lost actuator. */
static int is_lost(const real *command) {
  return command[0] != command[0] && command[1] != command[1] && command[2] != command[2];
}

/* Adds the wrench of a force (3,) of one actuator, with its effectiveness B (3, 6). */
static void add_wrench_of_force(const real *force, const real *B, real *wrench) {
  for (int a = 0; a < 3; a++) {
    for (int k = 0; k < 6; k++) wrench[k] += force[a] * B[6 * a + k];
  }
}

int fl_wrench_of_command(const fl_formula *laws, int n, const real *effectiveness,
                         const real *command, real *wrench) {
  memset(wrench, 0, 6 * sizeof *wrench);
  for (int i = 0; i < n; i++) {
    const real *own_command = command + 3 * i;
    if (is_lost(own_command)) continue;
    if (!fl_are_within(own_command, 3, LARGEST_NUMBER)) return FL_BAD_ARGUMENT;
    real force[3] = {0};
    force_and_power(laws + i, own_command, force);
    add_wrench_of_force(force, effectiveness + 18 * i, wrench);
  }
  return FL_OK;
}

int fl_figures_of_command(const fl_formula *laws, int n, const real *effectiveness,
                          const real *frames, const real *command, real *figures) {
  real *own_force = figures;
  real *body_force = own_force + 3 * n;
  real *wrench = body_force + 3 * n;
  real *power = wrench + 6;
  memset(figures, 0, sizeof *figures * (size_t)(6 * n + 7));
  for (int i = 0; i < n; i++) {
    const real *own_command = command + 3 * i;
    if (is_lost(own_command)) continue;
    if (!fl_are_within(own_command, 3, LARGEST_NUMBER)) return FL_BAD_ARGUMENT;
    real *force = own_force + 3 * i;
    *power += force_and_power(laws + i, own_command, force);
    for (int a = 0; a < 3; a++) {
      const real *axis = frames + 9 * i + 3 * a;
      for (int k = 0; k < 3; k++) body_force[3 * i + k] += force[a] * axis[k];
    }
    add_wrench_of_force(force, effectiveness + 18 * i, wrench);
  }
  return FL_OK;
}
