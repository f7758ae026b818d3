/* What jets take from forces by a formula of eight constants, and what speed takes;
   docs/theory/interaction.md has both. */
#include "jets.h"

#define NO_AREA R(1e-12) /* [m^2] beside the disc of an actuator, which may have none */
#define FAR_BEHIND 14    /* a jet is nothing at so many `behind` upstream of its outlet */
#define FAR_ASIDE 28     /* nor where the exponent of its profile is above that */
#define SATURATED_AT 14  /* from here on a sigmoid is 0 or 1 but for less than ROUNDING */

/* (1 + tanh x) / 2; most arguments are far out, where it needs no exponential. */
static real sigmoid(real x) {
  if (x > SATURATED_AT) return 1;
  if (x < -SATURATED_AT) return 0;
  return 1 / (1 + EXP(-2 * x));
}

/* The jet of a force, by momentum theory; a little thrust is left where there is none, so
   that it has a direction. */
jet fl_jet_of(const water *w, const outlet *from, const real *force) {
  const real disc = PI / 4 * from->diameter * from->diameter;
  const real area = disc + NO_AREA;
  const real thrust_still = w->density * area * w->still * w->still / 2;
  jet made;
  made.thrust = SQRT(dot(force, force, 3) + thrust_still * thrust_still);
  for (int c = 0; c < 3; c++) made.ahead[c] = force[c] / made.thrust;
  made.speed = SQRT(2 * made.thrust / (w->density * area));
  made.mass_flow = w->density * disc * made.speed;
  made.per_diameter = 0;
  if (from->diameter > 0) made.per_diameter = 1 / from->diameter;
  return made;
}

/* How fast the jet of an actuator is at another one: a Gaussian profile that widens along
   the jet. Returns whether there is anything of it. */
int fl_jet_meets(const water *w, const outlet *from, const jet *j, const outlet *to, jet_met *met) {
  real *way = met->from_outlet;
  for (int c = 0; c < 3; c++) way[c] = (to->position[c] - from->position[c]) * j->per_diameter;
  const real x = -dot(way, j->ahead, 3);
  const real aside_squared = dot(way, way, 3) - x * x;
  const real width_squared = x * x + w->width * w->width;
  /* Below ROUNDING of what it is in the middle: */
  if (x < -FAR_BEHIND * w->behind) return 0;
  if (w->spread * aside_squared > FAR_ASIDE * width_squared) return 0;

  const real q = x / w->length;
  const real decay = 1 + q * q * q * q;
  const real onset = sigmoid(x / w->behind);
  const real profile = EXP(-w->spread * aside_squared / width_squared);
  met->along = x;
  met->speed = j->speed * profile * onset / SQRT(SQRT(decay));
  /* Logarithmic derivatives of the onset, of the profile and of the decay. */
  const real d_onset = 2 * (1 - onset) / w->behind;
  const real d_profile = 2 * w->spread * x * (width_squared + aside_squared) /
                         (width_squared * width_squared);
  const real d_decay = q * q * q / (decay * w->length);
  met->slope = met->speed * (d_onset + d_profile - d_decay);
  return 1;
}

/* Share of a jet that meets the hull, and its derivatives by the direction, in which it is
   constant along it. */
real fl_share_on_hull(const water *w, const outlet *from, const real *ahead, real *slope) {
  real position[3]; /* on the scale of the ellipsoid, which is then a unit sphere */
  real course[3];
  for (int c = 0; c < 3; c++) {
    position[c] = (from->position[c] - w->center[c]) / w->half[c];
    course[c] = -ahead[c] / w->half[c];
  }
  const real size = SQRT(dot(course, course, 3) + TINY);
  const real facing = -dot(position, course, 3) / size; /* how far ahead the sphere's middle is */
  const real aside_squared = dot(position, position, 3) - facing * facing;
  const real rim = sigmoid((1 - aside_squared) / w->grazing);
  const real side = sigmoid(facing / w->grazing);
  const real d_facing = 2 * rim * side * (2 * facing * (1 - rim) + (1 - side)) / w->grazing;
  for (int c = 0; c < 3; c++) {
    slope[c] = d_facing * (position[c] + facing * course[c] / size) / (size * w->half[c]);
  }
  return rim * side;
}

/* Adds what the hull takes of a jet that meets it: the share `lost` of the force. */
static void add_hull(const water *w, const outlet *p, const jet *j, const real *force, real *change,
                     real by_force[3][3]) {
  real d_share[3];
  const real lost = w->hull * fl_share_on_hull(w, p, j->ahead, d_share);
  for (int b = 0; b < 3; b++) change[b] -= lost * force[b];
  for (int c = 0; c < 3; c++) {
    const real d_lost = w->hull * d_share[c] / j->thrust;
    by_force[c][c] -= lost;
    for (int b = 0; b < 3; b++) by_force[c][b] -= force[b] * d_lost;
  }
}

/* Adds the force that comes of the water u that meets an actuator, and, where wanted, its
   derivatives by force and water. */
static void add_taken(const water *w, const outlet *p, const jet *j, const real *force,
                      const real *u, int has_slope, real *change, real by_force[3][3],
                      real by_water[3][3]) {
  const real *a = j->ahead;
  const real t = j->thrust;
  const real against = -dot(u, a, 3); /* speed of the water against the jet's force */
  const real share = against / j->speed;
  const real root = SQRT(share * share + FLOOR_SHARE);
  const real below = w->lag + w->most * root;
  const real lost = share / below; /* share of the force */

  const real side_flow = w->side * j->mass_flow;
  const real speed = SQRT(dot(u, u, 3) + ROUNDING);
  const real drag = PI / 8 * w->density * w->housing * p->diameter * p->diameter;
  real across[3];
  for (int b = 0; b < 3; b++) across[b] = u[b] + against * a[b];
  for (int b = 0; b < 3; b++) {
    change[b] += side_flow * across[b] + drag * speed * u[b] - lost * force[b];
  }
  if (!has_slope) return;
  const real d_lost = (w->lag + w->most * FLOOR_SHARE / root) / (below * below);
  const real d_lost_by_speed = d_lost / j->speed;
  const real side_per_thrust = side_flow / t;
  const real drag_per_speed = drag / speed;
  for (int c = 0; c < 3; c++) {
    const real d_share = (across[c] / j->speed + share * a[c] / 2) / t;
    const real d_lost_force = -d_lost * d_share;
    for (int b = 0; b < 3; b++) {
      const real identity = (real)(b == c); /* of its matrix */
      const real projection = identity - a[b] * a[c];
      const real d_drag = drag * speed * identity + drag_per_speed * u[b] * u[c];
      by_water[c][b] += side_flow * projection + d_drag + force[b] * d_lost_by_speed * a[c];
      const real d_across = a[c] * across[b] / 2 - across[c] * a[b] + against * projection;
      by_force[c][b] += side_per_thrust * d_across - lost * identity - force[b] * d_lost_force;
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

/* The jets that meet actuator i, into `met`, and the water u [m/s] that they bring. Returns how
   many there are. */
static int jets_at(const water *w, const outlet *outlets, const jet *jets, int i, jet_met *met,
                   real *u) {
  int count = 0;
  for (int j = 0; j < (int)w->n; j++) {
    if (j == i || !(outlets[j].diameter > 0)) continue;
    if (!fl_jet_meets(w, outlets + j, jets + j, outlets + i, met + count)) continue;
    met[count].from = j;
    for (int c = 0; c < 3; c++) u[c] -= met[count].speed * jets[j].ahead[c];
    count++;
  }
  return count;
}

/* Adds to the derivatives (n, 3, 6) of the wrench those by the forces of the jets that meet
   an actuator, by its own derivatives (3, 6) by the water. */
static void add_slopes_of_jets(const jet *jets, const jet_met *met, int count, real by[3][6],
                               real *slope) {
  for (int m = 0; m < count; m++) {
    const jet_met *one = met + m;
    const jet *j = jets + one->from;
    const real *a = j->ahead;
    real along[6]; /* derivative by the water along the jet */
    for (int k = 0; k < 6; k++) along[k] = a[0] * by[0][k] + a[1] * by[1][k] + a[2] * by[2][k];
    const real across = one->speed / j->thrust;
    for (int c = 0; c < 3; c++) {
      const real d_speed =
          (one->speed * a[c] / 2 + one->slope * (one->from_outlet[c] + a[c] * one->along)) /
          j->thrust;
      real *row = slope + 18 * one->from + 6 * c;
      for (int k = 0; k < 6; k++) row[k] += d_speed * along[k] - across * by[c][k];
    }
  }
}

/* Forces (n, 3) that come beside forces (n, 3) of one robot, their wrench (6,) and its
   derivatives (n, 3, 6). */
static void offset_of(const water *w, const real *force, const real *inflow, real *change,
                      real *wrench, real *slope) {
  const outlet *outlets = outlets_of(w);
  const int n = (int)w->n;
  const int has_jets = w->formula != 0;
  const int meets_hull = has_hull(w);
  jet jets[FL_MOST];
  memset(change, 0, (size_t)3 * (size_t)n * sizeof *change);
  memset(wrench, 0, 6 * sizeof *wrench);
  if (slope) memset(slope, 0, (size_t)18 * (size_t)n * sizeof *slope);
  for (int i = 0; i < n; i++) jets[i] = fl_jet_of(w, outlets + i, force + 3 * i);
  for (int i = 0; i < n; i++) {
    const outlet *at = outlets + i;
    const real *f = force + 3 * i;
    real *taken = change + 3 * i;
    jet_met met[FL_MOST];
    int count = 0;
    real u[3] = {0}; /* the water that the jets bring [m/s] */
    real by_force[3][3] = {{0}};
    real by_water[3][3] = {{0}};
    if (has_jets) count = jets_at(w, outlets, jets, i, met, u);
    if (meets_hull) add_hull(w, at, jets + i, f, taken, by_force);
    if (count > 0) {
      add_taken(w, at, jets + i, f, u, slope != 0, taken, by_force, by_water);
    }
    if (inflow) add_lost(at, jets + i, f, inflow + 3 * i, taken, by_force);
    add_wrench(at->position, taken, wrench);
    if (!slope) continue;
    for (int c = 0; c < 3; c++) add_wrench(at->position, by_force[c], slope + 18 * i + 6 * c);
    if (count == 0) continue;
    real by[3][6] = {{0}}; /* of the wrench by the water */
    for (int c = 0; c < 3; c++) add_wrench(at->position, by_water[c], by[c]);
    add_slopes_of_jets(jets, met, count, by, slope);
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
