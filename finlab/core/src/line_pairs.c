/* Responses of actuators that push along one direction, two at a time: Eq. 4 and 5, as fl_response
   says them one by one. Robots of thrusters spend most of their time here. */
#include "pairs.h"

#ifndef HAS_PAIRS

void fl_prepare_lines(const real *block, fl_work *work) {
  (void)block;
  work->line_count = 0;
}

#else

void fl_prepare_lines(const real *block, fl_work *work) {
  work->line_count = 0;
  work->has_line_cells = 0;
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    if (a->rows != 1) continue;
    fl_line *line = work->line + work->line_count;
    int reverse = (int)a->force_table;
    if (a->force_table_reverse > 0) reverse = (int)a->force_table_reverse;
    line->actuator = i;
    read_price_table(block, (int)a->force_table, line->table);
    read_price_table(block, reverse, line->table + 1);
    line->force_scale[0] = a->force_scale;
    line->force_scale[1] = -a->force_scale;
    line->power_scale = a->power_scale;
    line->price_ratio = 1;
    if (a->force_scale != a->power_scale) line->price_ratio = a->force_scale / a->power_scale;
    line->slope_scale = a->force_scale * line->price_ratio;
    line->price_quadratic = a->row_force_max[0] / a->secant[0];
    work->has_line_cells |= line->table[0].cells > 1 || line->table[1].cells > 1;
    work->line_count++;
  }
}

/* Forces of two lines, their derivatives by the prices, and the conjugates. */
typedef struct {
  pair force, slope, conjugate;
  pair price; /* of the tables */
} pair_response;

static inline pair fourth_power_of_pair(pair x) {
  const pair squared = x * x;
  return squared * squared;
}

/* Numbers of a pair of lines, or of their tables. */
#define OF(one, other, field) ((pair){(one)->field, (other)->field})

/* The forces with which two lines respond to prices s within their tables: fl_force_of_price. */
static inline pair_response response_without_limits(const real *block, const fl_line *line,
                                                    const fl_line *other_line, int has_cells,
                                                    const real *s) {
  const int is_reverse[2] = {s[0] < 0, s[1] < 0};
  const fl_price_table *one = line->table + is_reverse[0];
  const fl_price_table *other = other_line->table + is_reverse[1];
  const real *first = block + one->offset; /* knots of the cells */
  const real *second = block + other->offset;
  const pair price = (pair){FABS(s[0]), FABS(s[1])} * OF(line, other_line, price_ratio);
  const pair price_max = OF(one, other, price_max);
  pair dt_dv = OF(one, other, over_price);
  pair t = price * dt_dv; /* place in the cell, from 0 to 1 */
  pair scale = price_max; /* price of the width of a cell */
  if (has_cells) {
    const pair cells = OF(one, other, cells);
    const pair each = OF(one, other, each);
    const pair position = root_of_pair(root_of_pair(t)) * cells;
    const pair last = cells - 1;
    /* Beyond its last cell a table is not asked. */
    const int cell_of_one = (int)smaller(position[0], last[0]);
    const int cell_of_other = (int)smaller(position[1], last[1]);
    const pair cell = {(real)cell_of_one, (real)cell_of_other};
    const pair begin = fourth_power_of_pair(cell * each);
    const pair width = fourth_power_of_pair((cell + 1) * each) - begin;
    const pair over = 1 / width;
    t = (t - begin) * over;
    dt_dv *= over;
    scale *= width;
    first += 3 * cell_of_one;
    second += 3 * cell_of_other;
  }
  /* A cubic between two knots, value + t (m0 + t (b + t c)), as in force_table.c. */
  const pair value = {first[0], second[0]};
  const pair m0 = (pair){first[1], second[1]} * scale;
  const pair m1 = (pair){first[4], second[4]} * scale;
  const pair rise = (pair){first[3], second[3]} - value;
  const pair b = 3 * rise - 2 * m0 - m1;
  const pair c = m0 + m1 - 2 * rise;
  const pair integral = value + t * (m0 * R(0.5) + t * (b * (R(1.0) / 3) + t * c * R(0.25)));
  const pair force_scale = {line->force_scale[is_reverse[0]],
                            other_line->force_scale[is_reverse[1]]};
  pair_response y;
  y.price = price;
  y.force = (value + t * (m0 + t * (b + t * c))) * force_scale;
  y.slope = (m0 + t * (2 * b + 3 * t * c)) * dt_dv * OF(line, other_line, slope_scale);
  y.conjugate = (pair){first[2], second[2]} + scale * t * integral;
  y.conjugate *= OF(line, other_line, power_scale);
  return y;
}

/* The response of a line. */
typedef struct {
  real force, slope, conjugate;
} own_response;

/* The response of one of two lines, `lane` of a pair, to a price along it: within its table, and
   between the limits of its set, as fl_limited_response says it. */
static inline own_response held_response(const fl_work *work, const fl_line *line, real price,
                                         const pair_response *pairs, int lane) {
  const fl_set *set = work->set + line->actuator;
  const int is_reverse = price < 0;
  const fl_price_table *table = line->table + is_reverse;
  const real v = pairs->price[lane];
  own_response y = {pairs->force[lane], pairs->slope[lane], pairs->conjugate[lane]};
  if (!(v < table->price_max)) {
    y.force = table->force_max * line->force_scale[is_reverse];
    y.slope = 0;
    y.conjugate = table->conjugate_max + (v - table->price_max) * table->force_max;
    y.conjugate *= line->power_scale;
  }
  if (y.force <= set->force_min) {
    y.force = set->force_min;
    y.slope = 0;
    y.conjugate = price * set->force_min - set->cost_at_min;
  } else if (y.force >= set->force_max) {
    y.force = set->force_max;
    y.slope = 0;
    y.conjugate = price * set->force_max - set->cost_at_max;
  }
  return y;
}

static inline void write_line(const fl_line *line, real price, const own_response *y,
                              fl_state *state) {
  const int i = line->actuator;
  state->force[i][0] = y->force;
  state->force[i][1] = 0;
  state->dy_ds[i][0] = y->slope;
  state->dy_ds[i][1] = 0;
  state->dy_ds[i][2] = 0;
  state->push_angle[i] = 0;
  /* |y| / |s| of S, Eq. 9; near rest that of quadratic costs */
  state->secant[i] = FABS(y->force) / larger(FABS(price), line->price_quadratic);
}

/* The price of a line, of the pairs of its column and of the multipliers. */
static inline real price_of(const real *column, const pair *lambda) {
  return sum_of_pair(pair_at(column) * lambda[0] + pair_at(column + 2) * lambda[1] +
                     pair_at(column + 4) * lambda[2]);
}

static inline void add_force(const real *column, real force, pair *sum) {
  sum[0] += both(force) * pair_at(column);
  sum[1] += both(force) * pair_at(column + 2);
  sum[2] += both(force) * pair_at(column + 4);
}

void fl_add_lines(const real *block, const fl_work *work, const real *lambda, fl_state *state,
                  real *wrench, real *conjugate) {
  const pair l[3] = {pair_at(lambda), pair_at(lambda + 2), pair_at(lambda + 4)};
  pair sum[3] = {pair_at(wrench), pair_at(wrench + 2), pair_at(wrench + 4)}; /* sum B y */
  const int count = work->line_count;
  for (int k = 0; k < count; k += 2) {
    const fl_line *one = work->line + k;
    const fl_line *other = one + (k + 1 < count);
    const real *column = work->span.effectiveness_reduced[one->actuator][0];
    const real *other_column = work->span.effectiveness_reduced[other->actuator][0];
    const real s[2] = {price_of(column, l), price_of(other_column, l)};
    const pair_response pairs = response_without_limits(block, one, other, work->has_line_cells, s);
    own_response y = held_response(work, one, s[0], &pairs, 0);
    write_line(one, s[0], &y, state);
    add_force(column, y.force, sum);
    *conjugate += y.conjugate;
    if (other == one) break;
    y = held_response(work, other, s[1], &pairs, 1);
    write_line(other, s[1], &y, state);
    add_force(other_column, y.force, sum);
    *conjugate += y.conjugate;
  }
  write_pair(sum[0], wrench);
  write_pair(sum[1], wrench + 2);
  write_pair(sum[2], wrench + 4);
}

#endif
