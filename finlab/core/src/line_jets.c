/* Jets of actuators that push along lines, at rest in the water: what fl_jets says, in a fraction
   of its time.

   A line's jet flows one way or the other. So where it meets others, and the hull, is known before
   any force is: of each pair there is the rate U / V0 of docs/theory/interaction.md, for either
   way. As a jet's direction is the force over the thrust, of which a little thrust at rest is a
   part, a rate is a cubic in how much the force is short of the thrust. Of forces that are short by
   more than SHORT the rates are computed as fl_jets does. */
#include "jets.h"

#define SHORT R(5e-4) /* share of its thrust by which a force is short where cubics hold */

enum {
  WAYS = 2, /* of a line: ahead, and in reverse */
  KNOTS = 4 /* of a cubic, whose coefficients are as many */
};

/* What is prepared of a line. */
typedef struct {
  real axis[3];             /* in the body frame */
  real position[3];         /* [m] */
  real rest_thrust_squared; /* of the thrust at rest [N^2] */
  real squared_speed;       /* of a jet, per thrust [m^2/s^2/N] */
  real side_flow;           /* mass flow that gives a side force, per speed of the jet [kg/m] */
  real drag;                /* of the housing [kg/m] */
  real hull_share[WAYS];    /* of the force, that the hull takes */
} line_outlet;

/* What is prepared of a robot of n lines: their line_outlets, then rates (WAYS, n, n, KNOTS) from
   line to line. */
static const line_outlet *line_outlets_of(const real *numbers) {
  return (const line_outlet *)numbers;
}

static const real *rates_of(const real *numbers, int n, int way, int from) {
  return numbers + n * (int)(sizeof(line_outlet) / sizeof(real)) + KNOTS * n * (way * n + from);
}

int fl_line_jets_length(const fl_coupled_robot *robot) {
  const int n = COUNT(robot->block_uncoupled);
  if (robot->offset != fl_jets || robot->inflow) return 0;
  if (!fl_has_lines_alone(robot->block_uncoupled)) return 0;
  return n * (int)(sizeof(line_outlet) / sizeof(real)) + WAYS * KNOTS * n * n;
}

/* Coefficients of the cubic in t through values at t = 0, 1/3, 2/3 and 1, from Newton's form: value
   + 3t first + 3t (3t - 1) / 2 second + 3t (3t - 1) (3t - 2) / 6 third. */
static void cubic_through(const real *value, real *coefficient) {
  const real first = value[1] - value[0];
  const real second = value[2] - 2 * value[1] + value[0];
  const real third = value[3] - 3 * value[2] + 3 * value[1] - value[0];
  coefficient[0] = value[0];
  coefficient[1] = 3 * first - R(1.5) * second + third;
  coefficient[2] = R(4.5) * (second - third);
  coefficient[3] = R(4.5) * third;
}

/* The rate of a jet at another outlet, the force being a share of its thrust along a direction. */
static real rate_at(const water *w, const outlet *from, const real *along, real share,
                    const outlet *to) {
  jet made = {.thrust = 1, .speed = 1, .per_diameter = 1 / from->diameter};
  jet_met met;
  for (int c = 0; c < 3; c++) made.ahead[c] = share * along[c];
  if (!fl_jet_meets(w, from, &made, to, &met)) return 0;
  return met.speed;
}

static void prepare_outlet(const water *w, const outlet *at, const real *axis, line_outlet *line) {
  const real nothing[3] = {0};
  const jet at_rest = fl_jet_of(w, at, nothing);
  memcpy(line->axis, axis, sizeof line->axis);
  memcpy(line->position, at->position, sizeof line->position);
  line->rest_thrust_squared = at_rest.thrust * at_rest.thrust;
  line->squared_speed = at_rest.speed * at_rest.speed / at_rest.thrust;
  line->side_flow = w->side * at_rest.mass_flow / at_rest.speed;
  line->drag = PI / 8 * w->density * w->housing * at->diameter * at->diameter;
  for (int way = 0; way < WAYS; way++) {
    real along[3];
    real unused[3];
    for (int c = 0; c < 3; c++) along[c] = way == 0 ? axis[c] : -axis[c];
    line->hull_share[way] = 0;
    if (has_hull(w)) line->hull_share[way] = w->hull * fl_share_on_hull(w, at, along, unused);
  }
}

void fl_prepare_line_jets(const fl_coupled_robot *robot, real *numbers) {
  const water *w = (const water *)robot->constants;
  const outlet *outlets = outlets_of(w);
  const int n = COUNT(robot->block_uncoupled);
  for (int j = 0; j < n; j++) {
    const real *axis = robot->frames + 9 * j;
    prepare_outlet(w, outlets + j, axis, (line_outlet *)line_outlets_of(numbers) + j);
    const int has_jet = w->formula != 0 && outlets[j].diameter > 0;
    for (int pair = 0; pair < WAYS * n; pair++) {
      const int way = pair / n;
      const int i = pair % n;
      real along[3];
      real value[KNOTS] = {0};
      for (int c = 0; c < 3; c++) along[c] = way == 0 ? axis[c] : -axis[c];
      for (int k = 0; has_jet && i != j && k < KNOTS; k++) {
        const real share = 1 - SHORT * (real)k / 3;
        value[k] = rate_at(w, outlets + j, along, share, outlets + i);
      }
      cubic_through(value, (real *)rates_of(numbers, n, way, j) + KNOTS * i);
    }
  }
}

/* A line's own jet. */
typedef struct {
  const line_outlet *line;
  const real *rate; /* (n, KNOTS) at the others, its way */
  real force;       /* along the axis [N] */
  real per_thrust;  /* one over the thrust [1/N] */
  real share;       /* q, force over thrust */
  real speed;       /* V0 [m/s] */
  real speed_slope; /* of V0 q by the force [m/s/N] */
  real t;           /* of its cubics */
  real t_slope;     /* V0 q times the derivative of t by the force [m/s/N] */
  real hull_share;  /* of its force, that the hull takes */
  int index;        /* which line it is of */
  int is_lost;      /* whether it has no jet */
  int is_short;     /* whether cubics do not hold */
} line_jet;

static void find_line_jet(const fl_coupled_robot *robot, const fl_span *span, int i, real force,
                          line_jet *own_jet) {
  const line_outlet *line = line_outlets_of(robot->line_jets) + i;
  const int n = COUNT(robot->block_uncoupled);
  const int way = force < 0;
  const real thrust = SQRT(force * force + line->rest_thrust_squared);
  own_jet->line = line;
  own_jet->rate = rates_of(robot->line_jets, n, way, i);
  own_jet->force = force;
  own_jet->per_thrust = 1 / thrust;
  own_jet->share = force * own_jet->per_thrust;
  own_jet->speed = SQRT(line->squared_speed * thrust);
  const real size = FABS(own_jet->share);
  const real squared = own_jet->share * own_jet->share;
  const real speed_per_thrust = own_jet->speed * own_jet->per_thrust;
  own_jet->speed_slope = speed_per_thrust * (1 - squared / 2);
  own_jet->t = (1 - size) / SHORT;
  own_jet->t_slope = -speed_per_thrust * size * (1 - squared) / SHORT;
  own_jet->hull_share = line->hull_share[way];
  own_jet->index = i;
  own_jet->is_lost = span->is_lost[i];
  own_jet->is_short = !(size >= 1 - SHORT);
}

/* The jet of a line whose force is short, as fl_jets has it. */
static jet short_jet_of(const fl_coupled_robot *robot, const line_jet *from) {
  const water *w = (const water *)robot->constants;
  real body[3];
  for (int c = 0; c < 3; c++) body[c] = from->force * from->line->axis[c];
  return fl_jet_of(w, outlets_of(w) + from->index, body);
}

/* The same share of its force that the hull takes. */
static real short_hull_share(const fl_coupled_robot *robot, const line_jet *from) {
  const water *w = (const water *)robot->constants;
  const jet own = short_jet_of(robot, from);
  real unused[3];
  if (!has_hull(w)) return 0;
  return w->hull * fl_share_on_hull(w, outlets_of(w) + from->index, own.ahead, unused);
}

/* Its rate at line i, and the derivative of V0 q times that by the force. */
static real short_rate_of(const fl_coupled_robot *robot, const line_jet *from, int i, real *slope) {
  const water *w = (const water *)robot->constants;
  const outlet *at = outlets_of(w) + from->index;
  const jet own = short_jet_of(robot, from);
  jet_met met;
  *slope = 0;
  if (i == from->index || w->formula == 0 || !(at->diameter > 0)) return 0;
  if (!fl_jet_meets(w, at, &own, outlets_of(w) + i, &met)) return 0;
  const real q = from->share;
  /* How the place along the jet changes with the direction, times the thrust. */
  const real along_slope = dot(met.from_outlet, from->line->axis, 3) + q * met.along;
  const real speed_slope = (met.speed * q / 2 + met.slope * along_slope) * from->per_thrust;
  *slope = met.speed * from->per_thrust - q * speed_slope;
  return met.speed / from->speed;
}

/* Whether a jet misses line i. */
static inline int misses(const line_jet *from, int i) {
  return !from->is_short && from->rate[KNOTS * i] == 0;
}

/* The rate of a jet at line i. */
static inline real rate_of(const fl_coupled_robot *robot, const line_jet *from, int i) {
  real unused;
  if (from->is_short) return short_rate_of(robot, from, i, &unused);
  const real *c = from->rate + KNOTS * i;
  const real t = from->t;
  return c[0] + t * (c[1] + t * (c[2] + t * c[3]));
}

/* The derivative of V0 q times that rate by the force. */
static inline real rate_slope_of(const fl_coupled_robot *robot, const line_jet *from, int i) {
  if (from->is_short) {
    real slope;
    short_rate_of(robot, from, i, &slope);
    return slope;
  }
  const real *c = from->rate + KNOTS * i;
  const real t = from->t;
  const real rate = c[0] + t * (c[1] + t * (c[2] + t * c[3]));
  const real by_t = c[1] + t * (2 * c[2] + t * 3 * c[3]);
  return from->speed_slope * rate + from->t_slope * by_t;
}

/* What the water u that meets a line takes of its force, as add_taken of jets.c has it. With the
   axis a, that is by_water u + by_axis a, its derivative by the force d_water u + d_axis a, and its
   derivative by the water p a a' + m I + d u u'. */
typedef struct {
  real wrench[6];        /* of 1 N along the axis [1, m] */
  real water[6];         /* the same of u in place of the axis [m/s, m^2/s] */
  real by_water;         /* [kg/s] */
  real by_axis;          /* [N] */
  real d_water;          /* [s/m] */
  real d_axis;           /* [1] */
  real along, even, own; /* p and m [kg/s], d [kg/m] */
} taken;

static inline taken taken_by(const water *w, const line_jet *own_jet, const real *u,
                             int has_slope) {
  const line_outlet *line = own_jet->line;
  const real q = own_jet->share;
  const real u_axis = dot(u, line->axis, 3);
  const real against = -q * u_axis; /* speed of the water against the jet's force */
  const real share = against / own_jet->speed;
  const real root = SQRT(share * share + FLOOR_SHARE);
  const real below = w->lag + w->most * root;
  const real lost = share / below + own_jet->hull_share; /* share of the force */
  const real side_flow = line->side_flow * own_jet->speed;
  const real speed = SQRT(dot(u, u, 3) + ROUNDING);
  taken made;
  memset(&made, 0, sizeof made);
  add_wrench(line->position, line->axis, made.wrench);
  add_wrench(line->position, u, made.water);
  /* Across the jet, which turns it aside, the water's speed is u + against q a. */
  made.by_water = side_flow + line->drag * speed;
  made.by_axis = side_flow * against * q - lost * own_jet->force;
  if (!has_slope) return made;

  const real lost_slope = (w->lag + w->most * FLOOR_SHARE / root) / (below * below);
  const real lost_per_speed = own_jet->force * lost_slope / own_jet->speed;
  made.along = q * (lost_per_speed - side_flow * q);
  made.even = made.by_water;
  made.own = line->drag / speed;
  const real across_axis = u_axis + against * q; /* of the speed across */
  const real side_per_thrust = side_flow * own_jet->per_thrust;
  const real side_slope = against * (1 - q * q / 2) - across_axis * q;
  const real d_lost = lost_per_speed * (across_axis + against * q / 2) * own_jet->per_thrust;
  made.d_water = side_per_thrust * q / 2;
  made.d_axis = side_per_thrust * side_slope + d_lost - lost;
  return made;
}

/* Adds the water [m/s] that a jet brings to the n lines. */
static void add_water_of_jet(const fl_coupled_robot *robot, const line_jet *own_jet, int n,
                             real u[][3]) {
  const real speed = own_jet->speed * own_jet->share;
  for (int i = 0; i < n; i++) {
    if (misses(own_jet, i)) continue;
    const real brought = speed * rate_of(robot, own_jet, i);
    for (int c = 0; c < 3; c++) u[i][c] -= brought * own_jet->line->axis[c];
  }
}

/* Adds to the derivative (6,) of the wrench by the force of a line that by its jet at the n
   others. */
static void add_slope_of_jet(const fl_coupled_robot *robot, const line_jet *own_jet, int n,
                             const taken *others, real *slope) {
  const real *axis = own_jet->line->axis;
  real even = 0;
  real lever[3] = {0};
  for (int i = 0; i < n; i++) {
    if (misses(own_jet, i)) continue;
    const taken *other = others + i;
    const real *position = line_outlets_of(robot->line_jets)[i].position;
    const real rate = -rate_slope_of(robot, own_jet, i);
    const real along = rate * other->along * dot(other->wrench, axis, 3);
    const real own = rate * other->own * dot(other->water, axis, 3);
    for (int k = 0; k < 6; k++) slope[k] += along * other->wrench[k] + own * other->water[k];
    even += rate * other->even;
    for (int c = 0; c < 3; c++) lever[c] += rate * other->even * position[c];
  }
  real wrench[6] = {0};
  add_wrench(lever, axis, wrench);
  for (int c = 0; c < 3; c++) {
    slope[c] += even * axis[c];
    slope[3 + c] += wrench[3 + c];
  }
}

void fl_jets_of_lines(const fl_coupled_robot *robot, const fl_span *span, real force[][3],
                      real *offset, real slope[][3][6]) {
  const water *w = (const water *)robot->constants;
  const int n = COUNT(robot->block_uncoupled);
  line_jet jets[FL_MOST];
  taken lines[FL_MOST];
  real u[FL_MOST][3]; /* the water that the jets bring [m/s] */
  memset(u, 0, (size_t)n * sizeof u[0]);
  memset(offset, 0, 6 * sizeof *offset);
  for (int j = 0; j < n; j++) {
    line_jet *own_jet = jets + j;
    find_line_jet(robot, span, j, force[j][0], own_jet);
    if (own_jet->is_lost) continue;
    if (own_jet->is_short) own_jet->hull_share = short_hull_share(robot, own_jet);
    add_water_of_jet(robot, own_jet, n, u);
  }
  for (int i = 0; i < n; i++) {
    taken *own = lines + i;
    *own = taken_by(w, jets + i, u[i], slope != 0);
    for (int k = 0; k < 6; k++) {
      offset[k] += own->by_water * own->water[k] + own->by_axis * own->wrench[k];
    }
  }
  for (int j = 0; slope && j < n; j++) {
    const taken *own = lines + j;
    for (int k = 0; k < 6; k++) {
      slope[j][0][k] = own->d_water * own->water[k] + own->d_axis * own->wrench[k];
    }
    if (!jets[j].is_lost) add_slope_of_jet(robot, jets + j, n, lines, slope[j][0]);
  }
}
