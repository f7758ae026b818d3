/* What jets take from forces by a formula of eight constants, and what speed takes;
   docs/theory/interaction.md has both. */
#include "interaction_lanes.h"
#define LANES 1
#include "lanes_vector.h"
#include "lanes_math.h"
#include "jet_formulas.h"

#define NO_AREA R(1e-12) /* [m^2] beside the disc of an actuator, which may have none */

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

/* How fast the jet of an actuator is at another one. Returns whether there is anything of it. */
int fl_jet_meets(const water *w, const outlet *from, const jet *j, const outlet *to, jet_met *met) {
  real *way = met->from_outlet;
  for (int c = 0; c < 3; c++) way[c] = (to->position[c] - from->position[c]) * j->per_diameter;
  const real x = -dot(way, j->ahead, 3);
  if (is_nothing_of_jet(w, x, dot(way, way, 3) - x * x)) return 0;
  const jet_point point = point_of(w->behind, way, j->ahead);
  real by_along;
  met->speed = j->speed * rate_of_jet(w, &point, &by_along);
  met->along = x;
  met->slope = j->speed * by_along;
  return 1;
}

/* Share of a jet that meets the hull, and its derivatives by the direction. */
real fl_share_on_hull(const water *w, const outlet *from, const real *ahead, real *slope) {
  return share_on_hull(w, from->position, ahead, slope);
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

void fl_jets(const real *constants, const real *force, int count, const real *inflow, real *change,
             real *offset, real *slope) {
  const water *w = (const water *)constants;
  const outlet *outlets = outlets_of(w);
  const int n = (int)w->n;
  const interaction_model model = {.formulas = 1, .formula = {w}, .weight = {1}, .profiles = 1};
  interaction_effect effect;
  for (int k = 0; k < count; k++) {
    fl_begin_effect(n, slope, &effect);
    for (int i = 0; i < n && inflow; i++) {
      const jet own = fl_jet_of(w, outlets + i, force + 3 * i);
      add_lost(outlets + i, &own, force + 3 * i, inflow + 3 * i, effect.change[i],
               effect.by_own[i]);
    }
    fl_add_model(&model, force, &effect);
    fl_finish_effect(w, &effect, change, offset);
    force += 3 * n;
    change += 3 * n;
    offset += 6;
    if (inflow) inflow += 3 * n;
    if (slope) slope += 18 * n;
  }
}
