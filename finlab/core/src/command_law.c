/* Laws of actuators by tables: the force of a command, its derivatives, and a command for a force. */
#include "internal.h"

/* Weights of four neighbours in value and derivative, and where their values are, on an axis of knots with values `each`
   apart: a cubic whose slope at a knot is that of the line through its neighbours. Beyond the ends nothing changes. */
typedef struct { real value[4], slope[4]; int at[4], count; } weights;

static void weights_at(const real *knot, int count, int each, real period, real x, int steep, weights *w) {
  w->value[0] = 1, w->slope[0] = 0, w->at[0] = 0, w->count = 1;
  if (count == 1) return;
  int cells = period > 0 ? count : count - 1, low = 0, high = cells;
  real begin = knot[0], end = period > 0 ? begin + period : knot[count - 1], held;
  if (period > 0) x -= period * FLOOR((x - begin) / period);
  held = CLIP(x, begin, end);
  int guess = (int)((held - begin) / (end - begin) * (real)cells); /* mostly right, as most knots are even */
  guess = CLIP(guess, 0, cells - 1);
  if (knot[guess] <= held && (guess + 1 == cells || held < knot[guess + 1]))
    low = guess;
  else
    while (high - low > 1) {
      int between = (low + high) / 2;
      if (knot[between] <= held)
        low = between;
      else
        high = between;
    }
  real from = knot[low], to = low + 1 < count ? knot[low + 1] : end, width = to - from, t = (held - from) / width;
  real before = low > 0 ? from - knot[low - 1] : period > 0 ? end - knot[count - 1] : 0;
  real after = low + 2 < count ? knot[low + 2] - to : low + 2 == count && period > 0 ? end - to : period > 0 ? knot[1] - knot[0] : 0;
  real early = width / (before + width), late = width / (width + after), pace = steep && held == x ? 1 / width : 0;
  real linear[4] = {-early, 0, early, 0}, square[4] = {2 * early, late - 3, 3 - 2 * early, -late};
  real cubic[4] = {-early, 2 - late, early - 2, late};
  w->count = 4;
  for (int k = 0; k < 4; k++) {
    w->value[k] = (k == 1) + t * (linear[k] + t * (square[k] + t * cubic[k]));
    if (steep) w->slope[k] = pace * (linear[k] + t * (2 * square[k] + 3 * t * cubic[k]));
    w->at[k] = each * (period > 0 ? (low + k - 1 + count) % count : CLIP(low + k - 1, 0, count - 1));
  }
}

/* A grid: counts of three axes, period of the third (0: none), whether the first axis is the product of the first
   two commands, columns c, whether the values are roots of what they stand for; then the knots of the axes, and c
   values at each point. Values (c,) and, where there is room for them, their derivatives by each command (3, c). */
static void grid_at(const real *grid, const real *command, real *value, real (*slope)[3]) {
  int count[3] = {(int)grid[0], (int)grid[1], (int)grid[2]}, product = grid[4] != 0, columns = (int)grid[5];
  int each[3] = {columns * count[2] * count[1], columns * count[2], columns};
  const real *knot = grid + 7, *values = knot + count[0] + count[1] + count[2];
  real at[3] = {product ? command[0] * command[1] : command[0], command[1], command[2]};
  weights w[3];
  for (int k = 0; k < 3; knot += count[k++]) weights_at(knot, count[k], each[k], k == 2 ? grid[3] : 0, at[k], slope != 0, w + k);
  for (int c = 0; c < columns; c++, values++) {
    real sum = 0, by[3] = {0};
    for (int a = 0; a < w[0].count; a++)
      for (int f = 0; f < w[1].count; f++)
        for (int d = 0; d < w[2].count; d++) {
          real own = values[w[0].at[a] + w[1].at[f] + w[2].at[d]], v = own * w[2].value[d];
          sum += w[0].value[a] * w[1].value[f] * v;
          if (!slope) continue;
          by[0] += w[0].slope[a] * w[1].value[f] * v, by[1] += w[0].value[a] * w[1].slope[f] * v;
          by[2] += w[0].value[a] * w[1].value[f] * own * w[2].slope[d];
        }
    value[c] = sum;
    for (int k = 0; slope && k < 3; k++) slope[k][c] = by[k];
  }
  if (product && slope)
    for (int c = 0; c < columns; c++) {
      slope[1][c] += slope[0][c] * command[0];
      slope[0][c] *= command[1];
    }
  if (grid[6] != 0)
    for (int c = 0; c < columns; c++) {
      for (int k = 0; slope && k < 3; k++) slope[k][c] *= 2 * value[c];
      value[c] *= value[c];
    }
}

/* Force along an actuator's own axes (3,) of a command (3,), and, where there is room for them, its derivatives
   (3 commands, 3 axes). */
void fl_force_of_command(const real *block, int i, const real *command, real *force, real (*slope)[3]) {
  const fl_actuator *a = ACTUATOR(block, i);
  const real *grid = block + (int)a->law;
  real none[3][3];
  int steep = slope != 0;
  if (!slope) slope = none;
  memset(force, 0, 3 * sizeof *force);
  memset(slope, 0, 9 * sizeof **slope);
  if (a->form == FL_THRUSTER)
    force[0] = command[0], slope[0][0] = 1;
  else if (a->form == FL_POD) {
    real c = COS(command[0]), s = SIN(command[0]), bend = 0;
    if (a->gauge > 0) { /* of a fin by its force */
      const real *gauge = block + (int)a->gauge;
      real rho = fl_gauge_radius(gauge, command[0]), h = R(1e-3);
      if (steep) bend = (fl_gauge_radius(gauge, command[0] + h) - fl_gauge_radius(gauge, command[0] - h)) / (2 * h * rho);
      c *= rho, s *= rho;
    }
    force[1] = command[1] * c, force[2] = command[1] * s;
    slope[0][1] = bend * force[1] - force[2], slope[0][2] = bend * force[2] + force[1], slope[1][1] = c, slope[1][2] = s;
  } else if (a->form == FL_FOIL) {
    real at[3] = {0, 0, command[0] - a->lean}, by[3][3] = {{0}};
    grid_at(grid, at, force, steep ? by : 0);
    for (int k = 0; k < 2; k++) force[k] *= a->pressure, slope[0][k] = a->pressure * by[2][k];
    force[1] -= a->pressure * a->rest;
  } else if (grid[5] == 1) { /* a size along a direction */
    real size, by[3][3] = {{0}}, around = command[2] - a->uneven_at, uneven = 1, bend = 0;
    real c = COS(command[2] + a->lean), s = SIN(command[2] + a->lean);
    grid_at(grid, command, &size, steep ? by : 0);
    if (a->uneven != 0) uneven += a->uneven * COS(around), bend = -a->uneven * SIN(around);
    real parts[3] = {by[0][0] * uneven, by[1][0] * uneven, size * bend};
    size *= uneven;
    force[1] = size * c, force[2] = size * s;
    for (int k = 0; k < 3; k++) slope[k][1] = parts[k] * c, slope[k][2] = parts[k] * s;
    slope[2][1] -= force[2], slope[2][2] += force[1];
  } else
    grid_at(grid, command, force, steep ? slope : 0);
}

/* Where an ascending column of a curve (count, 2) has a value: linear between its points. */
static real on_curve(const real *curve, real value) {
  int count = (int)curve[0], low = 0, high = count - 1;
  const real *row = curve + 1;
  while (high - low > 1) {
    int between = (low + high) / 2;
    if (row[2 * between] <= value)
      low = between;
    else
      high = between;
  }
  real width = row[2 * high] - row[2 * low], t = width > 0 ? CLIP((value - row[2 * low]) / width, 0, 1) : 0;
  return row[2 * low + 1] + t * (row[2 * high + 1] - row[2 * low + 1]);
}

/* Amplitude and frequency of a fin for a share of its largest force, from a table at shares (j / k)^2. */
static void beat_at(const real *beat, real share, real *command) {
  int cells = (int)beat[0];
  real place = SQRT(CLIP(share, 0, 1)) * (real)cells;
  int cell = MIN((int)place, cells - 1);
  const real *row = beat + 1 + 2 * cell;
  for (int k = 0; k < 2; k++) command[k] = row[k] + (row[k + 2] - row[k]) * (place - (real)cell);
}

static void fin_command(const real *block, int i, const fl_box *box, const real *force, real *command) {
  const fl_actuator *a = ACTUATOR(block, i);
  const real *gauge = a->gauge > 0 ? block + (int)a->gauge : 0;
  real angle = ATAN2(force[1], force[0]), size = size_of(force), wanted = size;
  real given[3];
  for (int k = 0; k < 2; k++) { /* what the tables leave undone is asked for on top */
    real most = a->high * (gauge ? fl_gauge_radius(gauge, angle) : 1), lean = gauge ? fl_gauge_lean(gauge, angle) : a->lean;
    beat_at(block + (int)a->beat, wanted / most, command);
    command[2] = angle - lean;
    for (int c = 0; c < 3; c++) command[c] = fl_clip_number(box, i, c, 2, command[c]);
    if (k == 1) break;
    fl_force_of_command(block, i, command, given, 0);
    wanted = MAX(wanted + size - size_of(given + 1), 0);
    if (gauge && size > 0) angle += fl_wrap_angle(ATAN2(force[1], force[0]) - ATAN2(given[2], given[1]));
  }
}

/* Angle and force of a pod, one way or the other: what comes nearer to a force, or the cheaper one. */
static void pod_command(const real *block, int i, const fl_box *box, const real *force, real before, real *command) {
  const fl_actuator *a = ACTUATOR(block, i);
  real size = size_of(force) / (a->gauge > 0 ? fl_gauge_radius(block + (int)a->gauge, ATAN2(force[1], force[0])) : 1);
  real angle = size > 0 ? ATAN2(force[1], force[0]) : before, way[2][2], missing[2], watts[2];
  for (int k = 0; k < 2; k++) {
    way[k][0] = fl_clip_number(box, i, 0, 0, angle + (real)k * PI), way[k][1] = fl_clip_number(box, i, 1, 0, k ? -size : size);
    real dx = way[k][1] * COS(way[k][0]) - size * COS(angle), dy = way[k][1] * SIN(way[k][0]) - size * SIN(angle);
    missing[k] = SQRT(dx * dx + dy * dy), watts[k] = fl_power_of_force(block, i, way[k][1]);
  }
  real least = NEARLY * a->upper[1];
  int back = box->low[i][1] < 0 && (missing[1] < missing[0] - least ||
                                    (missing[1] <= missing[0] + least && watts[1] < watts[0] * (1 - NEARLY)));
  command[0] = way[back][0], command[1] = way[back][1], command[2] = 0;
}

/* A command within a box for a force, as near as the tables are; an angle that does not count stays that of the
   command before, where there is one. */
void fl_command_for_force(const real *block, int i, const fl_box *box, const real *force, const real *before, real *command) {
  const fl_actuator *a = ACTUATOR(block, i);
  if (a->form == FL_FIN)
    fin_command(block, i, box, force, command);
  else if (a->form == FL_POD)
    pod_command(block, i, box, force, before ? before[0] : 0, command);
  else {
    real angle = a->form == FL_FOIL ? on_curve(block + (int)a->beat, FABS(force[0]) / a->pressure) : 0;
    command[0] = a->form == FL_FOIL ? (force[0] < 0 ? -angle : angle) + a->turned : a->sign * force[0];
    command[0] = fl_clip_number(box, i, 0, -1, command[0]), command[1] = command[2] = 0;
  }
}

/* Least and largest force of a fin, or lift of a foil, on a grid of the commands within a box; and the direction of the
   largest one. */
#define PROBES 5
static void sizes_in(const real *block, int i, const fl_box *box, real *least, real *largest, real *direction) {
  const fl_actuator *a = ACTUATOR(block, i);
  const real *low = box->low[i];
  const real *high = box->high[i];
  *least = R(1e30);
  *largest = -R(1e30);
  *direction = 0;
  for (int j = 0; j < PROBES * PROBES; j++) {
    real command[3] = {0, 0, (low[2] + high[2]) / 2};
    real force[3];
    if (a->form == FL_FOIL) {
      command[0] = low[0] + (real)j / (PROBES * PROBES - 1) * (high[0] - low[0]);
    } else {
      command[0] = low[0] + (real)(j % PROBES) / (PROBES - 1) * (high[0] - low[0]);
      command[1] = low[1] + (real)(j / PROBES) / (PROBES - 1) * (high[1] - low[1]);
    }
    fl_force_of_command(block, i, command, force, 0);
    const real size = a->form == FL_FOIL ? force[0] : size_of(force + 1);
    if (size > *largest) *direction = ATAN2(force[2], force[1]);
    *least = MIN(*least, size);
    *largest = MAX(*largest, size);
  }
}

/* What commands within a box give: least and largest force [N], of planes below 0 in reverse, and the arc of their
   directions [rad]. */
force_range fl_force_range(const real *block, int i, const fl_box *box) {
  const fl_actuator *a = ACTUATOR(block, i);
  const real *low = box->low[i];
  const real *high = box->high[i];
  force_range o = {0, 0, 0, 0};
  if (a->form == FL_THRUSTER) {
    o.low = a->sign > 0 ? low[0] : -high[0];
    o.high = a->sign > 0 ? high[0] : -low[0];
    return o;
  }
  if (a->form == FL_FOIL) {
    real none;
    sizes_in(block, i, box, &o.low, &o.high, &none);
    return o;
  }
  const int angle = fl_angle_number(a);
  o.middle = (low[angle] + high[angle]) / 2;
  o.half = (high[angle] - low[angle]) / 2;
  if (o.half >= PI - NOTHING) o.half = PI;
  o.low = low[1];
  o.high = high[1];
  if (a->form == FL_POD) return o;
  real direction;
  sizes_in(block, i, box, &o.low, &o.high, &direction);
  o.middle += fl_wrap_angle(direction - o.middle); /* where the force points at the middle of the commands' arc */
  if (a->gauge > 0) {
    const real rho = fl_gauge_radius(block + (int)a->gauge, o.middle);
    o.low /= rho;
    o.high /= rho;
  }
  return o;
}

void fl_commands_for_forces(const real *block, const fl_box *box, real force[][2], const real *previous, real command[][3]) {
  for (int i = 0; i < COUNT(block); i++) {
    const real *before = previous && fl_is_known_command(previous + 3 * i) ? previous + 3 * i : 0;
    fl_command_for_force(block, i, box, force[i], before, command[i]);
  }
}
