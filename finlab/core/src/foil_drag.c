/* Commands of robots whose foils drag. A foil gives a lift and with it a drag, a curve; the dual takes what lies
   between the curve and its chord for it, too. Steps on the angles of the foils lead from its forces to commands that
   give a wrench by the curves. A step is the dual's answer where each curve is its tangent, curved as much as the cost
   less the worth of the force, whatever the sign (sequential quadratic programming); all other sets are whole.
   Levenberg-Marquardt steps make it exact, and it is kept where it is cheaper.

   Steps lead to what is near. With few actuators what foils give is a curved sheet, which turns back where they stall:
   a wrench on it is met at few commands, far from each other, and from elsewhere steps end at a least miss. Where the
   starts that the dual has come to no cost that it proves, others are taken from a lattice over the angles of all
   foils, each kept within the branches of the lifts on which it lies. */
#include "internal.h"

#define TRUST (R(3.0) / ROUNDS)      /* of its range that a foil turns in a step: all together may cross it thrice */
#define CHEAPER (R(0.1) * NEARLY) /* share of the cost below which a gain ends the steps */
#define NONE R(1e30)              /* cost where no commands give a wrench */

/* A foil at an angle: all of the tangent but its curvature. */
static void foil_at(const real *block, int i, real angle, fl_tangent *t) {
  const fl_actuator *a = ACTUATOR(block, i);
  real command[3] = {angle, 0, 0}, own[3], by[3][3];
  fl_force_of_command(block, i, command, own, by);
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
real fl_power_of_commands(const real *block, const fl_work *work, real command[][3], real force[][2]) {
  real cost = 0, own[3];
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    int plane = is_plane(a);
    force[i][0] = force[i][1] = 0;
    if (work->span.lost[i]) continue;
    fl_force_of_command(block, i, command[i], own, 0);
    force[i][0] = plane ? own[1] : a->sign * own[0], force[i][1] = plane ? own[2] : 0;
    real size = plane ? size_of(force[i]) : force[i][0];
    if (a->gauge > 0) size /= fl_gauge_radius(block + (int)a->gauge, ATAN2(own[2], own[1]));
    if (a->speed > 0) {
      fl_tangent t;
      foil_at(block, i, command[i][0], &t);
      force[i][1] = t.force[1], cost += t.cost;
    } else
      cost += fl_power_of_force(block, i, a->form == FL_POD && command[i][1] < 0 ? -size : size);
  }
  return cost;
}

/* Sets and limits of other actuators on the side of a gap on which their forces are. */
static void take_sides(const real *block, fl_work *work, fl_box *box, real command[][3], real force[][2]) {
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    fl_set *set = work->set + i;
    if (is_plane(a) ? set->forked || set->reverse > 0 : a->band > 0)
      fl_narrow_set(block, i, set, force[i], fl_nearer_side(block, i, set, force[i]));
    if (a->form != FL_THRUSTER || !(a->band > 0)) continue;
    box->low[i][0] = MAX(box->low[i][0], a->sign > 0 ? set->low : -set->high);
    box->high[i][0] = MIN(box->high[i][0], a->sign > 0 ? set->high : -set->low);
    command[i][0] = fl_clip_number(box, i, 0, -1, command[i][0]);
  }
}

/* Commands that a step of a size leads to from forces. */
static void stepped(const real *block, const fl_work *work, const fl_box *box, real force[][2], real size,
                    real command[][3]) {
  for (int i = 0; i < COUNT(block); i++) {
    const real *t = work->tangent[i].slope, *there = work->now->force[i];
    real way[2] = {size * (there[0] - force[i][0]), size * (there[1] - force[i][1])};
    real wanted[2] = {force[i][0] + way[0], force[i][1] + way[1]};
    if (work->span.lost[i]) continue;
    if (ACTUATOR(block, i)->speed > 0)
      command[i][0] = fl_clip_number(box, i, 0, -1, command[i][0] + dot(way, t, 2) / MAX(dot(t, t, 2), TINY));
    else
      fl_command_for_force(block, i, box, wanted, command[i], command[i]);
  }
}

/* Whether commands within a box are fewer than the directions in which the robot drives: what they give is a sheet,
   and that of the tables lies beside that of the laws, by FINE at most. A wrench on the one is then met by no commands
   of the other. */
static int are_few(const real *block, const fl_work *work, const fl_box *box) {
  int free = 0;
  for (int i = 0; i < COUNT(block); i++)
    for (int c = 0; c < 3; c++) free += !work->span.lost[i] && box->high[i][c] > box->low[i][c];
  return free < work->span.range;
}

/* Steps towards work->aim, of which so many in a row have to halve the miss: most starts end soon. */
static void approach(const real *block, fl_work *work, const fl_box *box, real command[][3], int steps) {
  real before, miss = NONE;
  for (int k = 0; k < 2 * ROUNDS; k += steps) {
    before = miss;
    miss = fl_refine_commands(block, work, box, work->aim, command, steps);
    if (miss <= EXACT || miss > before / 2) return;
  }
}

/* Whether so many Levenberg-Marquardt steps make commands within a box give work->aim, to a part of the yardstick and
   to rounding. Where that is what tables leave, steps on their miss end soon. */
static int come_to_give(const real *block, fl_work *work, const fl_box *box, real command[][3], int steps, real part) {
  real size = 0;
  for (int k = 0; k < 6; k++) size += FABS(work->aim[k]) / HEAD(block)->yard[k];
  if (part > EXACT) {
    approach(block, work, box, command, ROUNDS / 2);
    steps = 0;
  }
  return fl_refine_commands(block, work, box, work->aim, command, steps) <= part + ROUNDING * size;
}

/* How far off the yardstick commands may be that are said to give a wrench: what tables leave where these are few. */
static real allowed(const real *block, const fl_work *work, const fl_box *box) {
  return are_few(block, work, box) ? FINE : EXACT;
}

/* Makes commands give work->aim, in the basis `target`, to a part of the yardstick, and then cheaper; `price` becomes
   that of the last step. Their forces along the rows, and their cost [W]; NONE where they do not come to give it. */
static real settle(const real *block, fl_work *work, const real *target, real part, real *price, real command[][3],
                   real force[][2]) {
  fl_box box = work->box;
  fl_set before[FL_MOST];
  real size = 1, tried[FL_MOST][3], other[FL_MOST][2];
  memcpy(before, work->set, sizeof before);
  fl_power_of_commands(block, work, command, force);
  take_sides(block, work, &box, command, force);
  int met = come_to_give(block, work, &box, command, 2 * ROUNDS, part), moved = 1;
  real cost = met ? fl_power_of_commands(block, work, command, force) : NONE;
  for (int k = 0; met && k < ROUNDS; k++) {
    for (int i = 0; moved && i < COUNT(block); i++) {
      real own[2];
      own_price(work, i, price, own);
      if (ACTUATOR(block, i)->speed > 0 && !work->span.lost[i])
        draw_tangent(block, i, &box, command[i][0], own, work->tangent + i, work->set + i);
    }
    fl_prepare_sets(block, work);
    if (moved && fl_dual_newton(block, work, target, price, STEPS_AT_KINK) == FL_MET)
      memcpy(price, work->now->price, sizeof work->now->price);
    memcpy(tried, command, sizeof tried);
    stepped(block, work, &box, force, size, tried);
    int meets = come_to_give(block, work, &box, tried, 2 * ROUNDS, part);
    real gain = meets ? cost - fl_power_of_commands(block, work, tried, other) : -NONE;
    if ((moved = gain > 0)) {
      memcpy(command, tried, sizeof tried);
      memcpy(force, other, sizeof other);
      cost -= gain;
    } else
      size *= R(0.25);
    if (FABS(gain) <= CHEAPER * cost) break;
  }
  fl_restore_sets(block, work, before);
  return cost;
}

/* Remembers what commands and prices lead to, where it costs less than the best so far. */
static void place_from(const real *block, fl_work *work, const real *target, const real *price, real command[][3],
                       real *best) {
  real own[FL_MOST][2], near[6];
  memcpy(near, price, sizeof near);
  real cost = settle(block, work, target, allowed(block, work, &work->box), near, command, own);
  if (!(cost < *best)) return;
  *best = cost;
  memcpy(work->placed, command, sizeof work->placed);
  memcpy(work->best, own, sizeof own);
  memcpy(work->near, near, sizeof near);
}

/* The same of the forces and prices that Newton's method came to. */
void fl_improve_commands(const real *block, fl_work *work, const real *target, real *best) {
  real command[FL_MOST][3];
  fl_commands_for_forces(block, &work->box, work->now->force, work->previous, command);
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
  return a->speed > 0 && !work->span.lost[i] && FABS(*command - a->turned) > end_of(block, a)[1];
}

/* The dual's value at its prices, less what foils would be worth more there where they stall, which its sets leave out:
   no commands give the target for less, as near as so many angles tell. `most` is what none cost more than. */
static real proved_value(const real *block, const fl_work *work, real *most) {
  real value = work->now->value;
  *most = work->most_cost * (1 + CLOSE) + NOTHING;
  for (int i = 0; i < COUNT(block); i++)
    for (int end = 0; end < 2; end++) {
      const fl_actuator *a = ACTUATOR(block, i);
      real limit, own[2], more = 0;
      if (!may_stall(block, work, i, end, &limit)) continue;
      own_price(work, i, work->now->price, own);
      response known = fl_response(block, i, work->set + i, own);
      real last = end_of(block, a)[1];
      real begin = a->turned + (end ? last : -last);
      for (int k = 1; k <= ROUNDS; k++) {
        fl_tangent t;
        foil_at(block, i, begin + (limit - begin) * (real)k / ROUNDS, &t);
        real worth = dot(own, t.force, 2) - t.cost;
        more = MAX(more, worth - known.conjugate);
      }
      fl_tangent stalled;
      foil_at(block, i, limit, &stalled);
      value -= more;
      *most += stalled.cost;
    }
  return value;
}

/* A lattice over the angles of foils. Each has some on every branch of its lift within the limits: stalled one way,
   lift one way, lift the other way, stalled the other way. */
enum { BRANCHES = 4, LAID = 6 }; /* branches of a foil; foils on the lattice, others begin at rest */
#define LATTICE (1 << 2 * LAID)  /* points at most: one on each branch of so many foils */
#define EACH_MOST (ROUNDS / 2)   /* angles on a branch */
#define NODES (4 * ROUNDS)       /* angles of all foils at most: of 4 branches 24 of one foil, 16 of 3 foils, 8 of 4 */
#define SPREAD (5 * ROUNDS)      /* points at which steps on the commands begin */
#define FOLLOWED (ROUNDS / 2)    /* how many of these are made cheaper; FL_STARTS counts them */

typedef struct {
  int foils, foil[LAID];                            /* how many there are, and which actuators these are */
  int branches[LAID], first[LAID];                  /* of each: branches, and its first node */
  int each;                                         /* nodes on a branch */
  real edge[LAID][BRANCHES + 1];                    /* ends of the branches [rad] */
  real angle[NODES], cost[NODES], wrench[NODES][6]; /* of each node; the wrench in the basis */
  real row[FL_MOST][2][6];                          /* forces of all other actuators by a wrench in the basis */
} lattice;

typedef struct {
  unsigned char node[LAID]; /* of each foil */
  real cost;                /* [W], with the price of a miss */
} point;

/* Foils, their branches, and how many nodes each branch has. */
static void find_branches(const real *block, const fl_work *work, lattice *l) {
  int all = 1, together = 0;
  l->foils = 0;
  for (int i = 0; i < COUNT(block) && l->foils < LAID; i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    if (!(a->speed > 0) || work->span.lost[i]) continue;
    real low = work->box.low[i][0], high = work->box.high[i][0], last = end_of(block, a)[1];
    real turn[BRANCHES - 1] = {a->turned - last, a->turned, a->turned + last};
    real *edge = l->edge[l->foils];
    int branches = 0;
    edge[0] = low;
    for (int k = 0; k < BRANCHES - 1; k++)
      if (turn[k] > low && turn[k] < high) edge[++branches] = turn[k];
    edge[++branches] = high;
    l->branches[l->foils] = branches;
    l->foil[l->foils++] = i;
    all *= branches;
    together += branches;
  }
  for (l->each = EACH_MOST; l->each > 1; l->each--) {
    int points = all;
    for (int f = 0; f < l->foils; f++) points *= l->each;
    if (points <= LATTICE && together * l->each <= NODES) return;
  }
}

/* The nodes of all foils. */
static void lay_nodes(const real *block, const fl_work *work, lattice *l) {
  int node = 0;
  for (int f = 0; f < l->foils; f++) {
    const real(*matrix)[6] = work->span.matrix[l->foil[f]];
    l->first[f] = node;
    for (int k = 0; k < l->branches[f] * l->each; k++, node++) {
      const real *edge = l->edge[f] + k / l->each;
      real share = ((real)(k % l->each) + R(0.5)) / (real)l->each;
      fl_tangent t;
      l->angle[node] = edge[0] + share * (edge[1] - edge[0]);
      foil_at(block, l->foil[f], l->angle[node], &t);
      l->cost[node] = t.cost;
      for (int j = 0; j < 6; j++) l->wrench[node][j] = t.force[0] * matrix[0][j] + t.force[1] * matrix[1][j];
    }
  }
}

/* The other actuators by G^-1 of G = sum B g B', with their gains g: y = g B' G^-1 r are the forces for a wrench r that
   are cheapest where power is quadratic and nothing has limits. */
static void lay_rows(const real *block, const fl_work *work, lattice *l) {
  real gram[6][6] = {{0}}, trace = 0;
  memset(l->row, 0, sizeof l->row);
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    for (int q = 0; q < (int)a->rows && !(a->speed > 0); q++)
      for (int j = 0; j < 6; j++) {
        const real *row = work->span.matrix[i][q];
        const real own = a->gain[q] * row[j];
        for (int k = 0; k <= j; k++) gram[j][k] += own * row[k];
      }
  }
  for (int j = 0; j < 6; j++) trace += gram[j][j];
  for (int j = 0; j < 6; j++) gram[j][j] += MAX(NOTHING, ROUNDING) * trace + TINY;
  if (!fl_factor(gram)) return;
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    for (int q = 0; q < (int)a->rows && !(a->speed > 0); q++) {
      fl_solve(gram, work->span.matrix[i][q], l->row[i][q]);
      for (int j = 0; j < 6; j++) l->row[i][q][j] *= a->gain[q];
    }
  }
}

/* Forces of the other actuators at a point for a target, held within their limits, and what all cost there: watts as
   force^1.5, and ROUNDS times those of all actuators for a miss of one scaled wrench. */
static real cost_at_point(const real *block, const fl_work *work, const lattice *l, const real *target,
                          const unsigned char *node, real force[][2]) {
  real left[6], miss[6], cost = 0;
  memcpy(left, target, sizeof left);
  for (int f = 0; f < l->foils; f++) {
    cost += l->cost[node[f]];
    for (int j = 0; j < 6; j++) left[j] -= l->wrench[node[f]][j];
  }
  memcpy(miss, left, sizeof miss);
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    const fl_set *set = work->set + i;
    real *own = force[i], size;
    own[0] = own[1] = 0;
    if (a->speed > 0) continue;
    for (int q = 0; q < (int)a->rows; q++) own[q] = dot(l->row[i][q], left, 6);
    if (is_plane(a)) {
      real most = MAX(set->high, set->reverse), wanted = size_of(own);
      size = MIN(wanted, most);
      for (int q = 0; q < 2; q++) own[q] *= size / MAX(wanted, TINY);
    } else {
      own[0] = CLIP(own[0], set->low, set->high);
      size = FABS(own[0]);
    }
    real share = size / a->most[0];
    cost += MAX(set->high_cost, set->low_cost) * share * SQRT(share);
    for (int q = 0; q < (int)a->rows; q++)
      for (int j = 0; j < 6; j++) miss[j] -= own[q] * work->span.matrix[i][q][j];
  }
  return cost + ROUNDS * work->most_cost * SQRT(dot(miss, miss, 6));
}

/* Puts a point among the `count` cheapest ones (SPREAD,), which are in order; how many there are then. */
static int put_in_order(point *points, int count, const point *own) {
  int at = MIN(count, SPREAD - 1);
  if (count == SPREAD && !(own->cost < points[at].cost)) return count;
  for (; at > 0 && own->cost < points[at - 1].cost; at--) points[at] = points[at - 1];
  points[at] = *own;
  return MIN(count + 1, SPREAD);
}

/* The cheapest point of each choice of branches, and of these the cheapest ones (SPREAD,); how many there are. */
static int cheapest_points(const real *block, const fl_work *work, const lattice *l, const real *target,
                           point *points) {
  int choices = 1, within = 1, count = 0;
  real force[FL_MOST][2];
  for (int f = 0; f < l->foils; f++) {
    choices *= l->branches[f];
    within *= l->each;
  }
  for (int choice = 0; choice < choices; choice++) {
    point best = {{0}, NONE}, own = {{0}, 0};
    for (int k = 0; k < within; k++) {
      int branches = choice, places = k;
      for (int f = 0; f < l->foils; f++) {
        int branch = branches % l->branches[f], place = places % l->each;
        own.node[f] = (unsigned char)(l->first[f] + branch * l->each + place);
        branches /= l->branches[f];
        places /= l->each;
      }
      own.cost = cost_at_point(block, work, l, target, own.node, force);
      if (k == 0 || own.cost < best.cost) best = own;
    }
    count = put_in_order(points, count, &best);
  }
  return count;
}

/* Commands at a point, after steps towards work->aim: first some that leave the foils on their branches. */
static void begin_at(const real *block, fl_work *work, const lattice *l, const real *target, const point *own,
                     real command[][3]) {
  real force[FL_MOST][2];
  fl_box box = work->box;
  cost_at_point(block, work, l, target, own->node, force);
  fl_commands_for_forces(block, &work->box, force, work->previous, command);
  for (int f = 0; f < l->foils; f++) {
    int node = own->node[f], i = l->foil[f], branch = (node - l->first[f]) / l->each;
    command[i][0] = l->angle[node];
    box.low[i][0] = l->edge[f][branch];
    box.high[i][0] = l->edge[f][branch + 1];
  }
  approach(block, work, &box, command, ROUNDS / 2);
  approach(block, work, &work->box, command, ROUNDS / 2);
}

/* Places what steps from a lattice come to: first exact commands from many points, then the cheapest of these are made
   cheaper, but for those that cost half as much again as the best so far. */
static void place_spread(const real *block, fl_work *work, const real *target, const real *price, real enough,
                         real *best) {
  lattice l;
  point points[SPREAD];
  real command[FL_MOST][3], force[FL_MOST][2], part = allowed(block, work, &work->box), last = 0;
  find_branches(block, work, &l);
  lay_nodes(block, work, &l);
  lay_rows(block, work, &l);
  int count = cheapest_points(block, work, &l, target, points);
  for (int k = 0; k < count; k++) {
    begin_at(block, work, &l, target, points + k, command);
    int met = come_to_give(block, work, &work->box, command, 0, part);
    points[k].cost = met ? fl_power_of_commands(block, work, command, force) : NONE;
  }
  for (int tried = 0; tried < FOLLOWED && *best > enough; tried++) {
    const point *next = 0;
    for (int k = 0; k < count; k++) { /* commands that cost the same are the same */
      int is_new = points[k].cost > last * (1 + NEARLY);
      if (is_new && (!next || points[k].cost < next->cost)) next = points + k;
    }
    if (!next || !(next->cost < MIN(*best * R(1.5), NONE))) return;
    last = next->cost;
    begin_at(block, work, &l, target, next, command);
    place_from(block, work, target, price, command, best);
  }
}

/* The same of several starts, as steps from a cheap one may end early: each has its own valley. */
void fl_improve_from_starts(const real *block, fl_work *work, const real *target, real *best) {
  real start[FL_MOST][3], command[FL_MOST][3], price[6], angle, ridge, most;
  real proved = proved_value(block, work, &most), enough = proved * (1 + CLOSE);
  memcpy(price, work->now->price, sizeof price);
  fl_commands_for_forces(block, &work->box, work->now->force, work->previous, start);
  fl_improve_commands(block, work, target, best);
  if (*best <= enough) return;
  for (int i = 0; i < COUNT(block); i++)
    for (int end = 0; end < 2; end++) {
      if (!may_stall(block, work, i, end, &angle)) continue;
      memcpy(command, *best < NONE ? work->placed : start, sizeof command);
      command[i][0] = angle;
      place_from(block, work, target, price, command, best);
    }
  if (*best <= enough) return;
  fl_first_lambda(block, work, target, price, &ridge);
  fl_dual_start(block, work, target, price);
  fl_improve_commands(block, work, target, best);
  if (*best > enough && proved <= most) place_spread(block, work, target, price, enough, best);
}

/* Commands for forces that the dual is sure of: no foil drags more than its lift does, and none is in doubt. */
int fl_are_forces_sure(const real *block, fl_work *work) {
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    if (a->doubt > 0) return 0;
    if (a->speed > 0 && FABS(work->now->force[i][0]) >= a->pressure * (1 - NOTHING) * end_of(block, a)[0]) return 0;
  }
  if (fl_worst_gap(block, work, work->now->force, work->now->price) >= 0) return 0;
  memcpy(work->best, work->now->force, sizeof work->best);
  fl_commands_for_forces(block, &work->box, work->best, work->previous, work->placed);
  return come_to_give(block, work, &work->box, work->placed, ROUNDS, allowed(block, work, &work->box));
}

/* Commands that give the largest share of a wrench that steps come to, between that which commands are `found` for, 0
   without any, and the `most` that the dual allows. `out` has forces near to it. */
void fl_largest_ray_share(const real *block, fl_work *work, const real *wrench, real found, real most, fl_answer *out) {
  real part[6], target[6], inner[6], own[FL_MOST][2], start[FL_MOST][3], command[FL_MOST][3], less = NEARLY, all = most;
  for (int i = 0; i < 2 * COUNT(block); i++) /* a stalled foil gives more than its table */
    if (may_stall(block, work, i / 2, i % 2, part)) most = MIN(all * (1 + R(0.1)), 1);
  fl_commands_for_forces(block, &work->box, out->force, work->previous, start);
  for (int k = 0; k < 2 * ROUNDS && less < 1 && most - found > NEARLY / 4 * all; k++) {
    real share = found > 0 ? (found + most) / 2 : all * (1 - less);
    int met = 0;
    for (int j = 0; j < 6; j++) work->aim[j] = share * (wrench[j] + work->span.beside[j]), part[j] = work->aim[j] - work->span.beside[j];
    fl_reduce_wrench(work, part, target);
    for (int way = found > 0 ? 0 : 1; way < 2 && !met; way++) {
      memcpy(command, way ? start : out->command, sizeof command);
      memcpy(inner, out->inner, sizeof inner);
      met = settle(block, work, target, EXACT, inner, command, own) < NONE;
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
