/* Commands of robots whose foils drag. A foil gives a lift and with it a drag, a curve; the
   dual takes what lies between the curve and its chord for it, too. Steps on the angles of
   the foils (foil_steps.c) lead from its forces to commands that give a wrench by the curves.

   Steps lead to what is near. Where the dual leaves foils between their ends, as their drag is
   welcome, steps begin at the vertices of these lifts (foil_vertices.c). With few actuators what
   foils give is a curved sheet, which turns back where they stall: a wrench on it is met at few
   commands, far from each other, and from elsewhere steps end at a least miss. Where the starts
   that the dual has come to no cost that it proves, others are taken from a lattice over the angles
   of all foils (foil_lattice.c), each kept within the branches of the lifts on which it lies, but
   for branches that the dual proves to be dearer (foil_choices.c). */
#include "internal.h"

#define SURE_STEPS 12    /* steps on commands from forces that the dual is sure of */
#define STALL_SAMPLES 12 /* angles of a stalled foil that are looked at for its worth */
/* commands that cost more than this times the best are left alone */
#define WITHIN_BEST R(1.5)

/* Remembers what commands and multipliers lead to, where it costs less than the best so far. */
void fl_improve_from(const real *block, fl_work *work, const real *target_reduced,
                     const real *lambda, real command[][3], real *best_cost) {
  const real most_error = fl_error_allowed(block, work, &work->box);
  real force[FL_MOST][2];
  real lambda_near[6];
  memcpy(lambda_near, lambda, sizeof lambda_near);
  const real cost =
      fl_meet_and_cheapen(block, work, target_reduced, most_error, lambda_near, command, force);
  if (!(cost < *best_cost)) return;
  *best_cost = cost;
  copy_commands(block, command, work->best_command);
  copy_forces(block, force, work->best_force);
  memcpy(work->best_lambda, lambda_near, sizeof lambda_near);
}

/* The same of the forces and multipliers that Newton's method came to. Steps on the commands run
   that method on tangents: work->state_found is of the last of them afterwards. */
void fl_improve_commands(const real *block, fl_work *work, const real *target_reduced,
                         real *best_cost) {
  real command[FL_MOST][3];
  fl_commands_for_forces(block, &work->box, work->state_found->force, work->command_previous,
                         command);
  fl_improve_from(block, work, target_reduced, work->state_found->lambda_reduced, command,
                  best_cost);
}

/* Whether a foil may stall at one end (0, 1) of its angles, which is then the command. */
static int may_stall(const real *block, const fl_work *work, int i, int end, real *command) {
  const fl_actuator *a = ACTUATOR(block, i);
  *command = work->box.command_min[i][0];
  if (end) *command = work->box.command_max[i][0];
  if (!is_foil(a) || work->span.is_lost[i]) return 0;
  const real stall_angle = fl_lift_end(block, a)[1];
  return FABS(*command - a->zero_lift_angle) > stall_angle;
}

/* Whether some foil may stall within its limits: it then gives more than its table. */
int fl_may_any_stall(const real *block, const fl_work *work) {
  real unused;
  for (int i = 0; i < COUNT(block); i++) {
    if (may_stall(block, work, i, 0, &unused) || may_stall(block, work, i, 1, &unused)) return 1;
  }
  return 0;
}

/* How much more than its conjugate in the dual a foil is worth, at the multipliers so far,
   where it stalls on the way to a limit of its angle, as near as so many angles tell; at
   least 0 [W]. */
static real worth_of_stall(const real *block, const fl_work *work, int i, int end, real limit) {
  const fl_actuator *a = ACTUATOR(block, i);
  real s[2];
  actuator_price(work, i, work->state_found->lambda_reduced, s);
  const response known = fl_response(block, i, work->set + i, s);
  real stall_angle = fl_lift_end(block, a)[1];
  if (!end) stall_angle = -stall_angle;
  const real begin = a->zero_lift_angle + stall_angle;
  real more = 0;
  for (int k = 1; k <= STALL_SAMPLES; k++) {
    fl_tangent tangent;
    fl_foil_at(block, i, begin + (limit - begin) * (real)k / STALL_SAMPLES, &tangent);
    const real conjugate = dot(s, tangent.force, 2) - tangent.cost;
    more = larger(more, conjugate - known.conjugate);
  }
  return more;
}

/* The dual value at its multipliers, less what foils would be worth more there where they
   stall, which its sets leave out: no commands give the target for less. `most_cost` is what
   none cost more than. */
static real proved_value(const real *block, const fl_work *work, real *most_cost) {
  real value = work->state_found->dual_value;
  *most_cost = work->power_cost_max * (1 + CLOSE) + NOTHING;
  for (int i = 0; i < COUNT(block); i++) {
    for (int end = 0; end < 2; end++) {
      real limit;
      if (!may_stall(block, work, i, end, &limit)) continue;
      value -= worth_of_stall(block, work, i, end, limit);
      fl_tangent stalled;
      fl_foil_at(block, i, limit, &stalled);
      *most_cost += stalled.cost;
    }
  }
  return value;
}

/* Commands at a point, after steps towards work->wrench_wanted: first some that leave the foils on
   their branches. */
static void begin_at(const real *block, fl_work *work, const foil_lattice *lattice,
                     const real *target_reduced, const lattice_point *point, real command[][3]) {
  fl_box branches = work->box;
  fl_commands_of_point(block, work, lattice, target_reduced, point, &branches, command);
  fl_approach(block, work, &branches, command);
  fl_approach(block, work, &work->box, command);
}

/* The cheapest point that costs more than the last one followed: commands that cost the same
   are the same; 0 for none. */
static const lattice_point *next_point(const lattice_point *points, int count, real last_cost) {
  const lattice_point *next = 0;
  for (int k = 0; k < count; k++) {
    const int is_new = points[k].cost > last_cost * (1 + NEARLY);
    if (is_new && (!next || points[k].cost < next->cost)) next = points + k;
  }
  return next;
}

/* Finds which choices of branches may be cheaper than the best commands, at the multipliers of
   work->state_found; but for their own where vertices have `spread` the lifts of foils (n,). */
static void find_choices(const real *block, fl_work *work, const foil_lattice *lattice,
                         const unsigned char *is_spread, real best_cost, foil_choices *choices) {
  int is_any_spread = 0;
  for (int i = 0; i < COUNT(block); i++) is_any_spread |= is_spread[i];
  fl_find_choices(block, work, lattice, best_cost * (1 - NOTHING), choices);
  if (is_any_spread) fl_leave_out_choice(lattice, work->best_command, is_spread, choices);
}

/* Improves on the best commands by what steps from a lattice come to: first exact commands
   from many points, then the cheapest of these are made cheaper, but for those that cost
   half as much again as the best so far. `lambda` are the multipliers of work->state_found. */
static void improve_from_lattice(const real *block, fl_work *work, const real *target_reduced,
                                 const real *lambda, real enough, const unsigned char *is_spread,
                                 real *best_cost) {
  const real most_error = fl_error_allowed(block, work, &work->box);
  /* Foils that stall may lead steps to other branches. */
  const int has_bounds = *best_cost < INFEASIBLE_COST && !fl_may_any_stall(block, work);
  foil_lattice lattice;
  foil_choices choices;
  lattice_point points[FL_LATTICE_STARTS];
  real command[FL_MOST][3];
  fl_lay_lattice(block, work, &lattice);
  const foil_choices *choices_left = 0; /* all */
  if (has_bounds) {
    find_choices(block, work, &lattice, is_spread, *best_cost, &choices);
    choices_left = &choices;
  }
  const int count = fl_cheapest_points(block, work, &lattice, target_reduced, choices_left, points);
  for (int k = 0; k < count; k++) {
    real unused[FL_MOST][2];
    points[k].cost = INFEASIBLE_COST;
    if (has_bounds && fl_is_proved_dearer(block, work, &lattice, target_reduced, lambda, *best_cost,
                                          points + k)) {
      continue;
    }
    begin_at(block, work, &lattice, target_reduced, points + k, command);
    if (fl_come_to_give(block, work, &work->box, command, 0, most_error)) {
      points[k].cost = fl_power_of_commands(block, work, command, unused);
    }
  }
  real last_cost = 0;
  for (int tried = 0; tried < FL_LATTICE_FOLLOWED && *best_cost > enough; tried++) {
    const lattice_point *next = next_point(points, count, last_cost);
    if (!next || !(next->cost < smaller(*best_cost * WITHIN_BEST, INFEASIBLE_COST))) return;
    last_cost = next->cost;
    begin_at(block, work, &lattice, target_reduced, next, command);
    fl_improve_from(block, work, target_reduced, lambda, command, best_cost);
  }
}

/* Improves on the best commands from those with one foil at a limit where it stalls. */
static void improve_from_stalls(const real *block, fl_work *work, const real *target_reduced,
                                const real *lambda, real start[][3], real *best_cost) {
  real command[FL_MOST][3];
  for (int i = 0; i < COUNT(block); i++) {
    for (int end = 0; end < 2; end++) {
      real angle;
      if (!may_stall(block, work, i, end, &angle)) continue;
      if (*best_cost < INFEASIBLE_COST)
        copy_commands(block, work->best_command, command);
      else
        copy_commands(block, start, command);
      command[i][0] = angle;
      fl_improve_from(block, work, target_reduced, lambda, command, best_cost);
    }
  }
}

/* Improves on the best commands from the vertices of the lifts that work->state_found leaves
   between their ends; marks the foils (n,) whose lifts these spread. */
static void improve_from_vertices(const real *block, fl_work *work, const real *target_reduced,
                                  unsigned char *is_spread, real *best_cost) {
  foil_vertices vertices;
  real lambda[6];
  real found[FL_MOST][2];
  fl_find_vertices(block, work, &vertices);
  memcpy(lambda, work->state_found->lambda_reduced, sizeof lambda);
  copy_forces(block, work->state_found->force, found);
  for (int vertex = 0; vertex < vertices.count; vertex++) {
    real force[FL_MOST][2];
    real command[FL_MOST][3];
    unsigned char is_held[VERTEX_FOILS];
    fl_box box = work->box;
    copy_forces(block, found, force);
    fl_go_to_vertex(work, &vertices, vertex, is_held, force);
    fl_commands_for_forces(block, &work->box, force, work->command_previous, command);
    for (int f = 0; f < vertices.foils; f++) {
      const int i = vertices.foil[f];
      if (!is_held[f]) continue;
      box.command_min[i][0] = command[i][0];
      box.command_max[i][0] = command[i][0];
    }
    fl_approach(block, work, &box, command);
    fl_improve_from(block, work, target_reduced, lambda, command, best_cost);
  }
  memset(is_spread, 0, (size_t)COUNT(block));
  for (int f = 0; f < vertices.foils && vertices.directions > 0; f++) {
    is_spread[vertices.foil[f]] = 1;
  }
}

/* Whether a foil that works is not among marked ones (n,). */
static int any_other_foil(const real *block, const fl_work *work, const unsigned char *is_marked) {
  for (int i = 0; i < COUNT(block); i++) {
    if (is_foil(ACTUATOR(block, i)) && !work->span.is_lost[i] && !is_marked[i]) return 1;
  }
  return 0;
}

/* The same as fl_improve_commands of several starts, as steps from a cheap one may end
   early: each has its own valley. work->state_found is of the last steps, too. */
void fl_improve_from_starts(const real *block, fl_work *work, const real *target_reduced,
                            real *best_cost) {
  real most_cost;
  const real proved = proved_value(block, work, &most_cost);
  const real enough = proved * (1 + CLOSE);
  const int stalls = fl_may_any_stall(block, work);
  unsigned char is_spread[FL_MOST];
  real start[FL_MOST][3];
  real lambda[6];
  memcpy(lambda, work->state_found->lambda_reduced, sizeof lambda);
  if (stalls) {
    fl_commands_for_forces(block, &work->box, work->state_found->force, work->command_previous,
                           start);
  }
  improve_from_vertices(block, work, target_reduced, is_spread, best_cost);
  if (*best_cost <= enough) return;
  if (stalls) {
    improve_from_stalls(block, work, target_reduced, lambda, start, best_cost);
    if (*best_cost <= enough) return;
    real lambda_first[6];
    real unused;
    fl_first_lambda(block, work, target_reduced, lambda_first, &unused);
    fl_dual_start(block, work, target_reduced, lambda_first);
    fl_improve_commands(block, work, target_reduced, best_cost);
  } else if (!any_other_foil(block, work, is_spread)) {
    return;
  }
  if (*best_cost > enough && proved <= most_cost) {
    fl_dual_start(block, work, target_reduced, lambda);
    improve_from_lattice(block, work, target_reduced, lambda, enough, is_spread, best_cost);
  }
}

/* Whether commands are known, and no force is in a gap but those of foils: these are no gaps of
   sets, and the starts of foils have looked at their sides. */
int fl_is_done_by_foils(const real *block, const fl_work *work, real best_cost) {
  if (!work->has_drag || !(best_cost < INFEASIBLE_COST)) return 0;
  const fl_state *state = work->state_found;
  const real largest = fl_largest_force(block, work->state_found->force);
  for (int i = 0; i < COUNT(block); i++) {
    if (is_foil(ACTUATOR(block, i))) continue;
    const real *force = state->force[i];
    if (fl_gap_of(block, work, i, force, largest, state->lambda_reduced) > 0) return 0;
  }
  return 1;
}

/* Takes the forces of work->state_found as the best ones where the dual is sure of them (no foil is
   at the end of its table of lifts, no cost is uncertain, no force is in a gap): writes them to
   work->best_force, and commands for them to work->best_command. Returns whether the dual is sure
   and the commands come to give work->wrench_wanted; where not, what was written counts for
   nothing. */
int fl_take_sure_forces(const real *block, fl_work *work) {
  fl_state *state = work->state_found;
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    if (a->uncertainty_cost > 0) return 0;
    if (!is_foil(a)) continue;
    const real largest_lift = a->pressure_area * (1 - NOTHING) * fl_lift_end(block, a)[0];
    if (FABS(state->force[i][0]) >= largest_lift) return 0;
  }
  if (fl_worst_gap(block, work, state->force, state->lambda_reduced) >= 0) return 0;
  copy_forces(block, state->force, work->best_force);
  fl_commands_for_forces(block, &work->box, work->best_force, work->command_previous,
                         work->best_command);
  const real most_error = fl_error_allowed(block, work, &work->box);
  return fl_come_to_give(block, work, &work->box, work->best_command, SURE_STEPS, most_error);
}

/* Commands that give the largest share of a wrench that steps come to, Eq. 14: between the
   share that commands are `found` for, 0 without any, and the `most` that there may be. Steps go
   from the last commands found, and from a start (n, 3). */
void fl_largest_ray_share(const real *block, fl_work *work, const real *wrench, real start[][3],
                          real found, real most, fl_answer *out) {
  const real most_of_all = most;
  /* how far below the most a share is tried, over it, until one is found */
  real below_most = NEARLY;
  for (int k = 0; k < FL_RAY_SHARES; k++) {
    if (!(below_most < 1 && most - found > NEARLY / 4 * most_of_all)) return;
    const int has_found = found > 0;
    real ray_share = most_of_all * (1 - below_most);
    if (has_found) ray_share = (found + most) / 2;
    real wrench_served[6]; /* by forces */
    real target_reduced[6];
    for (int j = 0; j < 6; j++) {
      work->wrench_wanted[j] = ray_share * (wrench[j] + work->span.wrench_offset[j]);
      wrench_served[j] = work->wrench_wanted[j] - work->span.wrench_offset[j];
    }
    fl_reduce_wrench(work, wrench_served, target_reduced);
    real command[FL_MOST][3];
    real lambda[6];
    int is_met = 0;
    /* the last ones found, then the start */
    for (int attempt = 0; attempt < 2 && !is_met; attempt++) {
      if (attempt == 0 && !has_found) continue;
      if (attempt == 0)
        copy_commands(block, out->command, command);
      else
        copy_commands(block, start, command);
      memcpy(lambda, out->lambda_reduced, sizeof lambda);
      real force[FL_MOST][2];
      is_met = fl_meet_and_cheapen(block, work, target_reduced, EXACT, lambda, command, force) <
               INFEASIBLE_COST;
    }
    if (!is_met) {
      most = ray_share;
      if (!has_found) below_most *= 10;
      continue;
    }
    found = ray_share;
    out->has_foil_commands = 1;
    copy_commands(block, command, out->command);
    memcpy(out->lambda_reduced, lambda, sizeof lambda);
    memcpy(out->wrench_served, wrench_served, sizeof wrench_served);
  }
}
