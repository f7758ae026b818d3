/* Whether a block is a robot that the core can work with. It may come from a file that was cut,
   changed or written by a stranger: before anything reads it, its numbers are finite, its counts
   and offsets lie within it, and its ranges make sense.

   A comparison with NaN is false, so each check asks what has to hold. */
#include "internal.h"

#define MOST_ENTRIES 65536 /* of a table, or of one axis of a grid */

enum { GRID_HEADER = 7 }; /* numbers before the knots of a grid, see command_law.c */

/* How a kind of table lies in the block, see fl_work.h. */
typedef struct {
  int header;      /* numbers before its points */
  int count_index; /* which of them is the count */
  int per_point;   /* numbers of each point */
  int more_points; /* 1 where the count is that of the cells between points, else 0 */
} table_shape;

static const table_shape FORCE_TABLE = {3, 1, 3, 1};
static const table_shape GAUGE = {1, 0, 4, 0};
static const table_shape BEAT = {1, 0, 2, 1};
static const table_shape CURVE = {1, 0, 2, 0};

static int is_whole_number(real value, real least, real most) {
  return value >= least && value <= most && value == FLOOR(value);
}

/* Whether so many numbers from an offset on lie in a block of a length. */
static int fits(real offset, real length, int numbers) {
  return offset == FLOOR(offset) && offset > 0 && offset + (real)numbers <= length;
}

static int is_table(const real *block, real offset, table_shape shape) {
  const real length = HEAD(block)->length;
  if (!fits(offset, length, 3)) return 0;
  const real count = block[(int)offset + shape.count_index];
  if (!is_whole_number(count, 1, MOST_ENTRIES)) return 0;
  const int points = (int)count + shape.more_points;
  return fits(offset, length, shape.header + shape.per_point * points);
}

static int is_table_or_none(const real *block, real offset, table_shape shape) {
  return offset == 0 || is_table(block, offset, shape);
}

/* Whether knots ascend. */
static int are_ascending(const real *knot, int count) {
  for (int j = 1; j < count; j++) {
    if (!(knot[j] > knot[j - 1])) return 0;
  }
  return 1;
}

/* Whether a grid lies in the block: three axes of ascending knots, a period of the third that is
   wider than they are, 1 to 3 columns. */
static int is_grid(const real *block, real offset) {
  const real length = HEAD(block)->length;
  if (!fits(offset, length, GRID_HEADER)) return 0;
  const real *grid = block + (int)offset;
  real knots = 0;
  real points = 1;
  for (int k = 0; k < 3; k++) {
    if (!is_whole_number(grid[k], 1, MOST_ENTRIES)) return 0;
    knots += grid[k];
    points *= grid[k];
  }
  const real period = grid[3];
  const real columns = grid[5];
  if (!(period >= 0 && is_whole_number(columns, 1, 3))) return 0;
  if (offset + (real)GRID_HEADER + knots + points * columns > length) return 0;
  const real *axis = grid + GRID_HEADER;
  for (int k = 0; k < 3; k++) {
    if (!are_ascending(axis, (int)grid[k])) return 0;
    axis += (int)grid[k];
  }
  const real last_knot = axis[-1];
  const real first_knot = axis[-(int)grid[2]];
  return period == 0 || first_knot + period > last_knot;
}

static int are_command_limits(const fl_actuator *a) {
  const int used = fl_form_of(a)->numbers;
  for (int k = 0; k < 3; k++) {
    if (!(a->max_change[k] >= 0)) return 0;
    if (k < used && !(a->command_min[k] <= a->command_max[k])) return 0;
    const int is_zero = a->command_min[k] == 0 && a->command_max[k] == 0;
    if (k >= used && !is_zero) return 0;
  }
  return 1;
}

/* Whether the barred zones of an actuator, if it has any, lie one above the other within the arc of
   a pod that pushes one way. */
static int are_barred_zones(const fl_actuator *a) {
  if (!is_whole_number(a->barred_count, 0, FL_ZONES)) return 0;
  if (FL_ZONES == 0 || a->barred_count == 0) return 1;
  if (!fl_aims_force(a) || a->force_min < 0 || a->is_free_angle != 0) return 0;
  real below = a->command_min[0];
  for (int k = 0; k < (int)a->barred_count; k++) {
    if (!(below <= a->barred[k][0] && a->barred[k][0] <= a->barred[k][1])) return 0;
    below = a->barred[k][1];
  }
  return below <= a->command_max[0] && a->command_max[0] - a->command_min[0] <= 2 * PI;
}

/* Whether the ends of a curve lie in the block: two rows, whose deflections rise. */
static int are_ends(const real *block, real offset) {
  if (!is_table(block, offset, CURVE)) return 0;
  const real *ends = block + (int)offset;
  return ends[0] == 2 && ends[2] <= ends[4];
}

/* Whether all offsets of an actuator are those of tables that it needs. */
static int has_tables(const real *block, const fl_actuator *a) {
  const command_form *form = fl_form_of(a);
  if (!is_table(block, a->force_table, FORCE_TABLE)) return 0;
  if (!is_table_or_none(block, a->force_table_reverse, FORCE_TABLE)) return 0;
  if (!FL_GAUGES && a->gauge_table != 0) return 0;
  if (!is_table_or_none(block, a->gauge_table, GAUGE)) return 0;
  if (form->command_table == BEAT_TABLE && !is_table(block, a->command_table, BEAT)) return 0;
  if (form->command_table == CURVE_TABLE && !is_table(block, a->command_table, CURVE)) return 0;
  if (form->command_table == ENDS_TABLE && !are_ends(block, a->command_table)) return 0;
  if (form->has_law_grid) return is_grid(block, a->law_grid);
  return a->law_grid == 0;
}

/* An error code of one actuator. */
static int check_actuator(const real *block, const fl_actuator *a) {
  if (a->rows != 1 && a->rows != 2) return FL_BAD_BLOCK;
  if (!is_whole_number(a->command_kind, 0, FL_KINDS - 1)) return FL_BAD_BLOCK;
  if (!has_tables(block, a)) return FL_BAD_BLOCK;
  if (!are_command_limits(a)) return FL_BAD_NUMBER;
  const real price_max = block[(int)a->force_table];
  if (!(price_max > 0)) return FL_BAD_NUMBER;
  if (a->force_table_reverse != 0 && !(block[(int)a->force_table_reverse] > 0))
    return FL_BAD_NUMBER;
  if (!(a->force_scale > 0 && a->power_scale > 0 && a->row_force_max[0] > 0)) return FL_BAD_NUMBER;
  if (!(a->force_min <= a->force_max && a->sector_half_angle >= 0)) return FL_BAD_NUMBER;
  if (!(a->dead_band >= 0 && a->flow_speed >= 0 && a->uncertainty_cost >= 0)) return FL_BAD_NUMBER;
  if (!(a->secant[0] >= 0 && a->secant[1] >= 0)) return FL_BAD_NUMBER;
  if (!are_barred_zones(a)) return FL_BAD_NUMBER;
  const int drags = fl_form_of(a)->has_drag && a->rows == 2;
  if (is_foil(a) && !drags) return FL_BAD_BLOCK;
  const int is_known = FL_SLIPSTREAMS && a->rows == 2;
  if ((int)a->command_kind == FL_STEERED && !is_known) return FL_BAD_BLOCK;
  return FL_OK;
}

int fl_check(const real *block, int length) {
  const int head_length = sizeof(fl_head) / sizeof(real);
  const int actuator_length = sizeof(fl_actuator) / sizeof(real);
  const fl_head *head = HEAD(block);
  if (length < head_length || head->magic != FL_MAGIC) return FL_BAD_BLOCK;
  if (head->length != (real)length) return FL_BAD_BLOCK;
  if (head->version != FL_VERSION) return FL_BAD_VERSION;
  if (!fl_are_within(block, length, LARGEST_NUMBER)) return FL_BAD_NUMBER;
  if (!is_whole_number(head->n, 1, FL_MOST)) return FL_BAD_BLOCK;
  if (length < head_length + actuator_length * (int)head->n) return FL_BAD_BLOCK;
  if (!is_whole_number(head->rank, 0, 6)) return FL_BAD_BLOCK;
  for (int k = 0; k < 6; k++) {
    if (!(head->axis_scale[k] > 0 && head->wrench_scale[k] > 0)) return FL_BAD_NUMBER;
    if (head->is_commanded[k] != 0 && head->is_commanded[k] != 1) return FL_BAD_NUMBER;
  }
  for (int i = 0; i < COUNT(block); i++) {
    const int code = check_actuator(block, ACTUATOR(block, i));
    if (code) return code;
  }
  return FL_OK;
}
