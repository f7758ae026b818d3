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
#define FAR 4          /* diameters at which a receiver counts as far */

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

/* A number of an actuator and the hull, with its derivatives by the force. */
typedef struct {
  real value;
  real by[3];
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
  for (int k = 0; k < 3; k++) result.by[k] = slope * x->by[k];
  return result;
}

/* f(x, y), given its value and derivatives there. */
static inline dual chain_two(const dual *x, const dual *y, real value, real by_x, real by_y) {
  dual result;
  result.value = value;
  for (int k = 0; k < 3; k++) result.by[k] = by_x * x->by[k] + by_y * y->by[k];
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
    for (int k = 0; k < 3; k++) sum.by[k] += x[b] * y->c[b].by[k];
  }
  return sum;
}

/* Writes a number, and its derivatives, to place `at` of a row and of the rows of its slopes. */
static void write_number(const dual *x, int at, real *row, real *slopes) {
  row[at] = x->value;
  for (int k = 0; k < 3 && slopes; k++) slopes[k * HULL_NUMBERS + at] = x->by[k];
}

/* The same of a vector times a strength. */
static void write_vector(const dual_vector *x, const dual *strength, int at, real *row,
                         real *slopes) {
  for (int b = 0; b < 3; b++) {
    const dual scaled = product(&x->c[b], strength);
    write_number(&scaled, at + b, row, slopes);
  }
}

/* The jet of a force: its thrust t and direction a, by which d t = a.dF and
   d a = (dF - a (a.dF)) / t. */
typedef struct {
  real thrust;   /* [N] */
  real ahead[3]; /* shorter than 1 near rest */
} direction;

static direction direction_of(const member *a, const real *force) {
  direction made;
  made.thrust = SQRT(dot(force, force, 3) + a->thrust_still * a->thrust_still);
  const real per_thrust = 1 / made.thrust;
  for (int b = 0; b < 3; b++) made.ahead[b] = force[b] * per_thrust;
  return made;
}

/* The change of a direction (3,) with the number `axis` of its force. */
static inline void turn_of(real thrust, const real *ahead, int axis, real *turn) {
  const real per_thrust = 1 / thrust;
  for (int b = 0; b < 3; b++) turn[b] = -ahead[b] * ahead[axis] * per_thrust;
  turn[axis] += per_thrust;
}

/* Of which numbers of a pair its features and its strength are functions. */
enum {
  ALONG,           /* x: the receiver along the jet, which flows against the force [diameters] */
  SQUARED_RADIUS,  /* s: off its axis, squared */
  COSINE,          /* of the two forces */
  OUTWARD_COSINE,  /* of the receiver's force and the way off the axis */
  THRUST,          /* t of the source [N] */
  RECEIVER_THRUST, /* t' of the receiver [N] */
  PAIR_SCALARS,
};

/* A pair at two forces. Its vectors are those of a message, without its strength: the direction of
   the source's force, that of the receiver's, off the axis, and around it. */
typedef struct {
  real scalar[PAIR_SCALARS];
  real vector[3 * PAIR_VECTORS];
  real radius; /* softened [diameters] */
} pair_view;

/* A feature of along and squared radius is one of the first six, and those from the fourth on
   depend on both; the eighth and ninth are of the thrusts. */
#define FIRST_OF_RADIUS 3
#define FEATURES_OF_PLACE 6
#define FIRST_OF_THRUSTS 8
#define FEATURES_OF_THRUSTS 2

/* Features and strength of a pair, and their derivatives by its scalars. Those by the cosines are 1
   for the features that these are. */
typedef struct {
  real feature[PAIR_FEATURES];
  real by_along[FEATURES_OF_PLACE];
  real by_radius[FEATURES_OF_PLACE];
  real by_thrust[FEATURES_OF_THRUSTS];
  real by_receiver_thrust[FEATURES_OF_THRUSTS];
  real strength;                  /* [N] */
  real strength_by[PAIR_SCALARS]; /* 0 by the cosines */
} pair_features;

static void view_pair(const pair *p, const direction *source, const direction *receiver,
                      pair_view *view) {
  const real *way = p->way;
  const real *ahead = source->ahead;
  const real *facing = receiver->ahead;
  const real x = -dot(way, ahead, 3);
  real radial[3];
  for (int b = 0; b < 3; b++) radial[b] = way[b] + x * ahead[b];
  const real s = dot(radial, radial, 3);
  view->radius = SQRT(s + SOFTENING);
  const real per_radius = 1 / view->radius;
  memcpy(view->vector, ahead, 3 * sizeof(real));
  memcpy(view->vector + 3, facing, 3 * sizeof(real));
  real *outward = view->vector + 6;
  for (int b = 0; b < 3; b++) outward[b] = radial[b] * per_radius;
  cross(ahead, outward, view->vector + 9);
  view->scalar[ALONG] = x;
  view->scalar[SQUARED_RADIUS] = s;
  view->scalar[COSINE] = dot(ahead, facing, 3);
  view->scalar[OUTWARD_COSINE] = dot(outward, facing, 3);
  view->scalar[THRUST] = source->thrust;
  view->scalar[RECEIVER_THRUST] = receiver->thrust;
}

/* exp(-a s / (1 + c x^2)) and its derivatives by x and s. */
static inline real bell(real s, real x, real a, real c, real *by_x, real *by_s) {
  const real per_width = 1 / (1 + c * x * x);
  const real value = EXP(-a * s * per_width);
  *by_s = -a * per_width * value;
  *by_x = -2 * c * x * s * per_width * *by_s;
  return value;
}

static void features_of_pair(const pair *p, const pair_view *view, pair_features *made) {
  const real x = view->scalar[ALONG];
  const real s = view->scalar[SQUARED_RADIUS];
  const real r = view->radius;
  const real t = view->scalar[THRUST];
  const real receiver_t = view->scalar[RECEIVER_THRUST];
  real *feature = made->feature;
  real *by_x = made->by_along;
  real *by_s = made->by_radius;

  const real per_distance = 1 / SQRT(FAR * FAR + x * x);
  const real per_cube = per_distance * per_distance * per_distance;
  const real tanh_x = TANH(2 * x);
  const real per_beside = 1 / SQRT(1 + s);
  feature[0] = x * per_distance;
  by_x[0] = FAR * FAR * per_cube;
  feature[1] = FAR * per_distance;
  by_x[1] = -FAR * x * per_cube;
  feature[2] = tanh_x;
  by_x[2] = 2 * (1 - tanh_x * tanh_x);
  /* r / (1 + s)^(1/2), where d r / d s = 1 / (2 r) */
  feature[3] = r * per_beside;
  by_x[3] = 0;
  by_s[3] = per_beside / (2 * r) - r * per_beside * per_beside * per_beside / 2;
  feature[4] = bell(s, x, 1, R(0.05), by_x + 4, by_s + 4);
  feature[5] = bell(s, x, 4, R(0.05), by_x + 5, by_s + 5);
  feature[6] = view->scalar[COSINE];
  feature[7] = view->scalar[OUTWARD_COSINE];

  const real t_both = t + receiver_t;
  const real per_both = 1 / t_both;
  const real share = SQRT(t * per_both);
  const real difference = 2 * per_both * per_both;
  const real per_share = per_both * per_both / (2 * share);
  feature[8] = (receiver_t - t) * per_both;
  made->by_thrust[0] = -difference * receiver_t;
  made->by_receiver_thrust[0] = difference * t;
  feature[9] = share;
  made->by_thrust[1] = per_share * receiver_t;
  made->by_receiver_thrust[1] = -per_share * t;
  feature[10] = p->log_ratio;

  /* Messages fade out before the source, and away from the axis. */
  const real onset_tanh = TANH(2 * x + 1);
  const real onset = (1 + onset_tanh) / 2;
  const real onset_by_x = 1 - onset_tanh * onset_tanh;
  real profile_by_x;
  real profile_by_s;
  /* exp(-s / (3 + 0.15 x^2)) */
  const real profile = bell(s, x, R(1.0) / 3, R(0.05), &profile_by_x, &profile_by_s);
  const real window = onset * profile;
  const real root = p->diameter_ratio * SQRT(t * t_both);
  const real per_root = p->diameter_ratio * p->diameter_ratio * window / (2 * root);
  made->strength = root * window;
  memset(made->strength_by, 0, sizeof made->strength_by);
  made->strength_by[ALONG] = root * (onset_by_x * profile + onset * profile_by_x);
  made->strength_by[SQUARED_RADIUS] = root * onset * profile_by_s;
  made->strength_by[THRUST] = per_root * (t_both + t);
  made->strength_by[RECEIVER_THRUST] = per_root * t;
}

/* Derivatives (PAIR_SCALARS,) of a model's factor by the scalars, by those (PAIR_FEATURES,) by the
   features. */
static void factor_by_scalars(const pair_features *of, const real *by_feature, real *by) {
  memset(by, 0, PAIR_SCALARS * sizeof *by);
  for (int f = 0; f < FEATURES_OF_PLACE; f++) by[ALONG] += by_feature[f] * of->by_along[f];
  for (int f = FIRST_OF_RADIUS; f < FEATURES_OF_PLACE; f++) {
    by[SQUARED_RADIUS] += by_feature[f] * of->by_radius[f];
  }
  by[COSINE] = by_feature[6];
  by[OUTWARD_COSINE] = by_feature[7];
  for (int f = 0; f < FEATURES_OF_THRUSTS; f++) {
    by[THRUST] += by_feature[FIRST_OF_THRUSTS + f] * of->by_thrust[f];
    by[RECEIVER_THRUST] += by_feature[FIRST_OF_THRUSTS + f] * of->by_receiver_thrust[f];
  }
}

/* How scalars and vectors of a pair change with one number of its forces. */
typedef struct {
  real scalar[PAIR_SCALARS];
  real vector[3 * PAIR_VECTORS];
} view_change;

static void change_by_source(const pair *p, const pair_view *view, int axis, view_change *change) {
  const real *ahead = view->vector;
  const real *facing = view->vector + 3;
  const real *outward = view->vector + 6;
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
  const real *facing = view->vector + 3;
  real *turn = change->vector + 3;
  memset(change, 0, sizeof *change);
  turn_of(view->scalar[RECEIVER_THRUST], facing, axis, turn);
  change->scalar[COSINE] = dot(view->vector, turn, 3);
  change->scalar[OUTWARD_COSINE] = dot(view->vector + 6, turn, 3);
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

/* The row of a pair, and its slopes (PAIR_FORCES, PAIR_NUMBERS); 0 for none. */
static void pair_row(const pair *p, const direction *source, const direction *receiver, real *row,
                     real *slopes) {
  pair_view view;
  pair_features of;
  view_pair(p, source, receiver, &view);
  features_of_pair(p, &view, &of);
  memcpy(row, of.feature, sizeof of.feature);
  for (int k = 0; k < 3 * PAIR_VECTORS; k++) {
    row[PAIR_FEATURES + k] = of.strength * view.vector[k];
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
        by[PAIR_FEATURES + 3 * k + b] = d_strength * view.vector[3 * k + b] +
                                        of.strength * change.vector[3 * k + b];
      }
    }
  }
}

/* Normal of the hull where a jet meets it, or passes nearest: at towards - depth along the jet. The
   depth below the surface there is the root of 1 - offset, smoothed to a number above 0. */
static inline dual_vector normal_where_met(const crowd *robot, const member *a,
                                           const dual_vector *course, const dual *per_length,
                                           const dual *from, const dual *squared_offset) {
  const real below = 1 - squared_offset->value;
  const real size = SQRT(below * below + GRAZING * GRAZING);
  const real smoothed = (below + size) / 2;
  const real depth = SQRT(smoothed);
  const real by_below = (1 + below / size) / 2;
  const real by_offset = -by_below / (2 * depth);
  /* -from - depth */
  const dual way = chain_two(from, squared_offset, -from->value - depth, -1, -by_offset);
  const dual step = product(&way, per_length);
  dual_vector gradient;
  for (int b = 0; b < 3; b++) {
    const dual moved = product(&course->c[b], &step);
    const real half = robot->half[b];
    gradient.c[b] = chain(&moved, (a->hull_position[b] + moved.value) / half, 1 / half);
  }
  const dual squared_length = dot_duals(&gradient, &gradient);
  const real length = SQRT(squared_length.value + HULL_SOFTENING);
  const dual per_gradient = chain(&squared_length, 1 / length, -1 / (2 * length * length * length));
  dual_vector normal;
  for (int b = 0; b < 3; b++) normal.c[b] = product(&gradient.c[b], &per_gradient);
  return normal;
}

/* The row of an actuator and the hull, and its slopes (3, HULL_NUMBERS); 0 for none. */
static void hull_row(const crowd *robot, const member *a, const real *force, real *row,
                     real *slopes) {
  const direction jet = direction_of(a, force);
  dual thrust = constant(jet.thrust);
  dual_vector ahead;
  for (int b = 0; b < 3; b++) ahead.c[b] = constant(jet.ahead[b]);
  for (int c = 0; c < 3; c++) {
    real turn[3];
    turn_of(jet.thrust, jet.ahead, c, turn);
    thrust.by[c] = jet.ahead[c];
    for (int b = 0; b < 3; b++) ahead.c[b].by[c] = turn[b];
  }
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
  const dual_vector met = normal_where_met(robot, a, &course, &per_length, &from, &squared_offset);
  feature[6] = dot_duals(&met, &ahead);
  for (int k = 0; k < HULL_FEATURES; k++) {
    write_number(feature + k, k, row, slopes);
  }
  const dual_vector *vector[HULL_VECTORS] = {&ahead, &normal, &met};
  for (int k = 0; k < HULL_VECTORS; k++) {
    write_vector(vector[k], &thrust, HULL_FEATURES + 3 * k, row, slopes);
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
      const direction from = direction_of(members + source, force + 3 * source);
      const direction to = direction_of(members + receiver, force + 3 * receiver);
      pair_row(pairs + p, &from, &to, pair_rows, pair_slopes);
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
#define NOTHING_OF_WINDOW R(-27.0)

/* Whether a pair's window is next to nothing at forces of source and receiver: the logarithm of it,
   as in pair_row, is at most that of the onset's end and of the profile. */
static int is_out_of_window(const pair *p, const direction *source) {
  const real along = -dot(p->way, source->ahead, 3);
  const real shorter = 2 - dot(source->ahead, source->ahead, 3);
  const real squared_radius = dot(p->way, p->way, 3) - along * along * shorter;
  const real onset = smaller(0, 2 * (2 * along + 1));
  return onset - squared_radius / (3 + R(0.15) * along * along) < NOTHING_OF_WINDOW;
}

/* A pair's message m = S sum_k f_k v_k, with its strength S, the factors f_k that a model gives,
   and its vectors v_k, as a function of what it depends on. */
typedef struct {
  real scaled[PAIR_VECTORS];       /* S f_k */
  real by_scalar[PAIR_SCALARS][3]; /* derivatives by the scalars, of constant vectors */
} pair_message;

/* What a message changes by (3, 3), by the number of a force, where it changes by `by_direction`
   with the direction: d a = (dF - a (a.dF)) / t, and d t = a.dF. */
static void add_slope_of_force(const real *position, const real *ahead, real thrust,
                               real by_direction[3][3], const real *by_thrust, real *slope) {
  const real per_thrust = 1 / thrust;
  real common[3]; /* that is times a_c: the derivative by the thrust, less a turn that is none */
  for (int b = 0; b < 3; b++) {
    real along = 0;
    for (int c = 0; c < 3; c++) along += ahead[c] * by_direction[c][b];
    common[b] = by_thrust[b] - along * per_thrust;
  }
  for (int c = 0; c < 3; c++) {
    real by[3];
    for (int b = 0; b < 3; b++) by[b] = by_direction[c][b] * per_thrust + ahead[c] * common[b];
    add_wrench(position, by, slope + 6 * c);
  }
}

/* Adds the derivatives of a message by the force of its source. With w the way, x along, a ahead,
   b facing, radial way p = w + x a of softened size r, outward u = p / r and around a x w / r,

     dx = -w.da,  ds = -2 (p.a) w.da + 2 x p.da,  d(a.b) = b.da,
     r d(u.b) = -(a.b) w.da + x b.da - (u.b) ds / (2 r),
     r du = -a w.da + x da - u ds / (2 r),  r d(around) = da x w - around ds / (2 r). */
static void add_slope_of_source(const pair *p, const pair_view *view, const pair_message *m,
                                const real *position, real *slope) {
  const real *way = p->way;
  const real *ahead = view->vector;
  const real *facing = view->vector + 3;
  const real *outward = view->vector + 6;
  const real *around = view->vector + 9;
  const real x = view->scalar[ALONG];
  const real r = view->radius;
  const real per_radius = 1 / r;
  const real by_size = per_radius * per_radius / 2; /* d(1 / r) / (1 / r) = -ds / (2 r^2) */
  const real radial_ahead = r * dot(outward, ahead, 3);
  const real cosine = view->scalar[COSINE] * per_radius;
  const real off_axis = view->scalar[OUTWARD_COSINE];
  real by_way[3];    /* times -w.da */
  real by_radial[3]; /* times u.da */
  real by_facing[3]; /* times b.da */
  for (int b = 0; b < 3; b++) {
    const real by_off_axis = m->by_scalar[OUTWARD_COSINE][b];
    const real resized = m->scaled[2] * outward[b] + m->scaled[3] * around[b];
    const real by_s = m->by_scalar[SQUARED_RADIUS][b] -
                      by_size * (resized + by_off_axis * off_axis);
    by_way[b] = m->by_scalar[ALONG][b] + 2 * radial_ahead * by_s + cosine * by_off_axis;
    by_way[b] += m->scaled[2] * per_radius * ahead[b];
    by_radial[b] = 2 * x * r * by_s;
    by_facing[b] = m->by_scalar[COSINE][b] + x * per_radius * by_off_axis;
  }
  const real identity = m->scaled[0] + m->scaled[2] * x * per_radius;
  const real turned = m->scaled[3] * per_radius;
  real by_ahead[3][3];
  for (int c = 0; c < 3; c++) {
    for (int b = 0; b < 3; b++) {
      by_ahead[c][b] = by_radial[b] * outward[c] + by_facing[b] * facing[c] - by_way[b] * way[c];
    }
    by_ahead[c][c] += identity;
    /* e_c x w */
    const int next = (c + 1) % 3;
    const int last = (c + 2) % 3;
    by_ahead[c][next] -= turned * way[last];
    by_ahead[c][last] += turned * way[next];
  }
  add_slope_of_force(position, ahead, view->scalar[THRUST], by_ahead, m->by_scalar[THRUST], slope);
}

/* The same by the force of its receiver: d(a.b) = a.db and d(u.b) = u.db. */
static void add_slope_of_receiver(const pair_view *view, const pair_message *m,
                                  const real *position, real *slope) {
  const real *ahead = view->vector;
  const real *facing = view->vector + 3;
  const real *outward = view->vector + 6;
  real by_facing[3][3];
  for (int c = 0; c < 3; c++) {
    for (int b = 0; b < 3; b++) {
      by_facing[c][b] = m->by_scalar[COSINE][b] * ahead[c];
      by_facing[c][b] += m->by_scalar[OUTWARD_COSINE][b] * outward[c];
    }
    by_facing[c][c] += m->scaled[1];
  }
  add_slope_of_force(position, facing, view->scalar[RECEIVER_THRUST], by_facing,
                     m->by_scalar[RECEIVER_THRUST], slope);
}

/* Adds the message of a pair, by the factors that a model gives. */
static void add_pair(const pair *p, const fl_message_model *model, const real *position,
                     const int *ends, const direction *directions, real *change, real *offset,
                     real *slope) {
  pair_view view;
  pair_features of;
  view_pair(p, directions + ends[0], directions + ends[1], &view);
  features_of_pair(p, &view, &of);
  real factors[PAIR_VECTORS];
  real jacobian[PAIR_VECTORS * PAIR_FEATURES];
  model->factors_of(model->weights, FL_PAIR_MESSAGE, of.feature, factors, slope ? jacobian : 0);
  pair_message m = {.scaled = {0}};
  real message[3];
  for (int k = 0; k < PAIR_VECTORS; k++) m.scaled[k] = of.strength * factors[k];
  message_of(view.vector, PAIR_VECTORS, m.scaled, message);
  for (int b = 0; b < 3; b++) change[3 * ends[1] + b] += message[b];
  add_wrench(position, message, offset);
  if (!slope) return;
  for (int k = 0; k < PAIR_VECTORS; k++) {
    real factor_by[PAIR_SCALARS];
    factor_by_scalars(&of, jacobian + k * PAIR_FEATURES, factor_by);
    for (int q = 0; q < PAIR_SCALARS; q++) {
      const real by = of.strength_by[q] * factors[k] + of.strength * factor_by[q];
      for (int b = 0; b < 3; b++) m.by_scalar[q][b] += by * view.vector[3 * k + b];
    }
  }
  add_slope_of_source(p, &view, &m, position, slope + 18 * ends[0]);
  add_slope_of_receiver(&view, &m, position, slope + 18 * ends[1]);
}

/* Adds the message of the hull to an actuator, by the factors that a model gives. */
static void add_hull(const crowd *robot, const member *a, const fl_message_model *model, int i,
                     const real *force, real *change, real *offset, real *slope) {
  real row[HULL_NUMBERS];
  real slopes[3 * HULL_NUMBERS];
  hull_row(robot, a, force, row, slope ? slopes : 0);
  const real *vectors = row + HULL_FEATURES;
  real factors[HULL_VECTORS];
  real jacobian[HULL_VECTORS * HULL_FEATURES];
  model->factors_of(model->weights, FL_HULL_MESSAGE, row, factors, slope ? jacobian : 0);
  real message[3];
  message_of(vectors, HULL_VECTORS, factors, message);
  for (int b = 0; b < 3; b++) change[3 * i + b] += message[b];
  add_wrench(a->position, message, offset);
  for (int c = 0; c < 3 && slope; c++) {
    real by[3];
    message_slope(vectors, slopes + c * HULL_NUMBERS, HULL_FEATURES, HULL_VECTORS, factors,
                  jacobian, by);
    add_wrench(a->position, by, slope + 18 * i + 6 * c);
  }
}

void fl_add_messages(const real *constants, const fl_message_model *model, const real *force,
                     real *change, real *offset, real *slope) {
  const crowd *robot = (const crowd *)constants;
  const member *members = members_of(robot);
  const pair *pairs = pairs_of(robot);
  const int n = (int)robot->n;
  direction directions[FL_MOST];
  for (int i = 0; i < n; i++) directions[i] = direction_of(members + i, force + 3 * i);
  for (int p = 0; p < (int)robot->pairs; p++) {
    const int ends[2] = {(int)pairs[p].source, (int)pairs[p].receiver};
    if (is_out_of_window(pairs + p, directions + ends[0])) continue;
    add_pair(pairs + p, model, members[ends[1]].position, ends, directions, change, offset, slope);
  }
  for (int i = 0; i < n && robot->has_hull > 0; i++) {
    add_hull(robot, members + i, model, i, force + 3 * i, change, offset, slope);
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
