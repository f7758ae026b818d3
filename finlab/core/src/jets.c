/* What jets take from forces by a formula of eight constants, and what speed takes; docs/theory/interaction.md has both. */
#include "internal.h"

/* Numbers of a robot: a `water`, then an `outlet` for each of its n actuators. */
typedef struct {
  real n, formula; /* formula: 1 where jets count, else speed alone takes */
  real density, still; /* speed of a jet below which it counts as none [m/s] */
  real length, width, spread, lag, most, side, housing, hull, behind, grazing; /* the constants */
  real center[3], half[3]; /* of the ellipsoid that stands for the hull [m]; 0 for none */
} water;
typedef struct { real position[3], diameter, advance; } outlet;
typedef struct { real thrust, speed, ahead[3], moved; } jet; /* moved: mass flow [kg/s] */

static jet jet_of(const water *w, const outlet *p, const real *force) {
  real disc = PI / 4 * p->diameter * p->diameter, area = disc + R(1e-12), least = w->density * area * w->still * w->still / 2;
  jet o = {SQRT(dot(force, force, 3) + least * least), 0, {0}, 0};
  for (int c = 0; c < 3; c++) o.ahead[c] = force[c] / o.thrust;
  o.speed = SQRT(2 * o.thrust / (w->density * area)), o.moved = w->density * disc * o.speed;
  return o;
}

/* Adds the wrench of a force at a place, times a factor. */
static void add_wrench(const real *r, const real *f, real factor, real *wrench) {
  for (int k = 0, l = 1, m = 2; k < 3; k++, l = (l + 1) % 3, m = (m + 1) % 3)
    wrench[k] += factor * f[k], wrench[3 + k] += factor * (r[l] * f[m] - r[m] * f[l]);
}

typedef struct { real way[3], along, speed, slope; } meeting; /* way in diameters; slope: of the speed by `along` */

/* How fast the jet of an actuator meets a place. */
static meeting meeting_of(const water *w, const outlet *from, const jet *j, const outlet *to) {
  meeting o;
  for (int c = 0; c < 3; c++) o.way[c] = (to->position[c] - from->position[c]) / from->diameter;
  real x = o.along = -dot(o.way, j->ahead, 3), beside = dot(o.way, o.way, 3) - x * x, q = x / w->length;
  real width2 = x * x + w->width * w->width, falls = 1 + q * q * q * q;
  o.speed = o.slope = 0; /* to rounding, in double precision: */
  if (x < -20 * w->behind || w->spread * beside > 40 * width2) return o;
  real turn = TANH(x / w->behind);
  real plain = j->speed * EXP(-w->spread * beside / width2) / SQRT(SQRT(falls)) / 2;
  o.speed = plain * (1 + turn);
  o.slope = plain * (1 - turn * turn) / w->behind +
            o.speed * (2 * w->spread * x * (width2 + beside) / (width2 * width2) - q * q * q / (falls * w->length));
  return o;
}

/* Share of a jet that meets the hull, and its derivatives by the direction, in which it is constant along it. */
static real met_by_hull(const water *w, const outlet *p, const real *ahead, real *slope) {
  real at[3], course[3], size, facing, far;
  for (int c = 0; c < 3; c++) at[c] = (p->position[c] - w->center[c]) / w->half[c], course[c] = -ahead[c] / w->half[c];
  size = SQRT(dot(course, course, 3) + TINY), facing = -dot(at, course, 3) / size;
  far = dot(at, at, 3) - facing * facing;
  real rim = TANH((1 - far) / w->grazing), side = TANH(facing / w->grazing);
  real by = (2 * facing * (1 - rim * rim) * (1 + side) + (1 + rim) * (1 - side * side)) / (4 * w->grazing);
  for (int c = 0; c < 3; c++) slope[c] = by * (at[c] + facing * course[c] / size) / (size * w->half[c]);
  return (1 + rim) * (1 + side) / 4;
}

/* Adds the force that comes of the water u that meets an actuator, and its derivatives by force and water. */
static void add_taken(const water *w, const outlet *p, const jet *j, const real *force, const real *u, real *change,
                      real by_force[3][3], real by_water[3][3]) {
  const real *a = j->ahead, t = j->thrust;
  real against = -dot(u, a, 3), share = against / j->speed, root = SQRT(share * share + R(1e-4));
  real below = w->lag + w->most * root, lost = share / below, steep = (w->lag + w->most * R(1e-4) / root) / (below * below);
  real moved = w->side * j->moved, size = SQRT(dot(u, u, 3) + ROUNDING), across[3], met[3] = {0};
  real drag = PI / 8 * w->density * w->housing * p->diameter * p->diameter;
  if (w->half[0] > 0 && w->half[1] > 0 && w->half[2] > 0) lost += w->hull * met_by_hull(w, p, a, met);
  for (int b = 0; b < 3; b++) across[b] = u[b] + against * a[b];
  for (int b = 0; b < 3; b++) change[b] += moved * across[b] + drag * size * u[b] - lost * force[b];
  for (int c = 0; c < 3; c++)
    for (int b = 0; b < 3; b++) {
      real other = (b == c) - a[b] * a[c];
      real more = w->hull * met[c] / t - steep * (across[c] / (t * j->speed) + share * a[c] / (2 * t));
      by_water[c][b] += moved * other + drag * (size * (b == c) + u[b] * u[c] / size) + force[b] * steep * a[c] / j->speed;
      by_force[c][b] += moved / t * (a[c] * across[b] / 2 - across[c] * a[b] + against * other) - lost * (b == c) - force[b] * more;
    }
}

/* Adds what a speed v [m/s] of the place through the water takes. */
static void add_lost(const outlet *p, const jet *j, const real *force, const real *v, real *change, real by_force[3][3]) {
  const real *a = j->ahead;
  real along = dot(v, a, 3), pace = p->advance / j->speed, share = pace * along;
  for (int c = 0; c < 3; c++) {
    change[c] -= share * force[c], by_force[c][c] -= share;
    for (int b = 0; b < 3; b++) by_force[c][b] -= force[b] * (pace * (v[c] - a[c] * along) - share * a[c] / 2) / j->thrust;
  }
}

static void offset_of(const water *w, const real *force, const real *inflow, real *change, real *wrench, real *slope) {
  const outlet *p = (const outlet *)(w + 1);
  int n = (int)w->n;
  jet jets[FL_MOST];
  meeting meets[FL_MOST];
  memset(change, 0, (size_t)3 * (size_t)n * sizeof *change);
  memset(wrench, 0, 6 * sizeof *wrench);
  if (slope) memset(slope, 0, (size_t)18 * (size_t)n * sizeof *slope);
  for (int i = 0; i < n; i++) jets[i] = jet_of(w, p + i, force + 3 * i);
  for (int i = 0; i < n; i++, change += 3) {
    real u[3] = {0}, by_force[3][3] = {{0}}, by_water[3][3] = {{0}}, by[3][6] = {{0}};
    for (int j = 0; j < n; j++) {
      if (j == i || !(p[j].diameter > 0) || w->formula == 0) continue;
      meets[j] = meeting_of(w, p + j, jets + j, p + i);
      for (int c = 0; c < 3; c++) u[c] -= meets[j].speed * jets[j].ahead[c];
    }
    if (w->formula != 0) add_taken(w, p + i, jets + i, force + 3 * i, u, change, by_force, by_water);
    if (inflow) add_lost(p + i, jets + i, force + 3 * i, inflow + 3 * i, change, by_force);
    add_wrench(p[i].position, change, 1, wrench);
    if (!slope) continue;
    for (int c = 0; c < 3; c++) {
      add_wrench(p[i].position, by_force[c], 1, slope + 18 * i + 6 * c);
      add_wrench(p[i].position, by_water[c], 1, by[c]);
    }
    for (int j = 0; j < n; j++) {
      if (j == i || !(p[j].diameter > 0) || w->formula == 0 || meets[j].speed == 0) continue;
      const meeting *m = meets + j;
      const real *a = jets[j].ahead;
      for (int c = 0; c < 3; c++) {
        real turned = m->speed * a[c] / 2 + m->slope * (m->way[c] + a[c] * m->along), *row = slope + 18 * j + 6 * c;
        for (int k = 0; k < 6; k++)
          row[k] += (turned * (a[0] * by[0][k] + a[1] * by[1][k] + a[2] * by[2][k]) - m->speed * by[c][k]) / jets[j].thrust;
      }
    }
  }
}

/* What comes beside forces (count, n, 3) [N], body frame, where the places move at `inflow` (count, n, 3) [m/s], 0 at
   rest: forces (count, n, 3), their wrench (count, 6), and, where there is room, its derivatives (count, n, 3, 6). */
void fl_jets(const real *known, const real *force, int count, const real *inflow, real *change, real *wrench, real *slope) {
  int n = (int)((const water *)known)->n;
  for (int k = 0; k < count; k++)
    offset_of((const water *)known, force + 3 * n * k, inflow ? inflow + 3 * n * k : 0, change + 3 * n * k, wrench + 6 * k,
              slope ? slope + 18 * n * k : 0);
}
