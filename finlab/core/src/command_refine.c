/* Levenberg-Marquardt steps that make commands exact by the laws, Eq. 11.

       step = J' (J J' + (mu + epsilon) tr(J J') I)^-1 r    with    epsilon = ROUNDING REGULAR

   r is the residual of the wrench over the wrench scale, J the Jacobian of that wrench by the
   commands over the widths of their limits, so that `step` is a share of these widths. What a
   step would take out of the limits is held, and the step found anew without it. */
#include "internal.h"

#define HOLDS 3         /* how often a step is found anew without commands that leave the box */
#define LIMIT_ROUNDS 6  /* how often, where numbers go to their limits */
#define MU_KEPT R(0.3)  /* damping after a kept step, over that before */
#define MU_REFUSED 10   /* the same after a refused step */
#define REGULAR R(0.01) /* least damping (epsilon of Eq. 11) over the rounding of numbers */

/* The residual (6,) of commands, over the wrench scale. Returns its square. */
static real residual_of(const real *block, const fl_work *work, const real *wrench_wanted,
                        real command[][3], real *residual) {
  const real *scale = HEAD(block)->wrench_scale;
  const fl_span *span = &work->span;
  for (int k = 0; k < 6; k++) residual[k] = (wrench_wanted[k] - span->wrench_offset[k]) / scale[k];
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    if (span->is_lost[i]) continue;
    if (a->dead_band > 0 && fl_is_in_dead_band(a, command[i])) continue;
    real force[3];
    fl_force_of_command(block, i, command[i], force, 0);
    if (a->rows == 1) { /* a thruster has one direction */
      for (int k = 0; k < 6; k++) residual[k] -= force[0] * a->effectiveness_normalized[0][k];
      continue;
    }
    for (int k = 0; k < 6; k++) {
      residual[k] -= force[0] * a->effectiveness_normalized[0][k] +
                     force[1] * a->effectiveness_normalized[1][k] +
                     force[2] * a->effectiveness_normalized[2][k];
    }
  }
  for (int k = 0; k < 6; k++) {
    if (!span->axis_counts[k]) residual[k] = 0;
  }
  return dot(residual, residual, 6);
}

/* The Jacobian J of the wrench over the wrench scale by the commands over the widths of their
   limits, into the work area: the rows of numbers that commands use. */
static void find_jacobian(const real *block, fl_work *work, const fl_box *box, real command[][3]) {
  const unsigned char *counts = work->span.axis_counts;
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    real force[3];
    real by[3][3]; /* of the force (second index) by each command */
    fl_force_of_command(block, i, command[i], force, by);
    if (work->span.is_lost[i] || fl_is_in_dead_band(a, command[i])) memset(by, 0, sizeof by);
    const int numbers = fl_form_of(a)->numbers;
    for (int c = 0; c < numbers; c++) {
      const real width = box->command_max[i][c] - box->command_min[i][c];
      real *row = work->jacobian[i][c];
      for (int k = 0; k < 6; k++) {
        row[k] = 0;
        if (!counts[k]) continue;
        const real slope = by[c][0] * a->effectiveness_normalized[0][k] +
                           by[c][1] * a->effectiveness_normalized[1][k] +
                           by[c][2] * a->effectiveness_normalized[2][k];
        row[k] = width * slope;
      }
    }
  }
}

/* Whether a step takes number c of a command out of its limits. */
static int leaves_box(const real *block, const fl_box *box, int i, int c, const real *command,
                      real step) {
  if (c == fl_form_of(ACTUATOR(block, i))->angle_number && box->is_free_angle[i]) return 0;
  if (step < 0) return command[c] <= box->command_min[i][c] + NOTHING;
  if (step > 0) return command[c] >= box->command_max[i][c] - NOTHING;
  return 0;
}

/* The damped least step of commands, over the widths of their limits, that gives a residual;
   those of `held` not. The damping is a share of the trace: in a tick widths, and with them
   J, are small. */
static void damped_step(const real *block, fl_work *work, const real *residual, real mu,
                        unsigned char held[][3], real step[][3]) {
  const int n = COUNT(block);
  real gram[6][6] = {{0}}; /* J J' */
  for (int i = 0; i < n; i++) {
    const int numbers = fl_form_of(ACTUATOR(block, i))->numbers;
    for (int c = 0; c < numbers; c++) {
      if (!held[i][c]) fl_add_square(gram, work->jacobian[i][c], 1);
    }
  }
  const real epsilon = ROUNDING * REGULAR;
  const real ridge = (mu + epsilon) * fl_trace(gram) + TINY; /* TINY: where nothing is free */
  for (int j = 0; j < 6; j++) gram[j][j] += ridge;
  real multiplier[6] = {0};
  if (fl_factor(gram)) fl_solve(gram, residual, multiplier);
  for (int i = 0; i < n; i++) {
    const int numbers = fl_form_of(ACTUATOR(block, i))->numbers;
    memset(step[i], 0, sizeof step[i]);
    for (int c = 0; c < numbers; c++) {
      if (!held[i][c]) step[i][c] = dot(work->jacobian[i][c], multiplier, 6);
    }
  }
}

/* Holds the commands (n, 3) that a step would take out of the box, beside those that are
   held; whether there are any. */
static int hold_leaving(const real *block, const fl_box *box, real command[][3], real step[][3],
                        unsigned char held[][3]) {
  int any = 0;
  for (int i = 0; i < COUNT(block); i++) {
    for (int c = 0; c < 3; c++) {
      if (held[i][c] || !leaves_box(block, box, i, c, command[i], step[i][c])) continue;
      held[i][c] = 1;
      any = 1;
    }
  }
  return any;
}

/* A damped step that leaves the box in no number but for a handful. */
static void step_within(const real *block, fl_work *work, const fl_box *box, real command[][3],
                        const real *residual, real mu, real step[][3]) {
  unsigned char held[FL_MOST][3] = {{0}};
  damped_step(block, work, residual, mu, held, step);
  for (int k = 0; k < HOLDS && hold_leaving(block, box, command, step, held); k++) {
    damped_step(block, work, residual, mu, held, step);
  }
}

/* Commands after a step, within the box. */
static void take_step(const real *block, const fl_box *box, real command[][3], real step[][3],
                      real stepped[][3]) {
  for (int i = 0; i < COUNT(block); i++) {
    const int angle = fl_form_of(ACTUATOR(block, i))->angle_number;
    for (int c = 0; c < 3; c++) {
      real change = 0;
      if (!leaves_box(block, box, i, c, command[i], step[i][c])) change = step[i][c];
      const real width = box->command_max[i][c] - box->command_min[i][c];
      stepped[i][c] = fl_clip_number(box, i, c, angle, command[i][c] + change * width);
    }
  }
}

/* The box of steps: without the barred zones of pods, which keep to the arcs that they are in. */
static const fl_box *box_of_steps(const real *block, const fl_box *box, real command[][3],
                                  fl_box *kept) {
  if (FL_ZONES == 0) return box;
  int has_zones = 0;
  for (int i = 0; i < COUNT(block); i++) has_zones |= ACTUATOR(block, i)->barred_count > 0;
  if (!has_zones) return box;
  *kept = *box;
  fl_keep_arcs(block, kept, command);
  return kept;
}

#if FL_COUPLES
/* How far number c of a command goes, over the width of its limits, where a step takes it beyond
   one: to that limit. Returns whether it does. */
static int ends_at_limit(const real *block, const fl_box *box, int i, int c, const real *command,
                         real step, real *to_limit) {
  const real low = box->command_min[i][c];
  const real high = box->command_max[i][c];
  const real width = high - low;
  if (c == fl_form_of(ACTUATOR(block, i))->angle_number && box->is_free_angle[i]) return 0;
  if (!(width > 0)) return 0;
  const real most = (high - command[c]) / width;
  const real least = (low - command[c]) / width;
  *to_limit = clipped(step, smaller(least, 0), larger(most, 0));
  return *to_limit != step;
}

/* A damped step within the box whose numbers at their limits leave what they cannot do to the
   others: those that a step takes beyond a limit go to it and are held, and the step of the others
   is found anew for what is left of the residual. */
static void step_to_limits(const real *block, fl_work *work, const fl_box *box, real command[][3],
                           const real *residual, real mu, real step[][3]) {
  unsigned char held[FL_MOST][3] = {{0}};
  real to_limit[FL_MOST][3] = {{0}};
  real residual_left[6];
  memcpy(residual_left, residual, sizeof residual_left);
  damped_step(block, work, residual_left, mu, held, step);
  for (int round = 0; round < LIMIT_ROUNDS; round++) {
    int any = 0;
    for (int i = 0; i < COUNT(block); i++) {
      const int numbers = fl_form_of(ACTUATOR(block, i))->numbers;
      for (int c = 0; c < numbers; c++) {
        if (held[i][c]) continue;
        if (!ends_at_limit(block, box, i, c, command[i], step[i][c], &to_limit[i][c])) continue;
        held[i][c] = 1;
        any = 1;
        for (int k = 0; k < 6; k++) residual_left[k] -= work->jacobian[i][c][k] * to_limit[i][c];
      }
    }
    if (!any) break;
    damped_step(block, work, residual_left, mu, held, step);
  }
  for (int i = 0; i < COUNT(block); i++) {
    for (int c = 0; c < 3; c++) {
      if (held[i][c]) step[i][c] = to_limit[i][c];
    }
  }
}

/* Commands within a box after one step by a damping mu that reduces a residual. */
void fl_step_commands(const real *block, fl_work *work, const fl_box *box, const real *residual,
                      real mu, real command[][3], real stepped[][3]) {
  real step[FL_MOST][3];
  fl_box kept;
  box = box_of_steps(block, box, command, &kept);
  find_jacobian(block, work, box, command);
  step_to_limits(block, work, box, command, residual, mu, step);
  take_step(block, box, command, step, stepped);
}
#endif

/* Levenberg-Marquardt steps on commands within a box towards a wrench [N, N m]; the error
   over the wrench scale that is left. */
real fl_refine_commands(const real *block, fl_work *work, const fl_box *box, const real *wrench,
                        real command[][3], int steps) {
  const size_t size = (size_t)COUNT(block) * sizeof *command;
  real residual[6];
  real error_squared = residual_of(block, work, wrench, command, residual);
  fl_box kept;
  if (error_squared > EXACT * EXACT) box = box_of_steps(block, box, command, &kept);
  real mu = NEARLY;
  int has_moved = 1;
  for (int k = 0; k < steps && error_squared > EXACT * EXACT && mu <= 1; k++) {
    real step[FL_MOST][3];
    real stepped[FL_MOST][3];
    real residual_stepped[6];
    work->refine_steps++;
    if (has_moved) find_jacobian(block, work, box, command);
    step_within(block, work, box, command, residual, mu, step);
    take_step(block, box, command, step, stepped);
    const real error_stepped = residual_of(block, work, wrench, stepped, residual_stepped);
    has_moved = error_stepped <= error_squared;
    if (!has_moved) {
      mu = mu * MU_REFUSED + NEARLY;
      continue;
    }
    memcpy(command, stepped, size);
    memcpy(residual, residual_stepped, sizeof residual);
    error_squared = error_stepped;
    mu *= MU_KEPT;
  }
  return SQRT(error_squared);
}
