/* What jets and messages take, for LANES pairs of actuators at once: the formulas of
   jet_formulas.h and message_formulas.h, in vectors. Included by a file for each width of vectors,
   which defines `root_of`, `larger_of` and `smaller_of`.

   Actuators are taken one by one with all whose jets may meet them in lanes; sums over lanes run
   in the order of these, so that they have the same bits whatever the width. */
#include "interaction_lanes.h"
#include "lanes_math.h"
#include "jet_formulas.h"
#include "message_formulas.h"

/* Exponent of a message's window below which the message is left out: 2e-12 of its size. */
#define NOTHING_OF_WINDOW R(-27.0)

static inline real lane_of(const vector *x, int lane) { return ((const real *)x)[lane]; }

/* The polynomials of the k factors of a kind of message in its f features x:

     value = c + x.g1 + x.g2 + x.g3,  gradient = g1 + 2 g2 + 3 g3,

   where g1 (k, f) is constant, g2 = sum_j x_j A_j and g3 = sum_{j <= l} x_j x_l C_jl, of the first
   `cubic` features q alone. Constants are c (k,), g1, the A_j (f, k, f) and the C_jl
   (q (q + 1) / 2, k, q). One factor is evaluated. */
static inline vector factor_of(const real *coefficients, int factors, int factor, int features,
                               int cubic, const vector *x, vector *gradient) {
  const int entries = factors * features;
  const real *linear = coefficients + factors + factor * features;
  const real *next = linear + entries;
  vector once[PAIR_FEATURES];
  vector twice[PAIR_FEATURES];
  for (int i = 0; i < features; i++) {
    once[i] = lanes_of(0);
    twice[i] = lanes_of(0);
  }
  for (int j = 0; j < features; j++, next += entries) {
    for (int i = 0; i < features; i++) once[i] += x[j] * next[i];
  }
  next += factor * (cubic - features);
  for (int j = 0; j < cubic; j++) {
    for (int l = j; l < cubic; l++, next += factors * cubic) {
      const vector both = x[j] * x[l];
      for (int i = 0; i < cubic; i++) twice[i] += both * next[i];
    }
  }
  vector value = lanes_of(coefficients[factor]);
  for (int i = 0; i < features; i++) {
    value += x[i] * (linear[i] + once[i] + twice[i]);
    gradient[i] = linear[i] + 2 * once[i] + 3 * twice[i];
  }
  return value;
}

/* Jets of the actuators at their forces, and where those stand that meet one of them. */
typedef struct {
  const interaction_model *model;
  const real *force; /* (n, 3) [N] */
  int n;
  jet jets[FL_MOST];
  direction directions[FL_MOST]; /* the same of messages */
  int rank[FL_MOST];             /* among the actuators that have a jet */
} robot_at_forces;

/* Pairs of one receiver, in lanes. */
typedef struct {
  int source[LANES];
  int count;              /* of lanes that stand for a pair; the others repeat the last one */
  pair p;                 /* of messages */
  vector way[3];          /* of the jets, in diameters of their outlets */
  vector ahead[3];        /* against which they flow */
  vector thrust;          /* [N] */
  vector speed_at_outlet; /* [m/s] */
  vector along;
  vector speed[MOST_FORMULAS]; /* of the jets by profile, where they meet the receiver [m/s] */
  vector slope[MOST_FORMULAS]; /* of these by `along` */
  vector by_source[3][3];      /* derivatives of what the receiver has from them, by their forces */
} pair_group;

/* Whether neither the jet nor the message of a pair is more than nothing. */
static inline int is_nothing(const robot_at_forces *robot, const real *way, const real *ahead) {
  const interaction_model *model = robot->model;
  const real along = -dot(way, ahead, 3);
  const real squared_way = dot(way, way, 3);
  if (model->messages) {
    /* The logarithm of the window is at most that of the onset's end and of the profile. */
    const real shorter = 2 - dot(ahead, ahead, 3);
    const real squared_radius = squared_way - along * along * shorter;
    const real onset = smaller(0, 2 * (2 * along + 1));
    const real width = 3 + R(0.15) * along * along;
    if (onset - squared_radius / width >= NOTHING_OF_WINDOW) return 0;
  }
  const real aside_squared = squared_way - along * along;
  for (int k = 0; k < model->profiles; k++) {
    if (!is_nothing_of_jet(model->formula[model->formula_of[k]], along, aside_squared)) return 0;
  }
  return 1;
}

/* Puts a source into a lane of a group. */
static inline void put_in_lane(const robot_at_forces *robot, int source, int receiver,
                               const real *way, int lane, pair_group *group) {
  const jet *j = robot->jets + source;
  group->source[lane] = source;
  for (int c = 0; c < 3; c++) {
    set_lane(group->way + c, lane, way[c]);
    set_lane(group->ahead + c, lane, j->ahead[c]);
  }
  set_lane(&group->thrust, lane, j->thrust);
  set_lane(&group->speed_at_outlet, lane, j->speed);
  const crowd *messages = robot->model->messages;
  if (!messages) return;
  const int others_before = receiver - (receiver > source);
  const pair_table *p = pairs_of(messages) + robot->rank[source] * (robot->n - 1) + others_before;
  const direction *from = robot->directions + source;
  const direction *to = robot->directions + receiver;
  for (int c = 0; c < 3; c++) {
    set_lane(group->p.way + c, lane, p->way[c]);
    set_lane(group->p.ahead + c, lane, from->ahead[c]);
    set_lane(group->p.facing + c, lane, to->ahead[c]);
  }
  set_lane(&group->p.thrust, lane, from->thrust);
  set_lane(&group->p.receiver_thrust, lane, to->thrust);
  set_lane(&group->p.diameter_ratio, lane, p->diameter_ratio);
  set_lane(&group->p.log_ratio, lane, p->log_ratio);
}

/* Finds the sources whose jets or messages a receiver has, in groups. Returns how many groups. */
static int find_sources(const robot_at_forces *robot, int receiver, pair_group *groups) {
  const outlet *outlets = outlets_of(robot->model->formula[0]);
  int count = 0;
  real way[3] = {0}; /* of the last pair */
  int source = receiver;
  for (int j = 0; j < robot->n; j++) {
    if (j == receiver || !(outlets[j].diameter > 0)) continue;
    real way_to[3];
    for (int c = 0; c < 3; c++) {
      const real displacement = outlets[receiver].position[c] - outlets[j].position[c];
      way_to[c] = displacement * robot->jets[j].per_diameter;
    }
    if (is_nothing(robot, way_to, robot->jets[j].ahead)) continue;
    source = j;
    memcpy(way, way_to, sizeof way);
    put_in_lane(robot, j, receiver, way, count % LANES, groups + count / LANES);
    count++;
    groups[(count - 1) / LANES].count = (count - 1) % LANES + 1;
  }
  /* Lanes that are left over repeat the last pair. */
  for (int k = count; k % LANES != 0; k++) {
    put_in_lane(robot, source, receiver, way, k % LANES, groups + k / LANES);
  }
  return (count + LANES - 1) / LANES;
}

/* Derivatives by a force, of what has some by its direction and its thrust: d a = (dF - a (a.dF)) /
   t, and d t = a.dF. */
static inline void add_by_force(const vector *ahead, vector thrust, vector by_direction[3][3],
                                const vector *by_thrust, vector by_force[3][3]) {
  const vector per_thrust = 1 / thrust;
  for (int b = 0; b < 3; b++) {
    /* what is times a_c: the derivative by the thrust, less a turn that is none */
    vector along = lanes_of(0);
    for (int c = 0; c < 3; c++) along += ahead[c] * by_direction[c][b];
    const vector common = by_thrust[b] - along * per_thrust;
    for (int c = 0; c < 3; c++) {
      by_force[c][b] = by_direction[c][b] * per_thrust + ahead[c] * common;
    }
  }
}

/* Messages m = S sum_k f_k v_k of pairs, with their strength S, the factors f_k and the vectors
   v_k, as functions of what they depend on. */
typedef struct {
  vector scaled[PAIR_VECTORS];       /* S f_k */
  vector by_scalar[PAIR_SCALARS][3]; /* derivatives by the scalars, of constant vectors */
} pair_message;

/* Derivatives of messages by the forces of their sources. With w the way, x along, a ahead, b
   facing, radial way p = w + x a of softened size r, outward u = p / r and around a x w / r,

     dx = -w.da,  ds = -2 (p.a) w.da + 2 x p.da,  d(a.b) = b.da,
     r d(u.b) = -(a.b) w.da + x b.da - (u.b) ds / (2 r),
     r du = -a w.da + x da - u ds / (2 r),  r d(around) = da x w - around ds / (2 r). */
static inline void message_by_source(const pair *p, const pair_view *view, const pair_message *m,
                                     vector by_force[3][3]) {
  const vector *way = p->way;
  const vector *ahead = p->ahead;
  const vector *facing = p->facing;
  const vector *outward = view->vectors + 6;
  const vector *around = view->vectors + 9;
  const vector x = view->scalar[ALONG];
  const vector r = view->radius;
  const vector per_radius = 1 / r;
  const vector by_size = per_radius * per_radius / 2; /* d(1 / r) / (1 / r) = -ds / (2 r^2) */
  const vector radial_ahead = r * dot_three(outward, ahead);
  const vector cosine = view->scalar[COSINE] * per_radius;
  const vector off_axis = view->scalar[OUTWARD_COSINE];
  vector by_way[3];    /* times -w.da */
  vector by_radial[3]; /* times u.da */
  vector by_facing[3]; /* times b.da */
  for (int b = 0; b < 3; b++) {
    const vector by_off_axis = m->by_scalar[OUTWARD_COSINE][b];
    const vector resized = m->scaled[2] * outward[b] + m->scaled[3] * around[b];
    const vector by_s = m->by_scalar[SQUARED_RADIUS][b] -
                        by_size * (resized + by_off_axis * off_axis);
    by_way[b] = m->by_scalar[ALONG][b] + 2 * radial_ahead * by_s + cosine * by_off_axis;
    by_way[b] += m->scaled[2] * per_radius * ahead[b];
    by_radial[b] = 2 * x * r * by_s;
    by_facing[b] = m->by_scalar[COSINE][b] + x * per_radius * by_off_axis;
  }
  const vector identity = m->scaled[0] + m->scaled[2] * x * per_radius;
  const vector turned = m->scaled[3] * per_radius;
  vector by_ahead[3][3];
  for (int c = 0; c < 3; c++) {
    for (int b = 0; b < 3; b++) {
      by_ahead[c][b] = by_radial[b] * outward[c] + by_facing[b] * facing[c] - by_way[b] * way[c];
    }
    by_ahead[c][c] += identity;
  }
  for (int c = 0; c < 3; c++) {
    /* e_c x w */
    const int next = (c + 1) % 3;
    const int last = (c + 2) % 3;
    by_ahead[c][next] -= turned * way[last];
    by_ahead[c][last] += turned * way[next];
  }
  add_by_force(ahead, p->thrust, by_ahead, m->by_scalar[THRUST], by_force);
}

/* The same by the forces of their receivers: d(a.b) = a.db and d(u.b) = u.db. */
static inline void message_by_receiver(const pair *p, const pair_view *view, const pair_message *m,
                                       vector by_force[3][3]) {
  const vector *outward = view->vectors + 6;
  vector by_facing[3][3];
  for (int c = 0; c < 3; c++) {
    for (int b = 0; b < 3; b++) {
      by_facing[c][b] = m->by_scalar[COSINE][b] * p->ahead[c];
      by_facing[c][b] += m->by_scalar[OUTWARD_COSINE][b] * outward[c];
    }
    by_facing[c][c] += m->scaled[1];
  }
  add_by_force(p->facing, p->receiver_thrust, by_facing, m->by_scalar[RECEIVER_THRUST], by_force);
}

/* Derivatives of a factor by the scalars of its pair, by those by the features. */
static inline void factor_by_scalars(const pair_features *of, const vector *by_feature,
                                     vector *by) {
  for (int q = 0; q < PAIR_SCALARS; q++) by[q] = lanes_of(0);
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

/* Adds to what a receiver has the messages of a group; its derivatives by the sources stay there.
 */
static inline void add_messages(const interaction_model *model, pair_group *group, int receiver,
                                interaction_effect *effect) {
  const pair *p = &group->p;
  pair_view view;
  pair_features of;
  view_pair(p, &view);
  features_of_pair(p, &view, &of);
  pair_message m;
  vector message[3];
  for (int b = 0; b < 3; b++) {
    message[b] = lanes_of(0);
    for (int q = 0; q < PAIR_SCALARS; q++) m.by_scalar[q][b] = lanes_of(0);
  }
  for (int k = 0; k < PAIR_VECTORS; k++) {
    vector gradient[PAIR_FEATURES];
    const vector factor = factor_of(model->pair_coefficients, PAIR_VECTORS, k, PAIR_FEATURES,
                                    FEATURES_OF_PLACE, of.feature, gradient);
    m.scaled[k] = of.strength * factor;
    const vector *vectors = view.vectors + 3 * k;
    for (int b = 0; b < 3; b++) message[b] += m.scaled[k] * vectors[b];
    if (!effect->slope) continue;
    vector by[PAIR_SCALARS];
    factor_by_scalars(&of, gradient, by);
    for (int q = 0; q < PAIR_SCALARS; q++) {
      const vector scaled_by = of.strength_by[q] * factor + of.strength * by[q];
      for (int b = 0; b < 3; b++) m.by_scalar[q][b] += scaled_by * vectors[b];
    }
  }
  for (int l = 0; l < group->count; l++) {
    for (int b = 0; b < 3; b++) effect->change[receiver][b] += lane_of(message + b, l);
  }
  if (!effect->slope) return;
  vector by_receiver[3][3];
  message_by_source(p, &view, &m, group->by_source);
  message_by_receiver(p, &view, &m, by_receiver);
  for (int l = 0; l < group->count; l++) {
    for (int c = 0; c < 3; c++) {
      for (int b = 0; b < 3; b++) {
        effect->by_own[receiver][c][b] += lane_of(by_receiver[c] + b, l);
      }
    }
  }
}

/* Water that jets bring to a receiver, by profile [m/s], and derivatives by it of what it takes,
   all formulas of the profile together. */
typedef struct {
  real water[MOST_FORMULAS][3];
  real by_water[MOST_FORMULAS][3][3];
} brought;

/* Speeds of the jets of a group where they meet the receiver, and what water they bring. */
static inline void add_water(const interaction_model *model, pair_group *group, brought *to) {
  const jet_point point = point_of(model->formula[0]->behind, group->way, group->ahead);
  group->along = point.along;
  for (int k = 0; k < model->profiles; k++) {
    const water *w = model->formula[model->formula_of[k]];
    vector by_along;
    group->speed[k] = group->speed_at_outlet * rate_of_jet(w, &point, &by_along);
    group->slope[k] = group->speed_at_outlet * by_along;
    for (int l = 0; l < group->count; l++) {
      const real speed = lane_of(group->speed + k, l);
      for (int c = 0; c < 3; c++) to->water[k][c] -= speed * lane_of(group->ahead + c, l);
    }
  }
}

/* Constants of formulas, one in each lane, and the water that their jets bring. */
typedef struct {
  vector weight; /* 0 of lanes that stand for none */
  vector lag, most, side_flow, drag;
  vector water[3];
} formula_group;

static inline void put_formula(const interaction_model *model, const brought *to, const jet *own,
                               real diameter, int k, int lane, formula_group *group) {
  const int is_one = k < model->formulas;
  const int formula = is_one ? k : 0;
  const water *w = model->formula[formula];
  set_lane(&group->weight, lane, is_one ? model->weight[formula] : 0);
  set_lane(&group->lag, lane, w->lag);
  set_lane(&group->most, lane, w->most);
  set_lane(&group->side_flow, lane, w->side * own->mass_flow);
  set_lane(&group->drag, lane, PI / 8 * w->density * w->housing * diameter * diameter);
  const real *u = to->water[model->profile_of[formula]];
  for (int c = 0; c < 3; c++) set_lane(group->water + c, lane, u[c]);
}

/* Adds the force that comes of the water u that meets a receiver, and its derivatives by its own
   force and, for each profile, by the water. */
static void add_taken(const robot_at_forces *robot, int i, brought *to,
                      interaction_effect *effect) {
  const interaction_model *model = robot->model;
  const jet *own = robot->jets + i;
  const real *a = own->ahead;
  const real *force = robot->force + 3 * i;
  const real diameter = outlets_of(model->formula[0])[i].diameter;
  const real per_speed = 1 / own->speed;
  const real per_thrust = 1 / own->thrust;
  for (int first = 0; first < model->formulas; first += LANES) {
    formula_group g;
    for (int l = 0; l < LANES; l++) put_formula(model, to, own, diameter, first + l, l, &g);
    const vector *u = g.water;
    const vector against = -(u[0] * a[0] + u[1] * a[1] + u[2] * a[2]);
    const vector share = against * per_speed;
    const vector root = root_of(share * share + FLOOR_SHARE);
    const vector per_below = 1 / (g.lag + g.most * root);
    const vector lost = share * per_below; /* share of the force */
    const vector speed = root_of(dot_three(u, u) + ROUNDING);
    const vector drag = g.drag * speed;
    vector across[3];
    vector change[3];
    for (int b = 0; b < 3; b++) {
      across[b] = u[b] + against * a[b];
      change[b] = g.weight * (g.side_flow * across[b] + drag * u[b] - lost * force[b]);
    }
    const vector d_lost = (g.lag + g.most * FLOOR_SHARE / root) * per_below * per_below;
    const vector d_lost_by_speed = d_lost * per_speed;
    const vector side_per_thrust = g.side_flow * per_thrust;
    const vector drag_per_speed = g.drag / speed;
    vector by_force[3][3];
    vector by_water[3][3];
    for (int c = 0; c < 3 && effect->slope; c++) {
      const vector d_share = (across[c] * per_speed + share * (a[c] / 2)) * per_thrust;
      const vector d_lost_force = -d_lost * d_share;
      const vector d_lost_water = d_lost_by_speed * a[c];
      for (int b = 0; b < 3; b++) {
        const real projection = (real)(b == c) - a[b] * a[c];
        const vector d_across = a[c] * across[b] / 2 - across[c] * a[b] + against * projection;
        vector of_force = side_per_thrust * d_across - force[b] * d_lost_force;
        vector of_water = g.side_flow * projection + drag_per_speed * u[b] * u[c];
        of_water += force[b] * d_lost_water;
        if (b == c) {
          of_force -= lost;
          of_water += drag;
        }
        by_force[c][b] = g.weight * of_force;
        by_water[c][b] = g.weight * of_water;
      }
    }
    for (int l = 0; l < LANES && first + l < model->formulas; l++) {
      real(*of_profile)[3] = to->by_water[model->profile_of[first + l]];
      for (int b = 0; b < 3; b++) effect->change[i][b] += lane_of(change + b, l);
      for (int c = 0; c < 3 && effect->slope; c++) {
        for (int b = 0; b < 3; b++) {
          effect->by_own[i][c][b] += lane_of(by_force[c] + b, l);
          of_profile[c][b] += lane_of(by_water[c] + b, l);
        }
      }
    }
  }
}

/* Adds derivatives of what a receiver takes by the forces of the jets of a group. By the water u =
   -U a, where d U = U a.dF / (2 t) + dU/dx dx, t dx = -(w + x a).dF and t da = dF - a (a.dF). */
static inline void add_by_jets(const interaction_model *model, const brought *to,
                               pair_group *group) {
  const vector *ahead = group->ahead;
  const vector per_thrust = 1 / group->thrust;
  vector by_ahead[3]; /* times a_c */
  vector by_way[3];   /* times w_c */
  for (int b = 0; b < 3; b++) {
    by_ahead[b] = lanes_of(0);
    by_way[b] = lanes_of(0);
  }
  for (int k = 0; k < model->profiles; k++) {
    const real(*by)[3] = (const real(*)[3])to->by_water[k];
    const vector across = group->speed[k] * per_thrust;
    const vector slope = group->slope[k] * per_thrust;
    const vector along_slope = across / 2 + slope * group->along;
    for (int b = 0; b < 3; b++) {
      const vector along = ahead[0] * by[0][b] + ahead[1] * by[1][b] + ahead[2] * by[2][b];
      by_ahead[b] += along_slope * along;
      by_way[b] += slope * along;
      for (int c = 0; c < 3; c++) group->by_source[c][b] -= across * by[c][b];
    }
  }
  for (int c = 0; c < 3; c++) {
    for (int b = 0; b < 3; b++) {
      group->by_source[c][b] += ahead[c] * by_ahead[b] + group->way[c] * by_way[b];
    }
  }
}

/* Adds the wrench of the derivatives by the sources of a group to theirs. */
static inline void add_to_slope(const real *r, const pair_group *group,
                                interaction_effect *effect) {
  for (int c = 0; c < 3; c++) {
    const vector *by = group->by_source[c];
    vector wrench[6];
    for (int k = 0; k < 3; k++) {
      const int next = (k + 1) % 3;
      const int last = (k + 2) % 3;
      wrench[k] = by[k];
      wrench[3 + k] = r[next] * by[last] - r[last] * by[next];
    }
    for (int l = 0; l < group->count; l++) {
      real *row = effect->slope[group->source[l]][c];
      for (int k = 0; k < 6; k++) row[k] += lane_of(wrench + k, l);
    }
  }
}

/* Adds what a receiver has of jets and messages of the others. */
static void add_receiver(const robot_at_forces *robot, int i, interaction_effect *effect) {
  const interaction_model *model = robot->model;
  pair_group groups[(FL_MOST + LANES - 1) / LANES];
  brought to;
  const int count = find_sources(robot, i, groups);
  if (count == 0) return;
  memset(&to, 0, sizeof to);
  for (int g = 0; g < count; g++) {
    for (int c = 0; c < 3; c++) {
      for (int b = 0; b < 3; b++) groups[g].by_source[c][b] = lanes_of(0);
    }
    if (model->messages) add_messages(model, groups + g, i, effect);
    add_water(model, groups + g, &to);
  }
  add_taken(robot, i, &to, effect);
  for (int g = 0; g < count && effect->slope; g++) {
    add_by_jets(model, &to, groups + g);
    add_to_slope(outlets_of(model->formula[0])[i].position, groups + g, effect);
  }
}

/* Adds what the hull takes of jets that meet it: by all formulas a share `lost` of the force. */
static inline void add_jets_on_hull(const robot_at_forces *robot, int first, int count,
                                    const vector *ahead, interaction_effect *effect) {
  const interaction_model *model = robot->model;
  const outlet *outlets = outlets_of(model->formula[0]) + first;
  real hull = 0;
  for (int k = 0; k < model->formulas; k++) hull += model->weight[k] * model->formula[k]->hull;
  vector position[3];
  for (int l = 0; l < LANES; l++) {
    const int i = l < count ? l : 0;
    for (int c = 0; c < 3; c++) set_lane(position + c, l, outlets[i].position[c]);
  }
  vector d_share[3];
  const vector lost = hull * share_on_hull(model->formula[0], position, ahead, d_share);
  for (int l = 0; l < count; l++) {
    const int i = first + l;
    const real *force = robot->force + 3 * i;
    const real share = lane_of(&lost, l);
    for (int b = 0; b < 3; b++) effect->change[i][b] -= share * force[b];
    for (int c = 0; c < 3; c++) {
      const real d_lost = hull * lane_of(d_share + c, l) / robot->jets[i].thrust;
      effect->by_own[i][c][c] -= share;
      for (int b = 0; b < 3; b++) effect->by_own[i][c][b] -= force[b] * d_lost;
    }
  }
}

/* Adds messages of the hull. */
static inline void add_hull_messages(const interaction_model *model, int first, int count,
                                     const hull_place *at, interaction_effect *effect) {
  hull_message of;
  message_of_hull(model->messages->half, at, &of);
  vector feature[HULL_FEATURES];
  vector message[3];
  vector by_force[3][3];
  for (int k = 0; k < HULL_FEATURES; k++) feature[k] = of.feature[k].value;
  for (int b = 0; b < 3; b++) {
    message[b] = lanes_of(0);
    for (int c = 0; c < 3; c++) by_force[c][b] = lanes_of(0);
  }
  for (int k = 0; k < HULL_VECTORS; k++) {
    vector gradient[HULL_FEATURES];
    const dual *vectors = of.vectors[k].c;
    const vector factor = factor_of(model->hull_coefficients, HULL_VECTORS, k, HULL_FEATURES,
                                    HULL_FEATURES, feature, gradient);
    for (int b = 0; b < 3; b++) message[b] += factor * vectors[b].value;
    for (int c = 0; c < 3 && effect->slope; c++) {
      vector by = lanes_of(0);
      for (int f = 0; f < HULL_FEATURES; f++) by += gradient[f] * of.feature[f].by[c];
      for (int b = 0; b < 3; b++) {
        by_force[c][b] += by * vectors[b].value + factor * vectors[b].by[c];
      }
    }
  }
  for (int l = 0; l < count; l++) {
    for (int b = 0; b < 3; b++) {
      effect->change[first + l][b] += lane_of(message + b, l);
      for (int c = 0; c < 3; c++) effect->by_own[first + l][c][b] += lane_of(by_force[c] + b, l);
    }
  }
}

/* Adds what actuators have of the hull, LANES of them at once. */
static void add_hull(const robot_at_forces *robot, interaction_effect *effect) {
  const interaction_model *model = robot->model;
  const int has_messages = model->messages && model->messages->has_hull > 0;
  const int has_jets = has_hull(model->formula[0]);
  if (!has_messages && !has_jets) return;
  for (int first = 0; first < robot->n; first += LANES) {
    hull_place at;
    vector ahead[3]; /* of the jets */
    const int count = robot->n - first < LANES ? robot->n - first : LANES;
    for (int l = 0; l < LANES; l++) {
      const int i = first + (l < count ? l : 0);
      for (int c = 0; c < 3; c++) set_lane(ahead + c, l, robot->jets[i].ahead[c]);
      if (!has_messages) continue;
      const member *m = members_of(model->messages) + i;
      const direction *d = robot->directions + i;
      set_lane(&at.thrust, l, d->thrust);
      set_lane(&at.size_on_hull, l, m->size_on_hull);
      for (int c = 0; c < 3; c++) {
        set_lane(at.ahead + c, l, d->ahead[c]);
        set_lane(at.hull_position + c, l, m->hull_position[c]);
        set_lane(at.normal + c, l, m->normal[c]);
      }
    }
    if (has_jets) add_jets_on_hull(robot, first, count, ahead, effect);
    if (has_messages) add_hull_messages(model, first, count, &at, effect);
  }
}

static void add_interaction(const interaction_model *model, const real *force,
                            interaction_effect *effect) {
  robot_at_forces robot;
  const water *w = model->formula[0];
  const outlet *outlets = outlets_of(w);
  int rank = 0;
  robot.model = model;
  robot.force = force;
  robot.n = (int)w->n;
  for (int i = 0; i < robot.n; i++) {
    robot.jets[i] = fl_jet_of(w, outlets + i, force + 3 * i);
    if (model->messages) {
      robot.directions[i] = direction_of(members_of(model->messages) + i, force + 3 * i);
    }
    robot.rank[i] = rank;
    rank += outlets[i].diameter > 0;
  }
  for (int i = 0; i < robot.n && w->formula != 0; i++) add_receiver(&robot, i, effect);
  add_hull(&robot, effect);
}
