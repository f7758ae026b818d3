/* Jets of actuators that push along lines, at rest in the water: what fl_jets says, in a tenth of
   its time.

   A line's jet flows one way or the other. So where it meets others, and the hull, is known before
   any force is: of each pair there is the rate U / V0 of docs/theory/interaction.md, for either
   way. As a jet's direction is the force over the thrust, which a little thrust at rest is a part
   of, a rate is a cubic in how much the force is short of the thrust. Forces that are short by more
   than SHORT are left to fl_jets. */
#include "jets.h"

#define SHORT R(5e-4) /* of its thrust, by which a force is short where cubics hold */

enum {
  WAYS = 2, /* of a line: ahead, and in reverse */
  KNOTS = 4 /* of a cubic, whose coefficients come in as many numbers */
};

/* What is prepared of a robot of n lines: rates (WAYS, n, n, KNOTS) from line to line, then shares
   (WAYS, n) of their forces that the hull takes. */
static const real *rates_of(const real *numbers, int n, int way, int from) {
  return numbers + KNOTS * n * (way * n + from);
}

static const real *hull_shares_of(const real *numbers, int n, int way) {
  return numbers + WAYS * KNOTS * n * n + way * n;
}

int fl_line_jets_length(const fl_coupled_robot *robot) {
  const int n = COUNT(robot->block_uncoupled);
  if (robot->offset != fl_jets || robot->inflow) return 0;
  if (!fl_has_lines_alone(robot->block_uncoupled)) return 0;
  return WAYS * (KNOTS * n * n + n);
}

/* Coefficients of the cubic in t through values at t = 0, 1/3, 2/3 and 1. */
static void cubic_through(const real *value, real *coefficient) {
  const real first = value[1] - value[0];
  const real second = value[2] - 2 * value[1] + value[0];
  const real third = value[3] - 3 * value[2] + 3 * value[1] - value[0];
  /* Newton's form: value + 3t first + 3t (3t - 1) / 2 second + 3t (3t - 1) (3t - 2) / 6 third. */
  coefficient[0] = value[0];
  coefficient[1] = 3 * first - R(1.5) * second + third;
  coefficient[2] = R(4.5) * (second - third);
  coefficient[3] = R(4.5) * third;
}

/* The rate of a jet at another actuator, its force being a share of its thrust along a direction. */
static real rate_at(const water *w, const outlet *from, const real *along, real share,
                    const outlet *to) {
  jet made = {.thrust = 1, .speed = 1, .per_diameter = 1 / from->diameter};
  jet_met met;
  for (int c = 0; c < 3; c++) made.ahead[c] = share * along[c];
  if (!fl_jet_meets(w, from, &made, to, &met)) return 0;
  return met.speed;
}

void fl_prepare_line_jets(const fl_coupled_robot *robot, real *numbers) {
  const water *w = (const water *)robot->constants;
  const outlet *outlets = outlets_of(w);
  const int n = COUNT(robot->block_uncoupled);
  for (int way = 0; way < WAYS; way++) {
    for (int j = 0; j < n; j++) {
      const real *axis = robot->frames + 9 * j;
      real along[3];
      for (int c = 0; c < 3; c++) along[c] = way == 0 ? axis[c] : -axis[c];
      real unused[3];
      real *share = (real *)hull_shares_of(numbers, n, way) + j;
      *share = 0;
      if (has_hull(w)) *share = w->hull * fl_share_on_hull(w, outlets + j, along, unused);
      for (int i = 0; i < n; i++) {
        real *rate = (real *)rates_of(numbers, n, way, j) + KNOTS * i;
        real value[KNOTS] = {0};
        const int has_jet = w->formula != 0 && i != j && outlets[j].diameter > 0;
        for (int k = 0; has_jet && k < KNOTS; k++) {
          const real force_share = 1 - SHORT * (real)k / 3;
          value[k] = rate_at(w, outlets + j, along, force_share, outlets + i);
        }
        cubic_through(value, rate);
      }
    }
  }
}

/* A line's own jet. */
typedef struct {
  jet own;
  real force;       /* along the axis [N] */
  real share;       /* q, force over thrust */
  real speed_slope; /* of V0 q by the force [m/s/N] */
  real t_slope;     /* V0 q times the derivative of t by the force [m/s/N] */
  real t;           /* of its cubics */
  const real *rate; /* (n, KNOTS) at the others, its way */
  real hull_share;  /* of its force, that the hull takes */
  int is_at_rest;   /* whether it is lost, and has no jet */
} line_jet;

/* The jets of all lines. Returns whether they are such as are known here. */
static int jets_of(const fl_coupled_robot *robot, const fl_span *span, real force[][3],
                   line_jet *jets) {
  const water *w = (const water *)robot->constants;
  const outlet *outlets = outlets_of(w);
  const int n = COUNT(robot->block_uncoupled);
  for (int i = 0; i < n; i++) {
    line_jet *one = jets + i;
    const real *axis = robot->frames + 9 * i;
    const real y = force[i][0];
    const int way = y < 0;
    const real body[3] = {y * axis[0], y * axis[1], y * axis[2]};
    one->own = fl_jet_of(w, outlets + i, body);
    one->force = y;
    one->share = y / one->own.thrust;
    one->is_at_rest = span->is_lost[i];
    const real size = FABS(one->share);
    if (!one->is_at_rest && !(size >= 1 - SHORT)) return 0;
    one->t = (1 - size) / SHORT;
    const real speed_per_thrust = one->own.speed / one->own.thrust;
    one->speed_slope = speed_per_thrust * (1 - size * size / 2);
    one->t_slope = -speed_per_thrust * size * (1 - size * size) / SHORT;
    one->rate = rates_of(robot->line_jets, n, way, i);
    one->hull_share = hull_shares_of(robot->line_jets, n, way)[i];
  }
  return 1;
}

/* The rate of a jet at line i. */
static inline real rate_of(const line_jet *from, int i) {
  const real *c = from->rate + KNOTS * i;
  return c[0] + from->t * (c[1] + from->t * (c[2] + from->t * c[3]));
}

/* Derivative of V0 q times that rate by the force. */
static inline real rate_slope_of(const line_jet *from, int i) {
  const real *c = from->rate + KNOTS * i;
  const real t = from->t;
  const real by_t = c[1] + t * (2 * c[2] + t * 3 * c[3]);
  return from->speed_slope * rate_of(from, i) + from->t_slope * by_t;
}

/* What the water that meets a line takes of its force: add_taken of jets.c. */
typedef struct {
  real change[3]; /* of the force [N] */
  real across[3]; /* speed of the water across the own jet [m/s] */
  real against;   /* the same against its force */
  real speed;     /* of the water [m/s] */
  real share;     /* `against` over the speed of the own jet */
  real root;      /* size of that */
  real below;     /* `share` over the share of the force that is lost */
  real lost;      /* that share */
  real side_flow; /* [kg/s] */
  real drag;      /* of the housing [kg/m] */
} taken;

/* What the water u [m/s] takes of a line along an axis. */
static inline taken taken_by(const water *w, const outlet *at, const line_jet *line,
                             const real *axis, const real *u) {
  const real *a = line->own.ahead;
  taken made;
  made.against = -dot(u, a, 3);
  made.share = made.against / line->own.speed;
  made.root = SQRT(made.share * made.share + FLOOR_SHARE);
  made.below = w->lag + w->most * made.root;
  made.lost = made.share / made.below;
  made.side_flow = w->side * line->own.mass_flow;
  made.speed = SQRT(dot(u, u, 3) + ROUNDING);
  made.drag = PI / 8 * w->density * w->housing * at->diameter * at->diameter;
  const real lost_force = (made.lost + line->hull_share) * line->force;
  for (int b = 0; b < 3; b++) {
    made.across[b] = u[b] + made.against * a[b];
    made.change[b] = made.side_flow * made.across[b] + made.drag * made.speed * u[b] -
                     lost_force * axis[b];
  }
  return made;
}

/* Derivatives of what is taken, by the line's own force (3,) and by the water (3, 3), rows of u. */
static inline void slopes_of(const water *w, const line_jet *line, const taken *t, const real *axis,
                             const real *u, real *by_force, real by_water[3][3]) {
  const real *a = line->own.ahead;
  const real q = line->share;
  const real d_lost = (w->lag + w->most * FLOOR_SHARE / t->root) / (t->below * t->below);
  const real across_axis = dot(t->across, axis, 3);
  const real d_share = (across_axis / line->own.speed + t->share * q / 2) / line->own.thrust;
  const real d_force = d_lost * d_share * line->force - t->lost - line->hull_share;
  const real side_per_thrust = t->side_flow / line->own.thrust;
  for (int b = 0; b < 3; b++) {
    const real d_across = q * t->across[b] / 2 - across_axis * a[b] +
                          t->against * (axis[b] - a[b] * q);
    by_force[b] = side_per_thrust * d_across + d_force * axis[b];
  }
  const real lost_by_speed = line->force * d_lost / line->own.speed;
  const real drag_speed = t->drag * t->speed;
  const real drag_per_speed = t->drag / t->speed;
  for (int c = 0; c < 3; c++) {
    for (int b = 0; b < 3; b++) {
      by_water[c][b] = (lost_by_speed * axis[b] - t->side_flow * a[b]) * a[c] +
                       drag_per_speed * u[b] * u[c];
    }
    by_water[c][c] += t->side_flow + drag_speed;
  }
}

/* Adds to the derivative (6,) of the wrench by the force of line j that by its jet at the others,
   by their derivatives (n, 3, 6) by the water. */
static void add_slope_of_jet(const line_jet *jets, int n, int j, const real *axis,
                             real by_water[][3][6], real *slope) {
  real sum[3][6] = {{0}};
  for (int i = 0; i < n; i++) {
    if (jets[j].rate[KNOTS * i] == 0) continue;
    const real rate = rate_slope_of(jets + j, i);
    for (int c = 0; c < 3; c++) {
      for (int k = 0; k < 6; k++) sum[c][k] += rate * by_water[i][c][k];
    }
  }
  for (int k = 0; k < 6; k++) {
    slope[k] -= axis[0] * sum[0][k] + axis[1] * sum[1][k] + axis[2] * sum[2][k];
  }
}

/* The wrench offset of jets of lines (6,) for forces along the laws' axes, and, where wanted, its
   derivatives (n, 3, 6) by them, the first of each line alone. Returns whether that is known
   here. */
int fl_jets_of_lines(const fl_coupled_robot *robot, const fl_span *span, real force[][3],
                     real *offset, real slope[][3][6]) {
  const water *w = (const water *)robot->constants;
  const outlet *outlets = outlets_of(w);
  const int n = COUNT(robot->block_uncoupled);
  line_jet jets[FL_MOST];
  real u[FL_MOST][3]; /* the water that the jets bring [m/s] */
  if (!robot->line_jets || !jets_of(robot, span, force, jets)) return 0;
  memset(u, 0, (size_t)n * sizeof u[0]);
  for (int j = 0; j < n; j++) {
    if (jets[j].is_at_rest) continue;
    const jet *own = &jets[j].own;
    const real brought[3] = {own->speed * own->ahead[0], own->speed * own->ahead[1],
                             own->speed * own->ahead[2]};
    for (int i = 0; i < n; i++) {
      if (jets[j].rate[KNOTS * i] == 0) continue;
      const real rate = rate_of(jets + j, i);
      for (int c = 0; c < 3; c++) u[i][c] -= rate * brought[c];
    }
  }

  real by[FL_MOST][3][6]; /* of the wrench by the water */
  memset(offset, 0, 6 * sizeof *offset);
  for (int i = 0; i < n; i++) {
    const real *axis = robot->frames + 9 * i;
    const taken t = taken_by(w, outlets + i, jets + i, axis, u[i]);
    add_wrench(outlets[i].position, t.change, offset);
    if (!slope) continue;
    real by_force[3];
    real by_water[3][3];
    slopes_of(w, jets + i, &t, axis, u[i], by_force, by_water);
    memset(slope[i][0], 0, sizeof slope[i][0]);
    memset(by[i], 0, sizeof by[i]);
    add_wrench(outlets[i].position, by_force, slope[i][0]);
    for (int c = 0; c < 3; c++) add_wrench(outlets[i].position, by_water[c], by[i][c]);
  }
  for (int j = 0; slope && j < n; j++) {
    if (jets[j].is_at_rest) continue;
    add_slope_of_jet(jets, n, j, robot->frames + 9 * j, by, slope[j][0]);
  }
  return 1;
}
