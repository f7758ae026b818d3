/* Features and vectors of the messages between actuators, and between an actuator and the hull,
   with their derivatives by the forces; finlab/interaction/messages.py says what they are.

   A model of interaction gives one factor for each vector of a message, from its features. What the
   messages add up to is the wrench offset of Eq. 18. */
#include "internal.h"

#define PAIR_FEATURES 11
#define PAIR_VECTORS 4
#define PAIR_NUMBERS (PAIR_FEATURES + 3 * PAIR_VECTORS)
#define PAIR_FORCES 6 /* numbers of two forces: of the source, of the receiver */
#define HULL_FEATURES 7
#define HULL_VECTORS 3
#define HULL_NUMBERS (HULL_FEATURES + 3 * HULL_VECTORS)

/* As in finlab/interaction/messages.py: */
#define SOFTENING R(1e-4)
#define HULL_SOFTENING R(1e-9)
#define GRAZING R(0.2) /* squared offset over which a jet comes off the hull */
#define FAR 4 /* diameters at which a receiver counts as far */

/* Numbers of a robot: a `crowd`, then a `member` for each of its n actuators, then a `pair` for
   each of those that have a message. */
typedef struct {
  real n;
  real pairs;
  real has_hull;
  real half[3];   /* half axes of the hull [m] */
  real mean_half; /* of these */
} crowd;

typedef struct {
  real position[3];      /* [m] */
  real diameter;         /* of its jet [m] */
  real thrust_still;     /* left where there is no force [N] */
  real hull_position[3]; /* in coordinates in which the hull is the unit sphere */
  real normal[3];        /* of the hull there */
  real size_on_hull;     /* feature of its diameter */
} member;

typedef struct {
  real source, receiver; /* indices */
  real way[3];           /* from source to receiver, in diameters of the source */
  real diameter_ratio;   /* of the receiver over the source */
  real log_ratio;        /* its logarithm */
} pair;

/* A number with its derivatives by the forces of a message. */
typedef struct {
  real value;
  real by[PAIR_FORCES];
} dual;

/* A vector of such numbers. */
typedef struct {
  dual c[3];
} dual_vector;

static inline dual constant(real value) {
  dual result = {value, {0}};
  return result;
}

/* f(x), given its value and derivative at x. */
static inline dual chain(const dual *x, real value, real slope) {
  dual result;
  result.value = value;
  for (int k = 0; k < PAIR_FORCES; k++) result.by[k] = slope * x->by[k];
  return result;
}

/* f(x, y), given its value and derivatives there. */
static inline dual chain_two(const dual *x, const dual *y, real value, real by_x, real by_y) {
  dual result;
  result.value = value;
  for (int k = 0; k < PAIR_FORCES; k++) result.by[k] = by_x * x->by[k] + by_y * y->by[k];
  return result;
}

static inline dual product(const dual *x, const dual *y) {
  return chain_two(x, y, x->value * y->value, y->value, x->value);
}

static inline dual dot_duals(const dual_vector *x, const dual_vector *y) {
  dual sum = product(&x->c[0], &y->c[0]);
  for (int b = 1; b < 3; b++) {
    const dual more = product(&x->c[b], &y->c[b]);
    sum = chain_two(&sum, &more, sum.value + more.value, 1, 1);
  }
  return sum;
}

/* Product of a vector of constants and one of such numbers. */
static inline dual dot_constant(const real *x, const dual_vector *y) {
  dual sum = constant(0);
  for (int b = 0; b < 3; b++) {
    sum.value += x[b] * y->c[b].value;
    for (int k = 0; k < PAIR_FORCES; k++) sum.by[k] += x[b] * y->c[b].by[k];
  }
  return sum;
}

/* Thrust and direction of a force, whose numbers are those of a message from `first` on. */
static void jet_of_force(const member *a, const real *force, int first, dual *thrust,
                         dual_vector *ahead) {
  const real t = SQRT(dot(force, force, 3) + a->thrust_still * a->thrust_still);
  *thrust = constant(t);
  for (int b = 0; b < 3; b++) ahead->c[b] = constant(force[b] / t);
  for (int c = 0; c < 3; c++) {
    const real along = force[c] / t;
    thrust->by[first + c] = along;
    for (int b = 0; b < 3; b++) {
      ahead->c[b].by[first + c] = ((real)(b == c) - force[b] / t * along) / t;
    }
  }
}

/* Writes a number, and its derivatives by `forces` numbers of forces, to place `at` of a row of
   `numbers` and of the rows of its slopes. */
static void write_number(const dual *x, int at, int numbers, int forces, real *row, real *slopes) {
  row[at] = x->value;
  for (int k = 0; k < forces && slopes; k++) slopes[k * numbers + at] = x->by[k];
}

/* The same of a vector times a strength. */
static void write_vector(const dual_vector *x, const dual *strength, int at, int numbers,
                         int forces, real *row, real *slopes) {
  for (int b = 0; b < 3; b++) {
    const dual scaled = product(&x->c[b], strength);
    write_number(&scaled, at + b, numbers, forces, row, slopes);
  }
}

static inline dual_vector cross_product(const dual_vector *x, const dual_vector *y) {
  dual_vector result;
  for (int b = 0; b < 3; b++) {
    const int l = (b + 1) % 3;
    const int m = (b + 2) % 3;
    const dual plus = product(&x->c[l], &y->c[m]);
    const dual minus = product(&x->c[m], &y->c[l]);
    result.c[b] = chain_two(&plus, &minus, plus.value - minus.value, 1, -1);
  }
  return result;
}

/* exp(-a s / (b + c x^2)) of two numbers. */
static inline dual bell(const dual *s, const dual *x, real a, real b, real c) {
  const real width = b + c * x->value * x->value;
  const real value = EXP(-a * s->value / width);
  const real by_s = -a / width * value;
  const real by_x = a * s->value * 2 * c * x->value / (width * width) * value;
  return chain_two(s, x, value, by_s, by_x);
}

/* The row of a pair, and its slopes (PAIR_FORCES, PAIR_NUMBERS); 0 for none. */
static void pair_row(const pair *p, const member *source, const member *receiver,
                     const real *source_force, const real *receiver_force, real *row,
                     real *slopes) {
  dual thrust;
  dual receiver_thrust;
  dual_vector ahead;
  dual_vector facing;
  jet_of_force(source, source_force, 0, &thrust, &ahead);
  jet_of_force(receiver, receiver_force, 3, &receiver_thrust, &facing);

  /* The receiver seen from the source: along the jet, which flows against the force, and off its
     axis. */
  const dual against = dot_constant(p->way, &ahead);
  const dual along = chain(&against, -against.value, -1);
  dual_vector radial;
  for (int b = 0; b < 3; b++) {
    radial.c[b] = product(&along, &ahead.c[b]);
    radial.c[b].value += p->way[b];
  }
  const dual s = dot_duals(&radial, &radial); /* squared radius */
  const real r = SQRT(s.value + SOFTENING);
  const dual radius = chain(&s, r, 1 / (2 * r));
  const dual per_radius = chain(&s, 1 / r, -1 / (2 * r * r * r));
  dual_vector outward;
  for (int b = 0; b < 3; b++) outward.c[b] = product(&radial.c[b], &per_radius);

  const real x = along.value;
  const real distance = SQRT(FAR * FAR + x * x);
  const real distance_cubed = distance * distance * distance;
  const real tanh_x = TANH(2 * x);
  const real beside = SQRT(1 + s.value);
  const real t = thrust.value;
  const real t_both = t + receiver_thrust.value;
  const real share = SQRT(t / t_both);
  const real per_share = 1 / (2 * share * t_both * t_both);
  const real difference = 2 / (t_both * t_both);

  dual feature[PAIR_FEATURES];
  feature[0] = chain(&along, x / distance, FAR * FAR / distance_cubed);
  feature[1] = chain(&along, FAR / distance, -FAR * x / distance_cubed);
  feature[2] = chain(&along, tanh_x, 2 * (1 - tanh_x * tanh_x));
  feature[3] = chain_two(&radius, &s, r / beside, 1 / beside, -r / (2 * beside * beside * beside));
  feature[4] = bell(&s, &along, 1, 1, R(0.05));
  feature[5] = bell(&s, &along, 4, 1, R(0.05));
  feature[6] = dot_duals(&ahead, &facing);
  feature[7] = dot_duals(&outward, &facing);
  feature[8] = chain_two(&thrust, &receiver_thrust, (receiver_thrust.value - t) / t_both,
                         -difference * receiver_thrust.value, difference * t);
  feature[9] = chain_two(&thrust, &receiver_thrust, share, per_share * receiver_thrust.value,
                         -per_share * t);
  feature[10] = constant(p->log_ratio);

  /* Messages fade out before the source, and away from the axis. */
  const real onset_tanh = TANH(2 * x + 1);
  const dual onset = chain(&along, (1 + onset_tanh) / 2, 1 - onset_tanh * onset_tanh);
  const dual profile = bell(&s, &along, 1, 3, R(0.15));
  const dual window = product(&onset, &profile);
  const real size = SQRT(t * t_both);
  const dual root = chain_two(&thrust, &receiver_thrust, p->diameter_ratio * size,
                              p->diameter_ratio * (t_both + t) / (2 * size),
                              p->diameter_ratio * t / (2 * size));
  const dual strength = product(&root, &window);
  const dual_vector around = cross_product(&ahead, &outward);
  const dual_vector *vector[PAIR_VECTORS] = {&ahead, &facing, &outward, &around};

  for (int k = 0; k < PAIR_FEATURES; k++) {
    write_number(feature + k, k, PAIR_NUMBERS, PAIR_FORCES, row, slopes);
  }
  for (int k = 0; k < PAIR_VECTORS; k++) {
    write_vector(vector[k], &strength, PAIR_FEATURES + 3 * k, PAIR_NUMBERS, PAIR_FORCES, row,
                 slopes);
  }
}

/* Normal of the hull where a jet meets it, or passes nearest: at towards - depth along the jet. The
   depth below the surface there is the root of 1 - offset, smoothed to a number above 0. */
static inline dual_vector normal_where_met(const crowd *robot, const member *a, const dual_vector *course,
                                    const dual *per_length, const dual *from,
                                    const dual *squared_offset) {
  const real below = 1 - squared_offset->value;
  const real size = SQRT(below * below + GRAZING * GRAZING);
  const real smoothed = (below + size) / 2;
  const real depth = SQRT(smoothed);
  const real by_below = (1 + below / size) / 2;
  const real by_offset = -by_below / (2 * depth);
  /* -from - depth */
  const dual way =
      chain_two(from, squared_offset, -from->value - depth, -1, -by_offset);
  const dual step = product(&way, per_length);
  dual_vector gradient;
  for (int b = 0; b < 3; b++) {
    const dual moved = product(&course->c[b], &step);
    const real half = robot->half[b];
    gradient.c[b] = chain(&moved, (a->hull_position[b] + moved.value) / half, 1 / half);
  }
  const dual squared_length = dot_duals(&gradient, &gradient);
  const real length = SQRT(squared_length.value + HULL_SOFTENING);
  const dual per_gradient =
      chain(&squared_length, 1 / length, -1 / (2 * length * length * length));
  dual_vector normal;
  for (int b = 0; b < 3; b++) normal.c[b] = product(&gradient.c[b], &per_gradient);
  return normal;
}

/* The row of an actuator and the hull, and its slopes (3, HULL_NUMBERS); 0 for none. */
static void hull_row(const crowd *robot, const member *a, const real *force, real *row,
                     real *slopes) {
  dual thrust;
  dual_vector ahead;
  jet_of_force(a, force, 0, &thrust, &ahead);
  /* In coordinates in which the ellipsoid is the unit sphere. */
  dual_vector course;
  for (int b = 0; b < 3; b++) {
    const real scale = -1 / robot->half[b];
    course.c[b] = chain(&ahead.c[b], scale * ahead.c[b].value, scale);
  }
  const dual squared_length = dot_duals(&course, &course);
  const real length = SQRT(squared_length.value + HULL_SOFTENING);
  const dual per_length = chain(&squared_length, 1 / length, -1 / (2 * length * length * length));
  const dual away = dot_constant(a->hull_position, &course);
  const dual from = product(&away, &per_length);
  const real towards = -from.value;
  const real squared_radius = dot(a->hull_position, a->hull_position, 3);
  const real offset = squared_radius - towards * towards; /* squared, of the jet from the centre */
  const dual squared_offset = chain(&from, offset, 2 * towards);

  const real rim = TANH(2 * (offset - 1));
  const real middle = EXP(-offset);
  const real side = TANH(3 * towards);
  dual feature[HULL_FEATURES];
  feature[0] = chain(&squared_offset, rim, 2 * (1 - rim * rim));
  feature[1] = chain(&squared_offset, middle, -middle);
  feature[2] = chain(&from, side, -3 * (1 - side * side));
  feature[3] = constant(TANH(squared_radius - 1));
  feature[4] = dot_constant(a->normal, &ahead);
  feature[5] = constant(a->size_on_hull);
  dual_vector normal;
  for (int b = 0; b < 3; b++) normal.c[b] = constant(a->normal[b]);
  const dual_vector met =
      normal_where_met(robot, a, &course, &per_length, &from, &squared_offset);
  feature[6] = dot_duals(&met, &ahead);
  for (int k = 0; k < HULL_FEATURES; k++) {
    write_number(feature + k, k, HULL_NUMBERS, 3, row, slopes);
  }
  const dual_vector *vector[HULL_VECTORS] = {&ahead, &normal, &met};
  for (int k = 0; k < HULL_VECTORS; k++) {
    write_vector(vector[k], &thrust, HULL_FEATURES + 3 * k, HULL_NUMBERS, 3, row, slopes);
  }
}

static const member *members_of(const crowd *robot) { return (const member *)(robot + 1); }

static const pair *pairs_of(const crowd *robot) {
  return (const pair *)(members_of(robot) + (int)robot->n);
}

void fl_message_rows(const real *constants, const real *force, int count, real *pair_rows,
                     real *pair_slopes, real *hull_rows, real *hull_slopes) {
  const crowd *robot = (const crowd *)constants;
  const member *members = members_of(robot);
  const pair *pairs = pairs_of(robot);
  const int n = (int)robot->n;
  for (int q = 0; q < count; q++, force += 3 * n) {
    for (int p = 0; p < (int)robot->pairs; p++) {
      const int source = (int)pairs[p].source;
      const int receiver = (int)pairs[p].receiver;
      pair_row(pairs + p, members + source, members + receiver, force + 3 * source,
               force + 3 * receiver, pair_rows, pair_slopes);
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

/* Exponent of a message's window below which the message is left out: 2e-12 of its size. */
#define NOTHING_OF_WINDOW R(-27)

/* Whether a pair's window is next to nothing at forces of source and receiver: the logarithm of it,
   as in pair_row, is at most that of the onset's end and of the profile. */
static int is_out_of_window(const pair *p, const member *source, const real *force) {
  const real still = source->thrust_still;
  const real squared_thrust = dot(force, force, 3) + still * still;
  const real against = dot(p->way, force, 3);
  const real along = -against / SQRT(squared_thrust);
  const real share = dot(force, force, 3) / squared_thrust; /* |ahead|^2 */
  const real squared_radius = dot(p->way, p->way, 3) - along * along * (2 - share);
  const real onset = smaller(0, 2 * (2 * along + 1));
  return onset - squared_radius / (3 + R(0.15) * along * along) < NOTHING_OF_WINDOW;
}

/* Adds the message of a row, by the factors that a model gives, as add_message does. */
static void add_modelled(const message_form *form, const fl_message_model *model, int kind,
                         const real *position, const int *ends, const real *row,
                         const real *slopes, real *change, real *offset, real *slope) {
  const int features = form->features;
  const int numbers = features + 3 * form->vectors;
  const real *vectors = row + features;
  real factors[PAIR_VECTORS];
  real jacobian[PAIR_VECTORS * PAIR_FEATURES];
  model->factors_of(model->weights, kind, row, factors, slope ? jacobian : 0);
  real message[3];
  message_of(vectors, form->vectors, factors, message);
  for (int b = 0; b < 3; b++) change[3 * ends[form->receiver] + b] += message[b];
  add_wrench(position, message, offset);
  if (!slope) return;
  /* The message's derivatives (f, 3) by the features: sum_k v_k df_k. */
  real by_feature[PAIR_FEATURES][3] = {{0}};
  for (int k = 0; k < form->vectors; k++) {
    for (int f = 0; f < features; f++) {
      const real factor_slope = jacobian[k * features + f];
      for (int b = 0; b < 3; b++) by_feature[f][b] += vectors[3 * k + b] * factor_slope;
    }
  }
  /* All sums grow side by side, so that none waits for its last term. */
  real by[PAIR_FORCES][3];
  for (int c = 0; c < form->forces; c++) {
    message_of(slopes + c * numbers + features, form->vectors, factors, by[c]);
  }
  for (int f = 0; f < features; f++) {
    for (int c = 0; c < form->forces; c++) {
      const real feature_slope = slopes[c * numbers + f];
      for (int b = 0; b < 3; b++) by[c][b] += by_feature[f][b] * feature_slope;
    }
  }
  for (int c = 0; c < form->forces; c++) {
    add_wrench(position, by[c], slope + 18 * ends[c / 3] + 6 * (c % 3));
  }
}

void fl_add_messages(const real *constants, const fl_message_model *model, const real *force,
                     real *change, real *offset, real *slope) {
  const crowd *robot = (const crowd *)constants;
  const member *members = members_of(robot);
  const pair *pairs = pairs_of(robot);
  const int n = (int)robot->n;
  real row[PAIR_NUMBERS];
  real slopes[PAIR_FORCES * PAIR_NUMBERS];
  real *slopes_wanted = slope ? slopes : 0;
  for (int p = 0; p < (int)robot->pairs; p++) {
    const int ends[2] = {(int)pairs[p].source, (int)pairs[p].receiver};
    if (is_out_of_window(pairs + p, members + ends[0], force + 3 * ends[0])) continue;
    pair_row(pairs + p, members + ends[0], members + ends[1], force + 3 * ends[0],
             force + 3 * ends[1], row, slopes_wanted);
    add_modelled(&PAIR_FORM, model, FL_PAIR_MESSAGE, members[ends[1]].position, ends, row, slopes,
                 change, offset, slope);
  }
  for (int i = 0; i < n && robot->has_hull > 0; i++) {
    hull_row(robot, members + i, force + 3 * i, row, slopes_wanted);
    add_modelled(&HULL_FORM, model, FL_HULL_MESSAGE, members[i].position, &i, row, slopes, change,
                 offset, slope);
  }
}

void fl_message_wrench(const real *constants, int count, const fl_messages *pair_messages,
                       const fl_messages *hull_messages, real *offset, real *slope) {
  const crowd *robot = (const crowd *)constants;
  const member *members = members_of(robot);
  const pair *pairs = pairs_of(robot);
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
