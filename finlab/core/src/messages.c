/* Features and vectors of the messages between actuators, and between an actuator and the hull,
   with their derivatives by the forces; finlab/interaction/messages.py says what they are.

   A model of interaction gives one factor for each vector of a message, from its features. What the
   messages add up to is the wrench offset of Eq. 18. */
#include "messages.h"
#define LANES 1
#include "lanes_vector.h"
#include "lanes_math.h"
#include "message_formulas.h"

/* The change of a direction (3,) with the number `axis` of its force. */
static inline void turn_of(real thrust, const real *ahead, int axis, real *turn) {
  const real per_thrust = 1 / thrust;
  for (int b = 0; b < 3; b++) turn[b] = -ahead[b] * ahead[axis] * per_thrust;
  turn[axis] += per_thrust;
}

/* How scalars and vectors of a pair change with one number of its forces. */
typedef struct {
  real scalar[PAIR_SCALARS];
  real vector[3 * PAIR_VECTORS];
} view_change;

static void change_by_source(const pair *p, const pair_view *view, int axis, view_change *change) {
  const real *ahead = view->vectors;
  const real *facing = view->vectors + 3;
  const real *outward = view->vectors + 6;
  real *turn = change->vector;
  turn_of(view->scalar[THRUST], ahead, axis, turn);
  memset(change->vector + 3, 0, 3 * sizeof(real));
  /* The radial way is w + x a, its size r, outward its share of that. */
  const real d_along = -dot(p->way, turn, 3);
  const real per_radius = 1 / view->radius;
  real d_radial[3];
  for (int b = 0; b < 3; b++) d_radial[b] = d_along * ahead[b] + view->scalar[ALONG] * turn[b];
  const real d_radius = dot(outward, d_radial, 3);
  real *d_outward = change->vector + 6;
  for (int b = 0; b < 3; b++) d_outward[b] = (d_radial[b] - outward[b] * d_radius) * per_radius;
  real by_turn[3];
  real by_outward[3];
  cross(turn, outward, by_turn);
  cross(ahead, d_outward, by_outward);
  for (int b = 0; b < 3; b++) change->vector[9 + b] = by_turn[b] + by_outward[b];
  change->scalar[ALONG] = d_along;
  change->scalar[SQUARED_RADIUS] = 2 * view->radius * d_radius;
  change->scalar[COSINE] = dot(turn, facing, 3);
  change->scalar[OUTWARD_COSINE] = dot(d_outward, facing, 3);
  change->scalar[THRUST] = ahead[axis];
  change->scalar[RECEIVER_THRUST] = 0;
}

static void change_by_receiver(const pair_view *view, int axis, view_change *change) {
  const real *facing = view->vectors + 3;
  real *turn = change->vector + 3;
  memset(change, 0, sizeof *change);
  turn_of(view->scalar[RECEIVER_THRUST], facing, axis, turn);
  change->scalar[COSINE] = dot(view->vectors, turn, 3);
  change->scalar[OUTWARD_COSINE] = dot(view->vectors + 6, turn, 3);
  change->scalar[RECEIVER_THRUST] = facing[axis];
}

/* The change with one of the `PAIR_FORCES` numbers. */
static void change_by(const pair *p, const pair_view *view, int number, view_change *change) {
  if (number < 3) {
    change_by_source(p, view, number, change);
  } else {
    change_by_receiver(view, number - 3, change);
  }
}

/* A pair at the forces of its two actuators. */
static pair pair_at_forces(const pair_table *table, const direction *source,
                           const direction *receiver) {
  pair p;
  memcpy(p.way, table->way, sizeof p.way);
  memcpy(p.ahead, source->ahead, sizeof p.ahead);
  memcpy(p.facing, receiver->ahead, sizeof p.facing);
  p.diameter_ratio = table->diameter_ratio;
  p.log_ratio = table->log_ratio;
  p.thrust = source->thrust;
  p.receiver_thrust = receiver->thrust;
  return p;
}

/* The row of a pair, and its slopes (PAIR_FORCES, PAIR_NUMBERS); 0 for none. */
static void pair_row(const pair *p, real *row, real *slopes) {
  pair_view view;
  pair_features of;
  view_pair(p, &view);
  features_of_pair(p, &view, &of);
  memcpy(row, of.feature, sizeof of.feature);
  for (int k = 0; k < 3 * PAIR_VECTORS; k++) {
    row[PAIR_FEATURES + k] = of.strength * view.vectors[k];
  }
  for (int c = 0; c < PAIR_FORCES && slopes; c++) {
    view_change change;
    change_by(p, &view, c, &change);
    real *by = slopes + c * PAIR_NUMBERS;
    memset(by, 0, PAIR_NUMBERS * sizeof *by);
    for (int f = 0; f < FEATURES_OF_PLACE; f++) {
      by[f] = of.by_along[f] * change.scalar[ALONG];
      if (f >= FIRST_OF_RADIUS) by[f] += of.by_radius[f] * change.scalar[SQUARED_RADIUS];
    }
    by[6] = change.scalar[COSINE];
    by[7] = change.scalar[OUTWARD_COSINE];
    for (int f = 0; f < FEATURES_OF_THRUSTS; f++) {
      by[FIRST_OF_THRUSTS + f] = of.by_thrust[f] * change.scalar[THRUST];
      by[FIRST_OF_THRUSTS + f] += of.by_receiver_thrust[f] * change.scalar[RECEIVER_THRUST];
    }
    const real d_strength = dot(of.strength_by, change.scalar, PAIR_SCALARS);
    for (int k = 0; k < PAIR_VECTORS; k++) {
      for (int b = 0; b < 3; b++) {
        by[PAIR_FEATURES + 3 * k + b] = d_strength * view.vectors[3 * k + b] +
                                        of.strength * change.vector[3 * k + b];
      }
    }
  }
}

/* Writes a number, and its derivatives, to place `at` of a row and of the rows of its slopes. */
static void write_number(const dual *x, int at, real *row, real *slopes) {
  row[at] = x->value;
  for (int k = 0; k < 3 && slopes; k++) slopes[k * HULL_NUMBERS + at] = x->by[k];
}

/* The row of an actuator and the hull, and its slopes (3, HULL_NUMBERS); 0 for none. */
static void hull_row(const crowd *robot, const member *a, const real *force, real *row,
                     real *slopes) {
  const direction jet = direction_of(a, force);
  hull_place at;
  hull_message made;
  memcpy(at.hull_position, a->hull_position, sizeof at.hull_position);
  memcpy(at.normal, a->normal, sizeof at.normal);
  memcpy(at.ahead, jet.ahead, sizeof at.ahead);
  at.size_on_hull = a->size_on_hull;
  at.thrust = jet.thrust;
  message_of_hull(robot->half, &at, &made);
  for (int k = 0; k < HULL_FEATURES; k++) write_number(made.feature + k, k, row, slopes);
  for (int k = 0; k < 3 * HULL_VECTORS; k++) {
    write_number(made.vectors[k / 3].c + k % 3, HULL_FEATURES + k, row, slopes);
  }
}

void fl_message_rows(const real *constants, const real *force, int count, real *pair_rows,
                     real *pair_slopes, real *hull_rows, real *hull_slopes) {
  const crowd *robot = (const crowd *)constants;
  const member *members = members_of(robot);
  const pair_table *pairs = pairs_of(robot);
  const int n = (int)robot->n;
  for (int q = 0; q < count; q++, force += 3 * n) {
    for (int p = 0; p < (int)robot->pairs; p++) {
      const int source = (int)pairs[p].source;
      const int receiver = (int)pairs[p].receiver;
      const direction from = direction_of(members + source, force + 3 * source);
      const direction to = direction_of(members + receiver, force + 3 * receiver);
      const pair at = pair_at_forces(pairs + p, &from, &to);
      pair_row(&at, pair_rows, pair_slopes);
      pair_rows += PAIR_NUMBERS;
      if (pair_slopes) pair_slopes += PAIR_FORCES * PAIR_NUMBERS;
    }
    for (int i = 0; i < n && robot->has_hull > 0; i++) {
      hull_row(robot, members + i, force + 3 * i, hull_rows, hull_slopes);
      hull_rows += HULL_NUMBERS;
      if (hull_slopes) hull_slopes += 3 * HULL_NUMBERS;
    }
  }
}

/* The message (3,) of a row's vectors by a model's factors: sum_k f_k v_k. */
static void message_of(const real *vectors, int count, const real *factors, real *message) {
  memset(message, 0, 3 * sizeof *message);
  for (int k = 0; k < count; k++) {
    for (int b = 0; b < 3; b++) message[b] += factors[k] * vectors[3 * k + b];
  }
}

/* Its derivative (3,) by one number of the forces, of which a row of slopes has the derivatives of
   features and vectors: sum_k (df_k / dx . dx) v_k + f_k dv_k. */
static void message_slope(const real *vectors, const real *slopes, int features, int count,
                          const real *factors, const real *jacobian, real *by) {
  message_of(slopes + features, count, factors, by);
  for (int k = 0; k < count; k++) {
    const real factor_slope = dot(jacobian + k * features, slopes, features);
    for (int b = 0; b < 3; b++) by[b] += factor_slope * vectors[3 * k + b];
  }
}

/* How many numbers the messages of a kind have, of how many numbers of forces they depend, and
   which of their ends receives them. */
typedef struct {
  int features, vectors, forces, receiver;
} message_form;

static const message_form PAIR_FORM = {PAIR_FEATURES, PAIR_VECTORS, PAIR_FORCES, 1};
static const message_form HULL_FORM = {HULL_FEATURES, HULL_VECTORS, 3, 0};

/* Adds the wrench of the next message, at the position of who receives it, and its derivatives by
   the forces of `ends`; goes on to the one behind it. */
static void add_message(const message_form *form, const real *position, const int *ends,
                        fl_messages *next, real *offset, real *slope) {
  const int numbers = form->features + 3 * form->vectors;
  const real *vectors = next->rows + form->features;
  real message[3];
  message_of(vectors, form->vectors, next->factors, message);
  add_wrench(position, message, offset);
  for (int c = 0; c < form->forces && slope; c++) {
    real by[3];
    message_slope(vectors, next->slopes + c * numbers, form->features, form->vectors, next->factors,
                  next->jacobians, by);
    add_wrench(position, by, slope + 18 * ends[c / 3] + 6 * (c % 3));
  }
  next->rows += numbers;
  next->factors += form->vectors;
  if (!slope) return;
  next->slopes += form->forces * numbers;
  next->jacobians += form->vectors * form->features;
}

void fl_message_wrench(const real *constants, int count, const fl_messages *pair_messages,
                       const fl_messages *hull_messages, real *offset, real *slope) {
  const crowd *robot = (const crowd *)constants;
  const member *members = members_of(robot);
  const pair_table *pairs = pairs_of(robot);
  const int n = (int)robot->n;
  fl_messages of_pairs = *pair_messages;
  fl_messages of_hull = *hull_messages;
  memset(offset, 0, 6 * (size_t)count * sizeof *offset);
  if (slope) memset(slope, 0, 18 * (size_t)n * (size_t)count * sizeof *slope);
  for (int q = 0; q < count; q++) {
    for (int p = 0; p < (int)robot->pairs; p++) {
      const int ends[2] = {(int)pairs[p].source, (int)pairs[p].receiver};
      add_message(&PAIR_FORM, members[ends[1]].position, ends, &of_pairs, offset, slope);
    }
    for (int i = 0; i < n && robot->has_hull > 0; i++) {
      add_message(&HULL_FORM, members[i].position, &i, &of_hull, offset, slope);
    }
    offset += 6;
    if (slope) slope += 18 * n;
  }
}
