/* Features, vectors and strengths of messages, of LANES messages at once, with their derivatives by
   the forces; finlab/interaction/messages.py says what they are. No guard, as lanes_vector.h has
   none. */

/* Pairs of a source and a receiver, at their forces. */
typedef struct {
  vector way[3];         /* from source to receiver, in diameters of the source */
  vector diameter_ratio; /* of the receiver over the source */
  vector log_ratio;      /* its logarithm */
  vector ahead[3];       /* direction of the source's force */
  vector facing[3];      /* of the receiver's */
  vector thrust;         /* of the source [N] */
  vector receiver_thrust;
} pair;

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
  vector scalar[PAIR_SCALARS];
  vector vectors[3 * PAIR_VECTORS];
  vector radius; /* softened [diameters] */
} pair_view;

/* Of the features of place, those from the fourth on depend on along and squared radius; the eighth
   and ninth features are of the thrusts. */
#define FIRST_OF_RADIUS 3
#define FIRST_OF_THRUSTS 8
#define FEATURES_OF_THRUSTS 2

/* Features and strength of a pair, and their derivatives by its scalars. Those by the cosines are 1
   for the features that these are. */
typedef struct {
  vector feature[PAIR_FEATURES];
  vector by_along[FEATURES_OF_PLACE];
  vector by_radius[FEATURES_OF_PLACE]; /* from FIRST_OF_RADIUS on */
  vector by_thrust[FEATURES_OF_THRUSTS];
  vector by_receiver_thrust[FEATURES_OF_THRUSTS];
  vector strength;                  /* [N] */
  vector strength_by[PAIR_SCALARS]; /* 0 by the cosines */
} pair_features;

static inline void view_pair(const pair *p, pair_view *view) {
  const vector x = -dot_three(p->way, p->ahead);
  vector radial[3];
  for (int b = 0; b < 3; b++) radial[b] = p->way[b] + x * p->ahead[b];
  const vector s = dot_three(radial, radial);
  view->radius = root_of(s + SOFTENING);
  const vector per_radius = 1 / view->radius;
  vector *outward = view->vectors + 6;
  for (int b = 0; b < 3; b++) {
    view->vectors[b] = p->ahead[b];
    view->vectors[3 + b] = p->facing[b];
    outward[b] = radial[b] * per_radius;
  }
  cross_of(p->ahead, outward, view->vectors + 9);
  view->scalar[ALONG] = x;
  view->scalar[SQUARED_RADIUS] = s;
  view->scalar[COSINE] = dot_three(p->ahead, p->facing);
  view->scalar[OUTWARD_COSINE] = dot_three(outward, p->facing);
  view->scalar[THRUST] = p->thrust;
  view->scalar[RECEIVER_THRUST] = p->receiver_thrust;
}

#define BELL_GROWTH R(0.05)               /* of a jet's squared width by that of the way along it */
#define ONSET_SHARE R(0.1353352832366127) /* exp(-2): the onset is half a diameter upstream */

/* exp(-a s / w) of s and x, w = 1 + 0.05 x^2, and its derivatives, of its value and 1 / w. */
static inline void bell_slopes(vector value, vector s, vector x, real a, vector per_width,
                               vector *by_x, vector *by_s) {
  *by_s = -a * per_width * value;
  *by_x = -2 * BELL_GROWTH * x * s * per_width * *by_s;
}

static inline void features_of_pair(const pair *p, const pair_view *view, pair_features *made) {
  const vector x = view->scalar[ALONG];
  const vector s = view->scalar[SQUARED_RADIUS];
  const vector r = view->radius;
  const vector t = view->scalar[THRUST];
  const vector receiver_t = view->scalar[RECEIVER_THRUST];
  vector *feature = made->feature;
  vector *by_x = made->by_along;
  vector *by_s = made->by_radius;

  const vector per_distance = 1 / root_of(FAR * FAR + x * x);
  const vector per_cube = per_distance * per_distance * per_distance;
  const vector per_beside = 1 / root_of(1 + s);
  const vector behind = exp_of(-4 * x); /* of tanh 2x, and of the onset */
  const vector tanh_x = (1 - behind) / (1 + behind);
  feature[0] = x * per_distance;
  by_x[0] = FAR * FAR * per_cube;
  feature[1] = FAR * per_distance;
  by_x[1] = -FAR * x * per_cube;
  feature[2] = tanh_x;
  by_x[2] = 2 * (1 - tanh_x * tanh_x);
  /* r / (1 + s)^(1/2), where d r / d s = 1 / (2 r) */
  feature[3] = r * per_beside;
  by_x[3] = lanes_of(0);
  by_s[3] = per_beside / (2 * r) - r * per_beside * per_beside * per_beside / 2;
  /* exp(-s / w) and exp(-4 s / w) are powers of the profile exp(-s / (3 w)). */
  const vector per_width = 1 / (1 + BELL_GROWTH * x * x);
  const real third = R(1.0) / 3;
  const vector profile = exp_of(-third * s * per_width);
  const vector bell = profile * profile * profile;
  const vector squared_bell = bell * bell;
  feature[4] = bell;
  bell_slopes(feature[4], s, x, 1, per_width, by_x + 4, by_s + 4);
  feature[5] = squared_bell * squared_bell;
  bell_slopes(feature[5], s, x, 4, per_width, by_x + 5, by_s + 5);
  feature[6] = view->scalar[COSINE];
  feature[7] = view->scalar[OUTWARD_COSINE];

  const vector t_both = t + receiver_t;
  const vector per_both = 1 / t_both;
  const vector share = root_of(t * per_both);
  const vector difference = 2 * per_both * per_both;
  const vector per_share = per_both * per_both / (2 * share);
  feature[8] = (receiver_t - t) * per_both;
  made->by_thrust[0] = -difference * receiver_t;
  made->by_receiver_thrust[0] = difference * t;
  feature[9] = share;
  made->by_thrust[1] = per_share * receiver_t;
  made->by_receiver_thrust[1] = -per_share * t;
  feature[10] = p->log_ratio;

  /* Messages fade out before the source, by (1 + tanh(2 x + 1)) / 2, and away from the axis. */
  const vector onset = 1 / (1 + ONSET_SHARE * behind);
  const vector onset_by_x = 4 * onset * (1 - onset);
  vector profile_by_x;
  vector profile_by_s;
  bell_slopes(profile, s, x, third, per_width, &profile_by_x, &profile_by_s);
  const vector window = onset * profile;
  const vector root = p->diameter_ratio * share * t_both; /* ratio (t (t + t'))^(1/2) */
  const vector per_root = p->diameter_ratio * p->diameter_ratio * window / (2 * root);
  made->strength = root * window;
  made->strength_by[ALONG] = root * (onset_by_x * profile + onset * profile_by_x);
  made->strength_by[SQUARED_RADIUS] = root * onset * profile_by_s;
  made->strength_by[COSINE] = lanes_of(0);
  made->strength_by[OUTWARD_COSINE] = lanes_of(0);
  made->strength_by[THRUST] = per_root * (t_both + t);
  made->strength_by[RECEIVER_THRUST] = per_root * t;
}

/* A number of an actuator and the hull, with its derivatives by the force. */
typedef struct {
  vector value;
  vector by[3];
} dual;

/* Three of such numbers. */
typedef struct {
  dual c[3];
} dual_vector;

static inline dual constant(vector value) {
  dual result;
  result.value = value;
  for (int k = 0; k < 3; k++) result.by[k] = lanes_of(0);
  return result;
}

/* f(x), given its value and derivative at x. */
static inline dual chain(const dual *x, vector value, vector slope) {
  dual result;
  result.value = value;
  for (int k = 0; k < 3; k++) result.by[k] = slope * x->by[k];
  return result;
}

/* f(x, y), given its value and derivatives there. */
static inline dual chain_two(const dual *x, const dual *y, vector value, vector by_x, vector by_y) {
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
    sum.value += more.value;
    for (int k = 0; k < 3; k++) sum.by[k] += more.by[k];
  }
  return sum;
}

/* Product of a vector of constants and one of such numbers. */
static inline dual dot_constant(const vector *x, const dual_vector *y) {
  dual sum = constant(lanes_of(0));
  for (int b = 0; b < 3; b++) {
    sum.value += x[b] * y->c[b].value;
    for (int k = 0; k < 3; k++) sum.by[k] += x[b] * y->c[b].by[k];
  }
  return sum;
}

/* Actuators beside the hull, at their forces. */
typedef struct {
  vector hull_position[3]; /* in coordinates in which the hull is the unit sphere */
  vector normal[3];        /* of the hull there */
  vector size_on_hull;     /* feature of the diameter */
  vector thrust;           /* [N] */
  vector ahead[3];         /* direction of the force */
} hull_place;

/* The message of the hull at a force: features, and vectors with their strength. */
typedef struct {
  dual feature[HULL_FEATURES];
  dual_vector vectors[HULL_VECTORS]; /* [N] */
} hull_message;

/* Normal of the hull where a jet meets it, or passes nearest: at towards - depth along the jet. The
   depth below the surface there is the root of 1 - offset, smoothed to a number above 0. */
static inline dual_vector normal_where_met(const real *half, const hull_place *a,
                                           const dual_vector *course, const dual *per_length,
                                           const dual *from, const dual *squared_offset) {
  const vector below = 1 - squared_offset->value;
  const vector size = root_of(below * below + GRAZING * GRAZING);
  const vector smoothed = (below + size) / 2;
  const vector depth = root_of(smoothed);
  const vector by_below = (1 + below / size) / 2;
  const vector by_offset = -by_below / (2 * depth);
  /* -from - depth */
  const dual way = chain_two(from, squared_offset, -from->value - depth, lanes_of(-1), -by_offset);
  const dual step = product(&way, per_length);
  dual_vector gradient;
  for (int b = 0; b < 3; b++) {
    const dual moved = product(&course->c[b], &step);
    const vector per_half = lanes_of(1 / half[b]);
    gradient.c[b] = chain(&moved, (a->hull_position[b] + moved.value) * per_half, per_half);
  }
  const dual squared_length = dot_duals(&gradient, &gradient);
  const vector length = root_of(squared_length.value + HULL_SOFTENING);
  const vector per_cube = 1 / (length * length * length);
  const dual per_gradient = chain(&squared_length, 1 / length, per_cube / -2);
  dual_vector normal;
  for (int b = 0; b < 3; b++) normal.c[b] = product(&gradient.c[b], &per_gradient);
  return normal;
}

/* The message of a hull of half axes (3,) to actuators. */
static inline void message_of_hull(const real *half, const hull_place *a, hull_message *made) {
  const vector per_thrust = 1 / a->thrust;
  dual thrust = constant(a->thrust);
  dual_vector ahead;
  for (int b = 0; b < 3; b++) {
    thrust.by[b] = a->ahead[b];
    /* d a = (dF - a (a.dF)) / t */
    ahead.c[b].value = a->ahead[b];
    for (int k = 0; k < 3; k++) ahead.c[b].by[k] = -a->ahead[b] * a->ahead[k] * per_thrust;
    ahead.c[b].by[b] += per_thrust;
  }
  /* In coordinates in which the ellipsoid is the unit sphere. */
  dual_vector course;
  for (int b = 0; b < 3; b++) {
    const vector scale = lanes_of(-1 / half[b]);
    course.c[b] = chain(&ahead.c[b], scale * ahead.c[b].value, scale);
  }
  const dual squared_length = dot_duals(&course, &course);
  const vector length = root_of(squared_length.value + HULL_SOFTENING);
  const vector per_cube = 1 / (length * length * length);
  const dual per_length = chain(&squared_length, 1 / length, per_cube / -2);
  const dual away = dot_constant(a->hull_position, &course);
  const dual from = product(&away, &per_length);
  const vector towards = -from.value;
  const vector squared_radius = dot_three(a->hull_position, a->hull_position);
  /* squared, of the jet from the centre */
  const vector offset = squared_radius - towards * towards;
  const dual squared_offset = chain(&from, offset, 2 * towards);

  const vector rim = tanh_of(2 * (offset - 1));
  const vector middle = exp_of(-offset);
  const vector side = tanh_of(3 * towards);
  dual *feature = made->feature;
  feature[0] = chain(&squared_offset, rim, 2 * (1 - rim * rim));
  feature[1] = chain(&squared_offset, middle, -middle);
  feature[2] = chain(&from, side, -3 * (1 - side * side));
  feature[3] = constant(tanh_of(squared_radius - 1));
  feature[4] = dot_constant(a->normal, &ahead);
  feature[5] = constant(a->size_on_hull);
  const dual_vector met = normal_where_met(half, a, &course, &per_length, &from, &squared_offset);
  feature[6] = dot_duals(&met, &ahead);
  for (int b = 0; b < 3; b++) {
    const dual normal = constant(a->normal[b]);
    made->vectors[0].c[b] = product(&ahead.c[b], &thrust);
    made->vectors[1].c[b] = product(&normal, &thrust);
    made->vectors[2].c[b] = product(&met.c[b], &thrust);
  }
}
