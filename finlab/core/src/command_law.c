/* Laws of actuators by tables: the force of a command, its derivatives and its power, and a command
   for a force.

   The interpolation on grids is written in Python too, in finlab/actuators/hermite_grid.py;
   tests/core/test_command_law.py holds the two together. */
#include "internal.h"

#define GAUGE_STEP R(1e-3) /* angle [rad] over which the derivative of a gauge is taken */
#define BEAT_STEPS 6       /* sizes that the table of a fin is asked for, at most */
#define NEAR_BEAT R(1e-5)  /* error of a size, over it, of which the next step leaves rounding */
/* Error of a size, over the force of the wrench scale, that steps on commands may give. */
#define BEAT_ENOUGH (10 * EXACT)
#define LEAST_BEAT_SLOPE R(1e-3) /* of sizes by the law over those by the table: limits hold it */

/* Weights of four neighbours on an axis of knots, in value and in derivative, and the
   offsets of their values: a cubic whose slope at a knot is that of the line through its
   neighbours (Catmull and Rom). Beyond the ends nothing changes. */
typedef struct {
  real value[4], slope[4];
  int offset[4];
  int count; /* 1 where the axis has one knot, else 4 */
} knot_weights;

/* An axis of a grid. */
typedef struct {
  const real *knot;
  int count;   /* knots */
  int stride;  /* numbers from the value at one knot to that at the next */
  real period; /* 0 for none */
} grid_axis;

/* The cell between two of ascending knots in which x lies, of `cells` ones that reach to `end`. */
static int cell_of(const real *knot, int cells, real end, real x) {
  /* mostly right: most are even */
  int guess = (int)((x - knot[0]) / (end - knot[0]) * (real)cells);
  if (guess < 0) guess = 0;
  if (guess > cells - 1) guess = cells - 1;
  const int is_below_next = guess + 1 == cells || x < knot[guess + 1];
  if (knot[guess] <= x && is_below_next) return guess;
  int low = 0;
  int high = cells;
  while (high - low > 1) {
    const int between = (low + high) / 2;
    if (knot[between] <= x)
      low = between;
    else
      high = between;
  }
  return low;
}

/* Widths of the cells before and after a cell that begins at a knot; 0 beyond the ends of an
   axis without a period. */
static void neighbour_widths(const grid_axis *axis, int cell, real cell_end, real axis_end,
                             real *before, real *after) {
  const real *knot = axis->knot;
  const int count = axis->count;
  const int is_periodic = axis->period > 0;
  *before = 0;
  if (cell > 0)
    *before = knot[cell] - knot[cell - 1];
  else if (is_periodic)
    *before = axis_end - knot[count - 1];
  *after = 0;
  if (cell + 2 < count)
    *after = knot[cell + 2] - cell_end;
  else if (cell + 2 == count && is_periodic)
    *after = axis_end - cell_end;
  else if (is_periodic)
    *after = knot[1] - knot[0];
}

/* Which knot is neighbour k (0 to 3) of a cell, whose own knots are 1 and 2. */
static int neighbour_of(const grid_axis *axis, int cell, int k) {
  const int index = cell + k - 1;
  if (axis->period > 0) return (index + axis->count) % axis->count;
  if (index < 0) return 0;
  if (index > axis->count - 1) return axis->count - 1;
  return index;
}

static void weights_at(const grid_axis *axis, real x, int has_slope, knot_weights *weights) {
  const real *knot = axis->knot;
  const int count = axis->count;
  if (count == 1) {
    weights->value[0] = 1;
    weights->slope[0] = 0;
    weights->offset[0] = 0;
    weights->count = 1;
    return;
  }
  const real begin = knot[0];
  int cells = count - 1;
  real end = knot[count - 1];
  if (axis->period > 0) {
    cells = count;
    end = begin + axis->period;
    x -= axis->period * FLOOR((x - begin) / axis->period);
  }
  const real held = clipped(x, begin, end);
  const int cell = cell_of(knot, cells, end, held);
  const real from = knot[cell];
  real to = end;
  if (cell + 1 < count) to = knot[cell + 1];
  const real width = to - from;
  const real t = (held - from) / width; /* place in the cell, from 0 to 1 */
  real before;
  real after;
  neighbour_widths(axis, cell, to, end, &before, &after);

  /* Weights 1, t, t^2 and t^3 of each neighbour; those of 1 are 1 of the cell's first knot,
     else 0. */
  const real early = width / (before + width);
  const real late = width / (width + after);
  const real linear[4] = {-early, 0, early, 0};
  const real square[4] = {2 * early, late - 3, 3 - 2 * early, -late};
  const real cubic[4] = {-early, 2 - late, early - 2, late};
  real dt_dx = 0;
  if (has_slope && held == x) dt_dx = 1 / width;
  weights->count = 4;
  for (int k = 0; k < 4; k++) {
    weights->value[k] = (k == 1) + t * (linear[k] + t * (square[k] + t * cubic[k]));
    if (has_slope) {
      weights->slope[k] = dt_dx * (linear[k] + t * (2 * square[k] + 3 * t * cubic[k]));
    }
    weights->offset[k] = axis->stride * neighbour_of(axis, cell, k);
  }
}

/* A column of a grid at weights of its three axes, and, where there is room for them, its
   derivatives along these (3,). */
static real column_at(const real *values, const knot_weights *weights, real *slope) {
  real sum = 0;
  real by[3] = {0};
  for (int a = 0; a < weights[0].count; a++) {
    for (int f = 0; f < weights[1].count; f++) {
      const int offset = weights[0].offset[a] + weights[1].offset[f];
      const real weight = weights[0].value[a] * weights[1].value[f];
      for (int d = 0; d < weights[2].count; d++) {
        const real value = values[offset + weights[2].offset[d]];
        const real part = value * weights[2].value[d];
        sum += weight * part;
        if (!slope) continue;
        by[0] += weights[0].slope[a] * weights[1].value[f] * part;
        by[1] += weights[0].value[a] * weights[1].slope[f] * part;
        by[2] += weight * value * weights[2].slope[d];
      }
    }
  }
  for (int k = 0; slope && k < 3; k++) slope[k] = by[k];
  return sum;
}

/* A grid: counts of three axes, period of the third (0: none), whether the first axis is the
   product of the first two commands, columns c, whether the values are roots of what they
   stand for; then the knots of the axes, and c values at each point. Values (c,) and, where
   there is room for them, their derivatives by each command (3, c). */
static void grid_at(const real *grid, const real *command, real *value, real (*slope)[3]) {
  const int count[3] = {(int)grid[0], (int)grid[1], (int)grid[2]};
  const int is_product = grid[4] != 0;
  const int columns = (int)grid[5];
  const int is_root = grid[6] != 0;
  const int stride[3] = {columns * count[2] * count[1], columns * count[2], columns};
  const real period[3] = {0, 0, grid[3]};
  const real *knot = grid + 7;
  real along[3] = {command[0], command[1], command[2]};
  if (is_product) along[0] = command[0] * command[1];

  knot_weights weights[3];
  for (int k = 0; k < 3; k++) {
    const grid_axis axis = {knot, count[k], stride[k], period[k]};
    weights_at(&axis, along[k], slope != 0, &weights[k]);
    knot += count[k];
  }
  const real *values = knot;
  for (int c = 0; c < columns; c++) {
    real by[3];
    real *by_or_none = 0;
    if (slope) by_or_none = by;
    value[c] = column_at(values + c, weights, by_or_none);
    for (int k = 0; slope && k < 3; k++) slope[k][c] = by[k];
  }
  if (is_product && slope) {
    for (int c = 0; c < columns; c++) {
      slope[1][c] += slope[0][c] * command[0];
      slope[0][c] *= command[1];
    }
  }
  if (!is_root) return;
  for (int c = 0; c < columns; c++) {
    for (int k = 0; slope && k < 3; k++) slope[k][c] *= 2 * value[c];
    value[c] *= value[c];
  }
}

/* Force of a thruster: its one number. */
static void thruster_force(const real *block, const fl_actuator *a, const real *command,
                           real *force, real (*slope)[3], int has_slope) {
  (void)block;
  (void)a;
  (void)has_slope;
  force[0] = command[0];
  slope[0][0] = 1;
}

/* Force of a pod: its second number along its first, an angle; of a fin by its force with a
   gauge rho. */
static void pod_force(const real *block, const fl_actuator *a, const real *command, real *force,
                      real (*slope)[3], int has_slope) {
  const real angle = command[0];
  real along_x = COS(angle);
  real along_y = SIN(angle);
  real bend = 0; /* (d rho / d angle) / rho */
  if (has_gauge_table(a)) {
    const real *gauge = block + (int)a->gauge_table;
    const real rho = fl_gauge_radius(gauge, angle);
    if (has_slope) {
      const real rise = fl_gauge_radius(gauge, angle + GAUGE_STEP) -
                        fl_gauge_radius(gauge, angle - GAUGE_STEP);
      bend = rise / (2 * GAUGE_STEP * rho);
    }
    along_x *= rho;
    along_y *= rho;
  }
  force[1] = command[1] * along_x;
  force[2] = command[1] * along_y;
  slope[0][1] = bend * force[1] - force[2];
  slope[0][2] = bend * force[2] + force[1];
  slope[1][1] = along_x;
  slope[1][2] = along_y;
}

/* Lift of a foil and its drag beyond that at rest, by its angle. */
static void foil_force(const real *block, const fl_actuator *a, const real *command, real *force,
                       real (*slope)[3], int has_slope) {
  const real *grid = block + (int)a->law_grid;
  const real along[3] = {0, 0, command[0] - a->lean_angle};
  real by[3][3] = {{0}};
  real(*by_or_none)[3] = 0;
  if (has_slope) by_or_none = by;
  grid_at(grid, along, force, by_or_none);
  for (int k = 0; k < 2; k++) {
    force[k] *= a->pressure_area;
    slope[0][k] = a->pressure_area * by[2][k];
  }
  force[1] -= a->pressure_area * a->zero_lift_drag;
}

/* Force of a fin whose law gives a size, by amplitude and frequency, along the third
   command, an angle. */
static void sized_fin_force(const fl_actuator *a, const real *grid, const real *command,
                            real *force, real (*slope)[3], int has_slope) {
  real size;
  real by[3][3] = {{0}};
  real(*by_or_none)[3] = 0;
  if (has_slope) by_or_none = by;
  grid_at(grid, command, &size, by_or_none);
  real uneven = 1;
  real d_uneven = 0; /* its derivative by the angle */
  if (a->unevenness != 0) {
    const real angle = command[2] - a->unevenness_angle;
    uneven += a->unevenness * COS(angle);
    d_uneven = -a->unevenness * SIN(angle);
  }
  const real direction = command[2] + a->lean_angle;
  const real along_x = COS(direction);
  const real along_y = SIN(direction);
  const real d_size[3] = {by[0][0] * uneven, by[1][0] * uneven, size * d_uneven};
  size *= uneven;
  force[1] = size * along_x;
  force[2] = size * along_y;
  for (int k = 0; k < 3; k++) {
    slope[k][1] = d_size[k] * along_x;
    slope[k][2] = d_size[k] * along_y;
  }
  slope[2][1] -= force[2];
  slope[2][2] += force[1];
}

/* Force of a fin, by a law of one column, its size, or of three, along its own axes. */
static void fin_force(const real *block, const fl_actuator *a, const real *command, real *force,
                      real (*slope)[3], int has_slope) {
  const real *grid = block + (int)a->law_grid;
  const int columns = (int)grid[5];
  if (columns == 1) {
    sized_fin_force(a, grid, command, force, slope, has_slope);
    return;
  }
  real(*slope_or_none)[3] = 0;
  if (has_slope) slope_or_none = slope;
  grid_at(grid, command, force, slope_or_none);
}

/* Where an ascending column of a curve (count, 2) has a value: linear between its points. */
static real on_curve(const real *curve, real value) {
  const int count = (int)curve[0];
  const real *row = curve + 1;
  int low = 0;
  int high = count - 1;
  while (high - low > 1) {
    const int between = (low + high) / 2;
    if (row[2 * between] <= value)
      low = between;
    else
      high = between;
  }
  const real width = row[2 * high] - row[2 * low];
  real t = 0;
  if (width > 0) t = clipped((value - row[2 * low]) / width, 0, 1);
  return row[2 * low + 1] + t * (row[2 * high + 1] - row[2 * low + 1]);
}

/* Amplitude and frequency of a fin for a share of its largest force, from a table at shares
   (j / k)^2. */
static void beat_at(const real *beat, real share, real *command) {
  const int cells = (int)beat[0];
  const real position = SQRT(clipped(share, 0, 1)) * (real)cells;
  int cell = (int)position;
  if (cell > cells - 1) cell = cells - 1;
  const real *row = beat + 1 + 2 * cell;
  for (int k = 0; k < 2; k++) {
    command[k] = row[k] + (row[k + 2] - row[k]) * (position - (real)cell);
  }
}

/* Command of a thruster for a force along its row. */
static void thruster_command(const real *block, int i, const fl_box *box, const real *force,
                             const real *before, real *command) {
  (void)before;
  const real wanted = ACTUATOR(block, i)->command_sign * force[0];
  command[0] = fl_clip_number(box, i, 0, NO_NUMBER, wanted);
  command[1] = 0;
  command[2] = 0;
}

/* Angle of a foil for a lift, the first of its rows. */
static void foil_command(const real *block, int i, const fl_box *box, const real *force,
                         const real *before, real *command) {
  (void)before;
  const fl_actuator *a = ACTUATOR(block, i);
  const real lift = force[0];
  real angle = on_curve(block + (int)a->command_table, FABS(lift) / a->pressure_area);
  if (lift < 0) angle = -angle;
  command[0] = fl_clip_number(box, i, 0, NO_NUMBER, angle + a->zero_lift_angle);
  command[1] = 0;
  command[2] = 0;
}

/* Beat of a fin for a force in its plane: the tables are asked for what gives its size by the law,
   by the secant method. Steps on the commands, which would give the rest, leave the cheapest beat
   of a size. */
static void fin_command(const real *block, int i, const fl_box *box, const real *force,
                        const real *before, real *command) {
  (void)before;
  const fl_actuator *a = ACTUATOR(block, i);
  const real *gauge = 0;
  if (has_gauge_table(a)) gauge = block + (int)a->gauge_table;
  const real size = size_of(force);
  const real direction = ATAN2(force[1], force[0]);
  real angle = direction;
  real wanted = size; /* what the table is asked for */
  const real enough = BEAT_ENOUGH * HEAD(block)->wrench_scale[0];
  real wanted_before = 0;
  real given_before = 0;
  for (int k = 0; k < BEAT_STEPS; k++) {
    real most = a->force_max;
    real lean = a->lean_angle;
    if (gauge) {
      most = a->force_max * fl_gauge_radius(gauge, angle);
      lean = fl_gauge_lean(gauge, angle);
    }
    wanted = clipped(wanted, 0, most);
    beat_at(block + (int)a->command_table, wanted / most, command);
    command[2] = angle - lean;
    for (int c = 0; c < 3; c++) command[c] = fl_clip_number(box, i, c, 2, command[c]);
    const int is_exact_next = k > 0 && FABS(size - given_before) <= NEAR_BEAT * size;
    if (is_exact_next || k == BEAT_STEPS - 1) break;
    real delivered[3];
    fl_force_of_command(block, i, command, delivered, 0);
    const real given = size_of(delivered + 1);
    if (k > 0 && FABS(size - given) <= enough) break;
    real slope = 1; /* of what is given over what is asked for */
    if (k > 0) slope = (given - given_before) / (wanted - wanted_before);
    if (!(slope > LEAST_BEAT_SLOPE)) break; /* NaN where both are the same */
    wanted_before = wanted;
    given_before = given;
    wanted += (size - given) / slope;
    if (gauge && size > 0) angle += fl_wrap_angle(direction - ATAN2(delivered[2], delivered[1]));
  }
}

/* A command of a pod one way or the other: how far its force is from the wanted one, and its
   power. */
typedef struct {
  real angle, force;
  real miss;  /* [N] */
  real power; /* [W] */
} pod_way;

static pod_way pod_way_of(const real *block, int i, const fl_box *box, real angle, real size,
                          int is_back) {
  real force = size;
  if (is_back) force = -size;
  pod_way way;
  way.angle = fl_clip_number(box, i, 0, 0, angle + (real)is_back * PI);
  way.angle = fl_leave_zone(ACTUATOR(block, i), way.angle);
  way.force = fl_clip_number(box, i, 1, 0, force);
  const real dx = way.force * COS(way.angle) - size * COS(angle);
  const real dy = way.force * SIN(way.angle) - size * SIN(angle);
  way.miss = SQRT(dx * dx + dy * dy);
  way.power = fl_power_of_force(block, i, way.force);
  return way;
}

/* Angle and force of a pod, one way or the other: what comes nearer to a force, or the
   cheaper one. */
static void pod_command(const real *block, int i, const fl_box *box, const real *force,
                        const real *before, real *command) {
  const fl_actuator *a = ACTUATOR(block, i);
  const real direction = ATAN2(force[1], force[0]);
  real size = size_of(force);
  if (has_gauge_table(a)) size /= fl_gauge_radius(block + (int)a->gauge_table, direction);
  real angle = 0;
  if (before) angle = before[fl_form_of(a)->angle_number];
  if (size > 0) angle = direction;
  const pod_way ahead = pod_way_of(block, i, box, angle, size, 0);
  const pod_way back = pod_way_of(block, i, box, angle, size, 1);
  const real slack = NEARLY * a->command_max[1];
  const int is_nearer = back.miss < ahead.miss - slack;
  const int is_as_near = back.miss <= ahead.miss + slack;
  const int is_cheaper = back.power < ahead.power * (1 - NEARLY);
  pod_way chosen = ahead;
  if (box->command_min[i][1] < 0 && (is_nearer || (is_as_near && is_cheaper))) chosen = back;
  command[0] = chosen.angle;
  command[1] = chosen.force;
  command[2] = 0;
}

/* Least and largest force of a fin, or lift of a foil, on a grid of the commands within a
   box; and the direction of the largest one. */
#define PROBES 5
static void sizes_in(const real *block, int i, const fl_box *box, real *least, real *largest,
                     real *direction) {
  const int is_lift = fl_form_of(ACTUATOR(block, i))->has_drag;
  const real *low = box->command_min[i];
  const real *high = box->command_max[i];
  *least = LARGEST_NUMBER;
  *largest = -LARGEST_NUMBER;
  *direction = 0;
  for (int j = 0; j < PROBES * PROBES; j++) {
    real command[3] = {0, 0, (low[2] + high[2]) / 2};
    real force[3];
    if (is_lift) {
      command[0] = low[0] + (real)j / (PROBES * PROBES - 1) * (high[0] - low[0]);
    } else {
      command[0] = low[0] + (real)(j % PROBES) / (PROBES - 1) * (high[0] - low[0]);
      command[1] = low[1] + (real)(j / PROBES) / (PROBES - 1) * (high[1] - low[1]);
    }
    fl_force_of_command(block, i, command, force, 0);
    real size = force[0];
    if (!is_lift) size = size_of(force + 1);
    if (size > *largest) *direction = ATAN2(force[2], force[1]);
    *least = smaller(*least, size);
    *largest = larger(*largest, size);
  }
}

static force_range thruster_range(const real *block, int i, const fl_box *box) {
  const real low = box->command_min[i][0];
  const real high = box->command_max[i][0];
  force_range range = {low, high, 0, 0};
  if (!(ACTUATOR(block, i)->command_sign > 0)) {
    range.low = -high;
    range.high = -low;
  }
  return range;
}

static force_range foil_range(const real *block, int i, const fl_box *box) {
  force_range range = {0, 0, 0, 0};
  real unused;
  sizes_in(block, i, box, &range.low, &range.high, &unused);
  return range;
}

/* Arc of the angles of a command within a box; `low` and `high` are 0. */
static force_range arc_of(const real *block, int i, const fl_box *box) {
  const int angle = fl_form_of(ACTUATOR(block, i))->angle_number;
  const real low = box->command_min[i][angle];
  const real high = box->command_max[i][angle];
  force_range range = {0, 0, (low + high) / 2, (high - low) / 2};
  if (range.half >= PI - NOTHING) range.half = PI;
  return range;
}

static force_range pod_range(const real *block, int i, const fl_box *box) {
  force_range range = arc_of(block, i, box);
  range.low = box->command_min[i][1];
  range.high = box->command_max[i][1];
  return range;
}

static force_range fin_range(const real *block, int i, const fl_box *box) {
  const fl_actuator *a = ACTUATOR(block, i);
  force_range range = arc_of(block, i, box);
  real direction;
  sizes_in(block, i, box, &range.low, &range.high, &direction);
  /* where the force points at the middle of the commands' arc */
  range.middle += fl_wrap_angle(direction - range.middle);
  if (has_gauge_table(a)) {
    const real rho = fl_gauge_radius(block + (int)a->gauge_table, range.middle);
    range.low /= rho;
    range.high /= rho;
  }
  return range;
}

/* The law of a kind of command, in three questions. */
typedef struct {
  /* Becomes the force (3,) of a command, and where `has_slope` its derivatives (3, 3); both are
     zeros before. */
  void (*force)(const real *block, const fl_actuator *a, const real *command, real *force,
                real (*slope)[3], int has_slope);
  /* Becomes the command within a box for a force along the rows, `before` the one of the tick
     before or 0. */
  void (*command)(const real *block, int i, const fl_box *box, const real *force,
                  const real *before, real *command);
  /* What commands within a box give. */
  force_range (*range)(const real *block, int i, const fl_box *box);
} command_law;

#if FL_SLIPSTREAMS
/* Force of a propeller with a rudder in its slipstream, by deflection and thrust T, beyond that
   at T = -p: (T + p) g, where g = (1 - sigma CD, sigma CL) is the law's grid and p the thrust
   whose slipstream is as fast as the flow. In reverse nothing meets the rudder. */
static void steered_force(const real *block, const fl_actuator *a, const real *command, real *force,
                          real (*slope)[3], int has_slope) {
  const real slipstream = command[1] + a->pressure_area;
  if (slipstream < 0) {
    force[1] = slipstream;
    slope[1][1] = 1;
    return;
  }
  const real along[3] = {0, 0, command[0]};
  real g[2];
  real by[3][3] = {{0}};
  real(*by_or_none)[3] = 0;
  if (has_slope) by_or_none = by;
  grid_at(block + (int)a->law_grid, along, g, by_or_none);
  for (int k = 0; k < 2; k++) {
    force[1 + k] = slipstream * g[k];
    slope[0][1 + k] = slipstream * by[2][k];
    slope[1][1 + k] = g[k];
  }
}

/* Deflection and thrust for a force in the plane of a propeller with a rudder; with no force, the
   deflection before. */
static void steered_command(const real *block, int i, const fl_box *box, const real *force,
                            const real *before, real *command) {
  const fl_actuator *a = ACTUATOR(block, i);
  const real size = size_of(force);
  const real direction = ATAN2(force[1], force[0]);
  const int is_reverse = COS(direction) < 0;
  real deflection = 0;
  if (before) deflection = before[0];
  real slipstream = size;
  if (is_reverse) {
    slipstream = -size;
  } else if (size > 0) {
    slipstream = size / fl_steered_radius(block, i, direction);
    deflection = fl_steered_deflection(block, i, direction);
  }
  command[0] = fl_clip_number(box, i, 0, NO_NUMBER, deflection);
  command[1] = fl_clip_number(box, i, 1, NO_NUMBER, slipstream - a->pressure_area);
  command[2] = 0;
}

/* Direction of the force of a propeller with a rudder at a deflection [rad]. */
static real steered_direction(const real *block, int i, real deflection) {
  const real command[3] = {deflection, 1, 0};
  real force[3];
  fl_force_of_command(block, i, command, force, 0);
  return ATAN2(force[2], force[1]);
}

static force_range steered_range(const real *block, int i, const fl_box *box) {
  const fl_actuator *a = ACTUATOR(block, i);
  const real p = a->pressure_area;
  const real first = steered_direction(block, i, box->command_min[i][0]);
  const real last = steered_direction(block, i, box->command_max[i][0]);
  const real end_low = a->sector_center - a->sector_half_angle;
  const real end_high = a->sector_center + a->sector_half_angle;
  const real low = clipped(first, end_low, end_high);
  const real high = clipped(last, end_low, end_high);
  force_range range = {0, 0, (low + high) / 2, (high - low) / 2};
  range.low = box->command_min[i][1] + p;
  range.high = box->command_max[i][1] + p;
  return range;
}
#endif

static const command_law LAWS[FL_KINDS] = {
    [FL_THRUSTER] = {thruster_force, thruster_command, thruster_range},
    [FL_POD] = {pod_force, pod_command, pod_range},
    [FL_FIN] = {fin_force, fin_command, fin_range},
    [FL_FOIL] = {foil_force, foil_command, foil_range},
#if FL_SLIPSTREAMS
    [FL_STEERED] = {steered_force, steered_command, steered_range},
#endif
};

static const command_law *law_of(const fl_actuator *a) { return LAWS + (int)a->command_kind; }

/* Force along an actuator's own axes (3,) of a command (3,), and, where there is room for
   them, its derivatives (3 commands, 3 axes). */
void fl_force_of_command(const real *block, int i, const real *command, real *force,
                         real (*slope)[3]) {
  const fl_actuator *a = ACTUATOR(block, i);
  const int has_slope = slope != 0;
  real unused[3][3];
  if (!has_slope) slope = unused;
  memset(force, 0, 3 * sizeof *force);
  memset(slope, 0, 9 * sizeof **slope);
  law_of(a)->force(block, a, command, force, slope, has_slope);
}

/* A command within a box for a force, as near as the tables are; an angle that does not
   count stays that of the command before, where there is one. */
void fl_command_for_force(const real *block, int i, const fl_box *box, const real *force,
                          const real *before, real *command) {
  law_of(ACTUATOR(block, i))->command(block, i, box, force, before, command);
}

/* What commands within a box give: least and largest force [N], of planes below 0 in
   reverse, and the arc of their directions [rad]. */
force_range fl_force_range(const real *block, int i, const fl_box *box) {
  return law_of(ACTUATOR(block, i))->range(block, i, box);
}

/* Commands within a box for the forces of all actuators; `previous` commands (n, 3) or 0. */
void fl_commands_for_forces(const real *block, const fl_box *box, real force[][2],
                            const real *previous, real command[][3]) {
  for (int i = 0; i < COUNT(block); i++) {
    const real *before = 0;
    if (previous && fl_is_known_command(previous + 3 * i)) before = previous + 3 * i;
    fl_command_for_force(block, i, box, force[i], before, command[i]);
  }
}

/* The force along the rows of a command, and its cost [W]. */
real fl_power_of_command(const real *block, int i, const real *command, real *force) {
  const fl_actuator *a = ACTUATOR(block, i);
  real along[3];
  fl_force_of_command(block, i, command, along, 0);
  const int is_in_reverse = fl_is_in_reverse(a, command);
  real size;
  if (is_plane(a)) {
    force[0] = along[1];
    force[1] = along[2];
    size = size_of(force);
    if (!is_in_reverse) size /= fl_radius(block, i, ATAN2(along[2], along[1]));
  } else {
    force[0] = a->command_sign * along[0];
    size = force[0];
  }
  if (is_foil(a)) {
    fl_tangent tangent;
    fl_foil_at(block, i, command[0], &tangent);
    force[1] = tangent.force[1];
    return tangent.cost;
  }
  if (is_in_reverse) size = -size;
  return fl_power_of_force(block, i, size);
}

/* Forces along the rows of commands, and their cost [W]. */
real fl_power_of_commands(const real *block, const fl_work *work, real command[][3],
                          real force[][2]) {
  real cost = 0;
  for (int i = 0; i < COUNT(block); i++) {
    force[i][0] = 0;
    force[i][1] = 0;
    if (!work->span.is_lost[i]) cost += fl_power_of_command(block, i, command[i], force[i]);
  }
  return cost;
}
