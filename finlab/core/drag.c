/* Commands of robots whose foils drag. A foil gives a lift and with it a drag, a curve; the dual takes what lies
   between the curve and its chord for it, too. Steps on the angles of the foils lead from its forces to commands that
   give a wrench by the curves. A step is the dual's answer where each curve is its tangent, curved as much as the cost
   less the worth of the force, whatever the sign (sequential quadratic programming); all other sets are whole.
   Levenberg-Marquardt steps make it exact, and it is kept where it is cheaper. */
#include "inner.h"

#define TRUST (R(3.0) / ROUNDS)      /* of its range that a foil turns in a step: all together may cross it thrice */
#define CHEAPER (R(0.1) * NEARLY) /* share of the cost below which a gain ends the steps */
#define NONE R(1e30)              /* cost where no commands give a wrench */

/* A foil at an angle: all of the tangent but its curvature. */
static void foil_at(const real *block, int i, real angle, fl_tangent *t) {
  const fl_actuator *a = ACTUATOR(block, i);
  real command[3] = {angle, 0, 0}, own[3], by[3][3];
  force_of(block, i, command, own, by);
  real all = own[1] + a->pressure * a->rest;
  memcpy(t->force, own, sizeof t->force);
  memcpy(t->slope, by[0], sizeof t->slope);
  t->cost = a->speed * all + a->doubt * (own[0] * own[0] + all * all);
  t->pay = a->speed * by[0][1] + 2 * a->doubt * (own[0] * by[0][0] + all * by[0][1]);
}

/* Its tangent at prices of lift and drag, as the set of a step. */
static void draw_tangent(const real *block, int i, const fl_box *box, real angle, const real *price, fl_tangent *t,
                         fl_set *set) {
  const fl_actuator *a = ACTUATOR(block, i);
  real low = box->low[i][0], high = box->high[i][0], most = TRUST * (high - low), apart = CLOSE * (high - low) + TINY;
  fl_tangent other;
  foil_at(block, i, angle + apart, &other);
  foil_at(block, i, angle, t);
  real bend = other.pay - t->pay - dot(price, other.slope, 2) + dot(price, t->slope, 2);
  t->bend = MAX(FABS(bend) / apart, CLOSE * a->speed * a->pressure + TINY);
  set->low = MAX(low - angle, -most), set->high = MIN(high - angle, most), set->tangent = t;
  set->low_cost = set->high_cost = t->cost + FABS(t->pay) * most + t->bend * most * most;
}

/* Forces along the rows of commands, and their cost [W]. */
real cost_of(const real *block, const fl_work *work, real command[][3], real force[][2]) {
  real cost = 0, own[3];
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    int plane = is_plane(a);
    force[i][0] = force[i][1] = 0;
    if (work->span.lost[i]) continue;
    force_of(block, i, command[i], own, 0);
    force[i][0] = plane ? own[1] : a->sign * own[0], force[i][1] = plane ? own[2] : 0;
    real size = plane ? size_of(force[i]) : force[i][0];
    if (a->gauge > 0) size /= gauge_at(block + (int)a->gauge, ATAN2(own[2], own[1]));
    if (a->speed > 0) {
      fl_tangent t;
      foil_at(block, i, command[i][0], &t);
      force[i][1] = t.force[1], cost += t.cost;
    } else
      cost += cost_at(block, i, a->form == FL_POD && command[i][1] < 0 ? -size : size);
  }
  return cost;
}

/* Sets and limits of other actuators on the side of a gap on which their forces are. */
static void take_sides(const real *block, fl_work *work, fl_box *box, real command[][3], real force[][2]) {
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    fl_set *set = work->set + i;
    if (is_plane(a) ? set->forked || set->reverse > 0 : a->band > 0)
      narrow(block, i, set, force[i], nearer_side(block, i, set, force[i]));
    if (a->form != FL_THRUSTER || !(a->band > 0)) continue;
    box->low[i][0] = MAX(box->low[i][0], a->sign > 0 ? set->low : -set->high);
    box->high[i][0] = MIN(box->high[i][0], a->sign > 0 ? set->high : -set->low);
    command[i][0] = held_in(box, i, 0, -1, command[i][0]);
  }
}

/* Commands that a step of a size leads to from forces. */
static void stepped(const real *block, const fl_work *work, const fl_box *box, real force[][2], real size,
                    real command[][3]) {
  for (int i = 0; i < COUNT(block); i++) {
    const real *t = work->tangent[i].slope, *there = work->now->force[i];
    real way[2] = {size * (there[0] - force[i][0]), size * (there[1] - force[i][1])};
    real wanted[2] = {force[i][0] + way[0], force[i][1] + way[1]};
    if (ACTUATOR(block, i)->speed > 0)
      command[i][0] = held_in(box, i, 0, -1, command[i][0] + dot(way, t, 2) / MAX(dot(t, t, 2), TINY));
    else
      command_for(block, i, box, wanted, command[i], command[i]);
  }
}

/* Whether Levenberg-Marquardt steps make commands within a box give work->aim, to rounding. */
static int come_to_give(const real *block, fl_work *work, const fl_box *box, real command[][3], int steps) {
  real size = 0;
  for (int k = 0; k < 6; k++) size += FABS(work->aim[k]) / HEAD(block)->yard[k];
  return refine(block, work, box, work->aim, command, steps) <= EXACT + ROUNDING * size;
}

/* Makes commands give work->aim, in the basis `target`, and then cheaper; `price` becomes that of the last step. Their
   forces along the rows, and their cost [W]; NONE where they do not come to give it. */
static real settle(const real *block, fl_work *work, const real *target, real *price, real command[][3],
                   real force[][2]) {
  fl_box box = work->box;
  fl_set before[FL_MOST];
  real size = 1, tried[FL_MOST][3], other[FL_MOST][2];
  memcpy(before, work->set, sizeof before);
  cost_of(block, work, command, force);
  take_sides(block, work, &box, command, force);
  int met = come_to_give(block, work, &box, command, 2 * ROUNDS), moved = 1;
  real cost = met ? cost_of(block, work, command, force) : NONE;
  for (int k = 0; met && k < ROUNDS; k++) {
    for (int i = 0; moved && i < COUNT(block); i++) {
      real own[2];
      own_price(work, i, price, own);
      if (ACTUATOR(block, i)->speed > 0)
        draw_tangent(block, i, &box, command[i][0], own, work->tangent + i, work->set + i);
    }
    sums_of(block, work);
    if (moved && newton(block, work, target, price, STEPS_AT_KINK) == FL_MET)
      memcpy(price, work->now->price, sizeof work->now->price);
    memcpy(tried, command, sizeof tried);
    stepped(block, work, &box, force, size, tried);
    real gain = come_to_give(block, work, &box, tried, 2 * ROUNDS) ? cost - cost_of(block, work, tried, other) : -NONE;
    if ((moved = gain > 0)) {
      memcpy(command, tried, sizeof tried);
      memcpy(force, other, sizeof other);
      cost -= gain;
    } else
      size *= R(0.25);
    if (FABS(gain) <= CHEAPER * cost) break;
  }
  take_sets(block, work, before);
  return cost;
}

/* Remembers what commands and prices lead to, where it costs less than the best so far. */
static void place_from(const real *block, fl_work *work, const real *target, const real *price, real command[][3],
                       real *best) {
  real own[FL_MOST][2], near[6];
  memcpy(near, price, sizeof near);
  real cost = settle(block, work, target, near, command, own);
  if (!(cost < *best)) return;
  *best = cost;
  memcpy(work->placed, command, sizeof work->placed);
  memcpy(work->best, own, sizeof own);
  memcpy(work->near, near, sizeof near);
}

/* The same of the forces and prices that Newton's method came to. */
void place(const real *block, fl_work *work, const real *target, real *best) {
  real command[FL_MOST][3];
  commands_for(block, &work->box, work->now->force, work->previous, command);
  place_from(block, work, target, work->now->price, command, best);
}

/* The last lift coefficient of a foil's table and its angle [rad]: beyond, it stalls and drags more. */
static const real *end_of(const real *block, const fl_actuator *a) {
  const real *curve = block + (int)a->beat;
  return curve + 2 * (int)curve[0] - 1;
}

/* Whether a foil may stall at one end (0, 1) of its angles, which is then the command. */
static int may_stall(const real *block, const fl_work *work, int i, int end, real *command) {
  const fl_actuator *a = ACTUATOR(block, i);
  *command = (end ? work->box.high : work->box.low)[i][0];
  return a->speed > 0 && FABS(*command - a->turned) > end_of(block, a)[1];
}

/* The same of several starts, as steps from a cheap one may end early: each has its own valley. */
void place_starts(const real *block, fl_work *work, const real *target, real *best) {
  real start[FL_MOST][3], command[FL_MOST][3], price[6], angle, ridge, enough = work->now->value * (1 + CLOSE);
  memcpy(price, work->now->price, sizeof price);
  commands_for(block, &work->box, work->now->force, work->previous, start);
  place(block, work, target, best);
  if (*best <= enough) return;
  for (int i = 0; i < COUNT(block); i++)
    for (int end = 0; end < 2; end++) {
      if (!may_stall(block, work, i, end, &angle)) continue;
      memcpy(command, *best < NONE ? work->placed : start, sizeof command);
      command[i][0] = angle;
      place_from(block, work, target, price, command, best);
    }
  if (*best <= enough) return;
  first_price(block, work, target, price, &ridge);
  stand_at(block, work, target, price);
  place(block, work, target, best);
}

/* Commands for forces that the dual is sure of: no foil drags more than its lift does, and none is in doubt. */
static int are_sure(const real *block, fl_work *work) {
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    if (a->doubt > 0) return 0;
    if (a->speed > 0 && FABS(work->now->force[i][0]) >= a->pressure * (1 - NOTHING) * end_of(block, a)[0]) return 0;
  }
  if (worst_gap(block, work, work->now->force, work->now->price) >= 0) return 0;
  memcpy(work->best, work->now->force, sizeof work->best);
  commands_for(block, &work->box, work->best, work->previous, work->placed);
  return come_to_give(block, work, &work->box, work->placed, ROUNDS);
}

/* Commands that give work->aim, from what Newton's method came to; 0 where none are found. */
int with_drag(const real *block, fl_work *work, const real *target, int status, fl_answer *out) {
  real value = work->now->value, bound;
  memcpy(out->inner, work->now->price, sizeof out->inner);
  if (!(status == FL_MET && are_sure(block, work))) {
    if (!least_power(block, work, target, status, &bound)) return 0;
    if (status != FL_MET) { /* prices at the commands may prove more */
      stand_at(block, work, target, work->near);
      if (work->state->value > value) memcpy(out->inner, work->near, sizeof out->inner);
    }
  }
  memcpy(out->command, work->placed, COUNT(block) * sizeof out->command[0]);
  return out->placed = 1;
}

/* Commands that give the largest share of a wrench that steps come to, between that which commands are `found` for, 0
   without any, and the `most` that the dual allows. `out` has forces near to it. */
void on_ray(const real *block, fl_work *work, const real *wrench, real found, real most, fl_answer *out) {
  real part[6], target[6], inner[6], own[FL_MOST][2], start[FL_MOST][3], command[FL_MOST][3], less = NEARLY, all = most;
  for (int i = 0; i < 2 * COUNT(block); i++) /* a stalled foil gives more than its table */
    if (may_stall(block, work, i / 2, i % 2, part)) most = MIN(all * (1 + R(0.1)), 1);
  commands_for(block, &work->box, out->force, work->previous, start);
  for (int k = 0; k < 2 * ROUNDS && less < 1 && most - found > NEARLY / 4 * all; k++) {
    real share = found > 0 ? (found + most) / 2 : all * (1 - less);
    int met = 0;
    for (int j = 0; j < 6; j++) work->aim[j] = share * (wrench[j] + work->span.beside[j]), part[j] = work->aim[j] - work->span.beside[j];
    to_basis(work, part, target);
    for (int way = found > 0 ? 0 : 1; way < 2 && !met; way++) {
      memcpy(command, way ? start : out->command, sizeof command);
      memcpy(inner, out->inner, sizeof inner);
      met = settle(block, work, target, inner, command, own) < NONE;
    }
    if (!met)
      most = share, less *= found > 0 ? 1 : 10;
    else {
      found = share, out->placed = 1;
      memcpy(out->command, command, sizeof command);
      memcpy(out->inner, inner, sizeof inner);
      memcpy(out->aim, part, sizeof part);
    }
  }
}
