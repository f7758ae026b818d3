/* What jets take from forces by a formula of eight constants, and what speed takes;
   docs/theory/interaction.md has both. */
#include "internal.h"

#define NO_AREA R(1e-12)    /* [m^2] beside the disc of an actuator, which may have none */
#define FLOOR_SHARE R(1e-4) /* squared speed over that of a jet to which its size is rounded off */
#define FAR_BEHIND 20       /* a jet is nothing at so many `behind` upstream of its outlet */
#define FAR_ASIDE 40        /* nor where the exponent of its profile is above that */

/* Numbers of a robot: a `water`, then an `outlet` for each of its n actuators. */
typedef struct {
  real n;
  real formula; /* 1 where jets count, else speed alone takes */
  real density;
  real still; /* speed of a jet below which it counts as none [m/s] */
  /* The constants. */
  real length, width, spread, lag, most, side, housing, hull, behind, grazing;
  real center[3], half[3]; /* of the ellipsoid that stands for the hull [m]; 0 for none */
} water;

typedef struct {
  real position[3], diameter, advance;
} outlet;

typedef struct {
  real thrust;    /* [N] */
  real speed;     /* of the water far behind [m/s] */
  real ahead[3];  /* direction of the force */
  real mass_flow; /* [kg/s] */
} jet;

/* The jet of a force, by momentum theory; a little thrust is left where there is none, so
   that it has a direction. */
static jet jet_of(const water *w, const outlet *from, const real *force) {
  const real disc = PI / 4 * from->diameter * from->diameter;
  const real area = disc + NO_AREA;
  const real thrust_still = w->density * area * w->still * w->still / 2;
  jet made;
  made.thrust = SQRT(dot(force, force, 3) + thrust_still * thrust_still);
  for (int c = 0; c < 3; c++) made.ahead[c] = force[c] / made.thrust;
  made.speed = SQRT(2 * made.thrust / (w->density * area));
  made.mass_flow = w->density * disc * made.speed;
  return made;
}

/* Adds the wrench of a force at a position: f and r x f. */
static void add_wrench(const real *r, const real *f, real *wrench) {
  for (int k = 0; k < 3; k++) {
    const int l = (k + 1) % 3;
    const int m = (k + 2) % 3;
    wrench[k] += f[k];
    wrench[3 + k] += r[l] * f[m] - r[m] * f[l];
  }
}

/* How a jet meets a position. */
typedef struct {
  real from_outlet[3]; /* in diameters */
  real along;          /* the same along the jet */
  real speed;          /* [m/s] */
  real slope;          /* of the speed by `along` */
} jet_at;

/* How fast the jet of an actuator is at another one: a Gaussian profile that widens along
   the jet. */
static jet_at jet_at_outlet(const water *w, const outlet *from, const jet *j, const outlet *to) {
  jet_at met;
  for (int c = 0; c < 3; c++) {
    met.from_outlet[c] = (to->position[c] - from->position[c]) / from->diameter;
  }
  const real x = -dot(met.from_outlet, j->ahead, 3);
  const real aside_squared = dot(met.from_outlet, met.from_outlet, 3) - x * x;
  const real width_squared = x * x + w->width * w->width;
  met.along = x;
  met.speed = 0;
  met.slope = 0;
  /* Nothing to rounding, in double precision: */
  if (x < -FAR_BEHIND * w->behind) return met;
  if (w->spread * aside_squared > FAR_ASIDE * width_squared) return met;

  const real q = x / w->length;
  const real decay = 1 + q * q * q * q;
  const real onset = TANH(x / w->behind);
  const real profile = EXP(-w->spread * aside_squared / width_squared);
  const real half_speed = j->speed * profile / SQRT(SQRT(decay)) / 2;
  met.speed = half_speed * (1 + onset);
  /* Logarithmic derivatives of the profile and of the decay. */
  const real d_profile = 2 * w->spread * x * (width_squared + aside_squared) /
                         (width_squared * width_squared);
  const real d_decay = q * q * q / (decay * w->length);
  met.slope = half_speed * (1 - onset * onset) / w->behind + met.speed * (d_profile - d_decay);
  return met;
}

/* Share of a jet that meets the hull, and its derivatives by the direction, in which it is
   constant along it. */
static real share_on_hull(const water *w, const outlet *from, const real *ahead, real *slope) {
  real position[3]; /* on the scale of the ellipsoid, which is then a unit sphere */
  real course[3];
  for (int c = 0; c < 3; c++) {
    position[c] = (from->position[c] - w->center[c]) / w->half[c];
    course[c] = -ahead[c] / w->half[c];
  }
  const real size = SQRT(dot(course, course, 3) + TINY);
  const real facing = -dot(position, course, 3) / size; /* how far ahead the sphere's middle is */
  const real aside_squared = dot(position, position, 3) - facing * facing;
  const real rim = TANH((1 - aside_squared) / w->grazing);
  const real side = TANH(facing / w->grazing);
  const real d_facing =
      (2 * facing * (1 - rim * rim) * (1 + side) + (1 + rim) * (1 - side * side)) /
      (4 * w->grazing);
  for (int c = 0; c < 3; c++) {
    slope[c] = d_facing * (position[c] + facing * course[c] / size) / (size * w->half[c]);
  }
  return (1 + rim) * (1 + side) / 4;
}

/* Adds the force that comes of the water u that meets an actuator, and its derivatives by
   force and water. */
static void add_taken(const water *w, const outlet *p, const jet *j, const real *force,
                      const real *u, real *change, real by_force[3][3], real by_water[3][3]) {
  const real *a = j->ahead;
  const real t = j->thrust;
  const real against = -dot(u, a, 3); /* speed of the water against the jet's force */
  const real share = against / j->speed;
  const real root = SQRT(share * share + FLOOR_SHARE);
  const real below = w->lag + w->most * root;
  const real d_lost = (w->lag + w->most * FLOOR_SHARE / root) / (below * below);
  real lost = share / below; /* share of the force */
  real d_hull[3] = {0};
  const int has_hull = w->half[0] > 0 && w->half[1] > 0 && w->half[2] > 0;
  if (has_hull) lost += w->hull * share_on_hull(w, p, a, d_hull);

  const real side_flow = w->side * j->mass_flow;
  const real speed = SQRT(dot(u, u, 3) + ROUNDING);
  const real drag = PI / 8 * w->density * w->housing * p->diameter * p->diameter;
  real across[3];
  for (int b = 0; b < 3; b++) across[b] = u[b] + against * a[b];
  for (int b = 0; b < 3; b++) {
    change[b] += side_flow * across[b] + drag * speed * u[b] - lost * force[b];
  }
  for (int c = 0; c < 3; c++) {
    const real d_share = across[c] / (t * j->speed) + share * a[c] / (2 * t);
    const real d_lost_force = w->hull * d_hull[c] / t - d_lost * d_share;
    for (int b = 0; b < 3; b++) {
      const real identity = (real)(b == c); /* of its matrix */
      const real projection = identity - a[b] * a[c];
      const real d_drag = drag * (speed * identity + u[b] * u[c] / speed);
      by_water[c][b] += side_flow * projection + d_drag + force[b] * d_lost * a[c] / j->speed;
      const real d_across = a[c] * across[b] / 2 - across[c] * a[b] + against * projection;
      by_force[c][b] += side_flow / t * d_across - lost * identity - force[b] * d_lost_force;
    }
  }
}

/* Adds what a speed v [m/s] of the position through the water takes: the advance ratio's
   share of the force. */
static void add_lost(const outlet *p, const jet *j, const real *force, const real *v, real *change,
                     real by_force[3][3]) {
  const real *a = j->ahead;
  const real along = dot(v, a, 3);
  const real per_speed = p->advance / j->speed;
  const real share = per_speed * along;
  for (int c = 0; c < 3; c++) {
    change[c] -= share * force[c];
    by_force[c][c] -= share;
    const real d_share = per_speed * (v[c] - a[c] * along) - share * a[c] / 2;
    for (int b = 0; b < 3; b++) by_force[c][b] -= force[b] * d_share / j->thrust;
  }
}

/* Whether the jet of actuator j may meet actuator i. */
static int may_meet(const water *w, const outlet *outlets, int j, int i) {
  return j != i && outlets[j].diameter > 0 && w->formula != 0;
}

/* Adds to the derivatives (n, 3, 6) of the wrench those by the forces of the jets that meet
   an actuator, by its own derivatives (3, 6) by the water. */
static void add_slopes_of_jets(const water *w, const outlet *outlets, const jet *jets,
                               const jet_at *met, int i, real by[3][6], real *slope) {
  for (int j = 0; j < (int)w->n; j++) {
    if (!may_meet(w, outlets, j, i) || met[j].speed == 0) continue;
    const jet_at *m = &met[j];
    const real *a = jets[j].ahead;
    for (int c = 0; c < 3; c++) {
      const real d_speed = m->speed * a[c] / 2 + m->slope * (m->from_outlet[c] + a[c] * m->along);
      real *row = slope + 18 * j + 6 * c;
      for (int k = 0; k < 6; k++) {
        const real along = a[0] * by[0][k] + a[1] * by[1][k] + a[2] * by[2][k];
        row[k] += (d_speed * along - m->speed * by[c][k]) / jets[j].thrust;
      }
    }
  }
}

/* Forces (n, 3) that come beside forces (n, 3) of one robot, their wrench (6,) and its
   derivatives (n, 3, 6). */
static void offset_of(const water *w, const real *force, const real *inflow, real *change,
                      real *wrench, real *slope) {
  const outlet *outlets = (const outlet *)(w + 1);
  const int n = (int)w->n;
  jet jets[FL_MOST];
  memset(change, 0, (size_t)3 * (size_t)n * sizeof *change);
  memset(wrench, 0, 6 * sizeof *wrench);
  if (slope) memset(slope, 0, (size_t)18 * (size_t)n * sizeof *slope);
  for (int i = 0; i < n; i++) jets[i] = jet_of(w, outlets + i, force + 3 * i);
  for (int i = 0; i < n; i++) {
    const outlet *at = outlets + i;
    const real *f = force + 3 * i;
    real *taken = change + 3 * i;
    jet_at met[FL_MOST]; /* of each jet that meets this actuator */
    real u[3] = {0};     /* the water that they bring [m/s] */
    real by_force[3][3] = {{0}};
    real by_water[3][3] = {{0}};
    for (int j = 0; j < n; j++) {
      if (!may_meet(w, outlets, j, i)) continue;
      met[j] = jet_at_outlet(w, outlets + j, jets + j, at);
      for (int c = 0; c < 3; c++) u[c] -= met[j].speed * jets[j].ahead[c];
    }
    if (w->formula != 0) add_taken(w, at, jets + i, f, u, taken, by_force, by_water);
    if (inflow) add_lost(at, jets + i, f, inflow + 3 * i, taken, by_force);
    add_wrench(at->position, taken, wrench);
    if (!slope) continue;
    real by[3][6] = {{0}}; /* of the wrench by the water */
    for (int c = 0; c < 3; c++) {
      add_wrench(at->position, by_force[c], slope + 18 * i + 6 * c);
      add_wrench(at->position, by_water[c], by[c]);
    }
    add_slopes_of_jets(w, outlets, jets, met, i, by, slope);
  }
}

void fl_jets(const real *constants, const real *force, int count, const real *inflow, real *change,
             real *offset, real *slope) {
  const water *w = (const water *)constants;
  const int n = (int)w->n;
  for (int k = 0; k < count; k++) {
    offset_of(w, force, inflow, change, offset, slope);
    force += 3 * n;
    change += 3 * n;
    offset += 6;
    if (inflow) inflow += 3 * n;
    if (slope) slope += 18 * n;
  }
}
