/* Commands of robots whose foils drag. A foil gives a lift and with it a drag, a curve; the
   dual takes what lies between the curve and its chord for it, too. Steps on the angles of
   the foils lead from its forces to commands that give a wrench by the curves. A step is the
   dual's answer where each curve is its tangent, curved as much as the cost less the worth
   of the force, whatever the sign (sequential quadratic programming); all other sets are
   whole. Levenberg-Marquardt steps make it exact, and it is kept where it is cheaper.

   Steps lead to what is near. With few actuators what foils give is a curved sheet, which
   turns back where they stall: a wrench on it is met at few commands, far from each other,
   and from elsewhere steps end at a least miss. Where the starts that the dual has come to
   no cost that it proves, others are taken from a lattice over the angles of all foils
   (foil_lattice.c), each kept within the branches of the lifts on which it lies. */
#include "internal.h"

#define APPROACH_STEPS 24         /* steps on commands from a start towards a wrench, at most */
#define APPROACH_ROUND 6          /* the same in a row, which have to halve the error */
#define EXACT_STEPS 24            /* steps that end them, to rounding */
#define SURE_STEPS 12             /* the same from forces that the dual is sure of */
#define STALL_SAMPLES 12          /* angles of a stalled foil that are looked at for its worth */
#define CHEAPER R(1e-10) /* share of the cost below which a gain ends the steps */
#define BETTER_THAN_EXPECTED R(1.2)
#define STEP_LONGER 2
#define STEP_SHORTER R(0.25)      /* a step that is no cheaper is shortened to this share */
/* commands that cost more than this times the best are left alone */
#define WITHIN_BEST R(1.5)
/* share of a ray that stalled foils may add to what tables give */
#define STALLED_MORE R(0.1)

static int has_gap(const fl_actuator *a, const fl_set *set) {
  if (is_plane(a)) return set->is_forked || set->force_max_reverse > 0;
  return a->dead_band > 0;
}

static int any_gap(const real *block, const fl_work *work) {
  for (int i = 0; i < COUNT(block); i++) {
    if (has_gap(ACTUATOR(block, i), work->set + i)) return 1;
  }
  return 0;
}

/* Narrows sets and limits of other actuators to the side of a gap on which their forces are. */
static void take_sides(const real *block, fl_work *work, fl_box *box, real command[][3],
                       real force[][2]) {
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    fl_set *set = work->set + i;
    if (has_gap(a, set)) {
      fl_narrow_set(block, i, set, force[i], fl_nearer_side(block, i, set, force[i]));
    }
    const int k = fl_form_of(a)->force_number;
    const int has_dead_band = k != NO_NUMBER && a->dead_band > 0;
    if (!has_dead_band || fl_aims_force(a)) continue;
    real low = set->force_min;
    real high = set->force_max;
    if (!(a->command_sign > 0)) {
      low = -set->force_max;
      high = -set->force_min;
    }
    box->command_min[i][k] = larger(box->command_min[i][k], low);
    box->command_max[i][k] = smaller(box->command_max[i][k], high);
    command[i][k] = fl_clip_number(box, i, k, NO_NUMBER, command[i][k]);
  }
}

/* Makes commands those that a share of the step from forces to the dual's answer leads to. */
static void take_step(const real *block, const fl_work *work, const fl_box *box, real force[][2],
                      real share, real command[][3]) {
  for (int i = 0; i < COUNT(block); i++) {
    if (work->span.is_lost[i]) continue;
    const real *answer = work->state_found->force[i];
    const real change[2] = {share * (answer[0] - force[i][0]), share * (answer[1] - force[i][1])};
    if (is_foil(ACTUATOR(block, i))) { /* the angle whose tangent comes nearest to the change */
      const real *slope = work->tangent[i].force_slope;
      const real turn = dot(change, slope, 2) / larger(dot(slope, slope, 2), TINY);
      command[i][0] = fl_clip_number(box, i, 0, NO_NUMBER, command[i][0] + turn);
      continue;
    }
    const real wanted[2] = {force[i][0] + change[0], force[i][1] + change[1]};
    fl_command_for_force(block, i, box, wanted, command[i], command[i]);
  }
}

/* Whether commands within a box are fewer than the directions in which the robot drives:
   what they give is a sheet, and that of the tables lies beside that of the laws, by FINE at
   most. A wrench on the one is then met by no commands of the other. */
static int are_few(const real *block, const fl_work *work, const fl_box *box) {
  int free = 0;
  for (int i = 0; i < COUNT(block); i++) {
    if (work->span.is_lost[i]) continue;
    for (int c = 0; c < 3; c++) free += box->command_max[i][c] > box->command_min[i][c];
  }
  return free < work->span.rank;
}

/* Steps towards work->wrench_wanted, of which so many in a row have to halve the error: most starts
   end soon. The error over the wrench scale that is left. */
static real approach(const real *block, fl_work *work, const fl_box *box, real command[][3],
                     int steps) {
  real error = LARGEST_NUMBER;
  for (int k = 0; k < APPROACH_STEPS; k += steps) {
    const real before = error;
    error = fl_refine_commands(block, work, box, work->wrench_wanted, command, steps);
    if (error <= EXACT || error > before / 2) break;
  }
  return error;
}

/* Whether so many Levenberg-Marquardt steps make commands within a box give work->wrench_wanted,
   to an error over the wrench scale and to rounding. Where that is what tables leave, steps on
   their error end soon. */
static int come_to_give(const real *block, fl_work *work, const fl_box *box, real command[][3],
                        int steps, real most_error) {
  real size = 0;
  for (int k = 0; k < 6; k++) size += FABS(work->wrench_wanted[k]) / HEAD(block)->wrench_scale[k];
  real error;
  if (most_error > EXACT)
    error = approach(block, work, box, command, APPROACH_ROUND);
  else
    error = fl_refine_commands(block, work, box, work->wrench_wanted, command, steps);
  return error <= most_error + ROUNDING * size;
}

/* Largest error over the wrench scale of commands that are said to give a wrench: what tables
   leave where these are few. */
static real error_allowed(const real *block, const fl_work *work, const fl_box *box) {
  if (are_few(block, work, box)) return FINE;
  return EXACT;
}

/* Sets of a step: of each foil its tangent at its command. */
static void draw_tangents(const real *block, fl_work *work, const fl_box *box, const real *lambda,
                          real command[][3]) {
  for (int i = 0; i < COUNT(block); i++) {
    if (!is_foil(ACTUATOR(block, i)) || work->span.is_lost[i]) continue;
    real s[2];
    actuator_price(work, i, lambda, s);
    fl_draw_tangent(block, i, box, command[i][0], s, work->tangent + i, work->set + i);
  }
}

/* Adds to the normal equations H lambda = right that a force along a direction b (6,) in the basis
   has a price, b' lambda = price, with a weight. */
static void add_price(real H[6][6], real *right, const real *direction, real weight, real price) {
  fl_add_square(H, direction, weight);
  for (int j = 0; j < 6; j++) right[j] += weight * price * direction[j];
}

/* Adds those of a line or a plane at its force, where this may still move. */
static void add_price_of_force(const real *block, const fl_work *work, int i, const real *force,
                               real H[6][6], real *right) {
  const fl_actuator *a = ACTUATOR(block, i);
  const fl_set *set = work->set + i;
  const real(*B)[6] = work->span.effectiveness_reduced[i];
  real size = force[0];
  if (is_plane(a)) size = size_of(force);
  if (!(size > set->force_min && size < set->force_max) || size == 0) return;
  real price;
  fl_power_and_price(block, i, size, &price);
  if (size < 0) price = -price;
  const real slope = fl_limited_response(block, a, set, !is_plane(a), price).slope;
  if (!is_plane(a)) {
    add_price(H, right, B[0], slope, price);
    return;
  }
  const real x = force[0] / size;
  const real y = force[1] / size;
  real ahead[6];
  real across[6];
  for (int j = 0; j < 6; j++) {
    ahead[j] = x * B[0][j] + y * B[1][j];
    across[j] = x * B[1][j] - y * B[0][j];
  }
  add_price(H, right, ahead, slope, price);
  add_price(H, right, across, size / larger(price, TINY), 0);
}

/* Makes multipliers those at which commands are cheapest for what they give, by least squares:
   each actuator that is not at a limit has its own price there. */
static void multipliers_at(const real *block, const fl_work *work, real force[][2], real *lambda) {
  real H[6][6] = {{0}};
  real right[6] = {0};
  for (int i = 0; i < COUNT(block); i++) {
    const fl_set *set = work->set + i;
    if (work->span.is_lost[i]) continue;
    if (!is_foil(ACTUATOR(block, i))) {
      add_price_of_force(block, work, i, force[i], H, right);
      continue;
    }
    const fl_tangent *tangent = work->tangent + i;
    const real(*B)[6] = work->span.effectiveness_reduced[i];
    real wrench_slope[6]; /* by the angle */
    if (!(set->force_min < 0 && set->force_max > 0)) continue;
    for (int j = 0; j < 6; j++) {
      wrench_slope[j] = tangent->force_slope[0] * B[0][j] + tangent->force_slope[1] * B[1][j];
    }
    add_price(H, right, wrench_slope, 1 / tangent->curvature, tangent->cost_slope);
  }
  const real ridge = NOTHING * fl_trace(H) + TINY;
  for (int j = 0; j < 6; j++) {
    H[j][j] += ridge;
    right[j] += ridge * lambda[j];
  }
  if (fl_factor(H)) fl_solve(H, right, lambda);
}

/* What commands of a cost [W] and their forces would cost if they left nothing of the target: the
   Lagrangian at multipliers in the basis. */
static real lagrangian(const real *block, const fl_work *work, const real *target_reduced,
                       const real *lambda, real cost, real force[][2]) {
  real left[6];
  memcpy(left, target_reduced, sizeof left);
  for (int i = 0; i < COUNT(block); i++) {
    const real(*B)[6] = work->span.effectiveness_reduced[i];
    for (int j = 0; j < 6; j++) left[j] -= force[i][0] * B[0][j] + force[i][1] * B[1][j];
  }
  return cost + dot(lambda, left, 6);
}

/* Makes commands cheaper, from their forces and cost [W] on, by steps of sequential quadratic
   programming that keep giving work->wrench_wanted; `lambda` becomes that of the last step, and
   work->state_found the dual of its tangents. Their cost, but for what they leave of the target. */
static real cheapen(const real *block, fl_work *work, const fl_box *box, const real *target_reduced,
                    real most_error, real cost, real *lambda, real command[][3], real force[][2]) {
  real share = 1;
  real exact_cost = cost;
  real expected = 0;
  int has_moved = 1;
  for (int k = 0; k < FL_FOIL_STEPS; k++) {
    if (has_moved) {
      draw_tangents(block, work, box, lambda, command);
      fl_prepare_sets(block, work);
      if (k == 0) multipliers_at(block, work, force, lambda);
      fl_dual_start(block, work, target_reduced, lambda);
      exact_cost = lagrangian(block, work, target_reduced, lambda, cost, force);
      if (exact_cost - work->state_found->dual_value <= CHEAPER * cost) break;
      const int status = fl_dual_newton(block, work, target_reduced, lambda, FL_STEPS_AT_KINK);
      const fl_state *state = work->state_found;
      if (status == FL_MET) memcpy(lambda, state->lambda_reduced, sizeof state->lambda_reduced);
      exact_cost = lagrangian(block, work, target_reduced, state->lambda_reduced, cost, force);
      expected = exact_cost - state->dual_value;
      if (status == FL_MET && expected <= CHEAPER * cost) break;
    }
    real stepped[FL_MOST][3];
    real force_stepped[FL_MOST][2];
    copy_commands(block, command, stepped);
    take_step(block, work, box, force, share, stepped);
    real gain = -INFEASIBLE_COST;
    real cost_stepped = 0;
    if (come_to_give(block, work, box, stepped, EXACT_STEPS, most_error)) {
      cost_stepped = fl_power_of_commands(block, work, stepped, force_stepped);
      gain = exact_cost - lagrangian(block, work, target_reduced, work->state_found->lambda_reduced,
                                     cost_stepped, force_stepped);
    }
    has_moved = gain > 0;
    if (has_moved) {
      copy_commands(block, stepped, command);
      copy_forces(block, force_stepped, force);
      cost = cost_stepped;
      exact_cost -= gain;
      share = STEP_LONGER * share;
      if (!(gain > BETTER_THAN_EXPECTED * expected)) share = smaller(share, 1);
    } else {
      share *= STEP_SHORTER;
    }
    if (FABS(gain) <= CHEAPER * cost) break;
  }
  return exact_cost;
}

/* Makes commands give work->wrench_wanted, in the basis `target_reduced`, to an error over the
   wrench scale, and then cheaper; `lambda` becomes that of the last step. Their forces along the
   rows, and their cost [W]; INFEASIBLE_COST where they do not come to give it. */
static real meet_and_cheapen(const real *block, fl_work *work, const real *target_reduced,
                             real most_error, real *lambda, real command[][3],
                             real force[][2]) {
  fl_box box = work->box;
  fl_set before[FL_MOST];
  copy_sets(block, work->set, before);
  if (any_gap(block, work)) {
    fl_power_of_commands(block, work, command, force);
    take_sides(block, work, &box, command, force);
  }
  real cost = INFEASIBLE_COST;
  if (come_to_give(block, work, &box, command, EXACT_STEPS, most_error)) {
    cost = fl_power_of_commands(block, work, command, force);
    cost = cheapen(block, work, &box, target_reduced, most_error, cost, lambda, command, force);
  }
  fl_restore_sets(block, work, before);
  return cost;
}

/* Remembers what commands and multipliers lead to, where it costs less than the best so far. */
static void improve_from(const real *block, fl_work *work, const real *target_reduced,
                         const real *lambda, real command[][3], real *best_cost) {
  const real most_error = error_allowed(block, work, &work->box);
  real force[FL_MOST][2];
  real lambda_near[6];
  memcpy(lambda_near, lambda, sizeof lambda_near);
  const real cost =
      meet_and_cheapen(block, work, target_reduced, most_error, lambda_near, command, force);
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
  improve_from(block, work, target_reduced, work->state_found->lambda_reduced, command, best_cost);
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
static int may_any_stall(const real *block, const fl_work *work) {
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
  approach(block, work, &branches, command, APPROACH_ROUND);
  approach(block, work, &work->box, command, APPROACH_ROUND);
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

/* Whether the dual proves that commands on the branches of a point of a lattice cost more than is
   of use, from multipliers on. It says nothing of foils that stall there. */
static int is_proved_dearer(const real *block, fl_work *work, const foil_lattice *lattice,
                            const real *target_reduced, const real *lambda,
                            const lattice_point *point, real cost_of_use) {
  fl_set before[FL_MOST];
  if (!(cost_of_use < INFEASIBLE_COST)) return 0;
  copy_sets(block, work->set, before);
  const int is_known = fl_sets_of_point(block, work, lattice, point);
  int status = FL_MET;
  if (is_known) {
    const real power_of_use = work->power_of_use;
    fl_prepare_sets(block, work);
    work->power_of_use = smaller(power_of_use, cost_of_use);
    status = fl_dual_newton(block, work, target_reduced, lambda, FL_STEPS_AT_KINK);
    work->power_of_use = power_of_use;
  }
  fl_restore_sets(block, work, before);
  return status == FL_BEYOND;
}

/* Improves on the best commands by what steps from a lattice come to: first exact commands
   from many points, then the cheapest of these are made cheaper, but for those that cost
   half as much again as the best so far. */
static void improve_from_lattice(const real *block, fl_work *work, const real *target_reduced,
                                 const real *lambda, real enough, const unsigned char *is_spread,
                                 real *best_cost) {
  const real most_error = error_allowed(block, work, &work->box);
  foil_lattice lattice;
  lattice_point points[LATTICE_STARTS];
  real command[FL_MOST][3];
  fl_lay_lattice(block, work, &lattice);
  int any_spread = 0;
  for (int i = 0; i < COUNT(block); i++) any_spread |= is_spread[i];
  lattice.known_branch[0] = -2;
  if (*best_cost < INFEASIBLE_COST && any_spread && !may_any_stall(block, work)) fl_leave_out_branches(&lattice, work->best_command, is_spread);
  const int count =
      fl_cheapest_points(block, work, &lattice, target_reduced, may_any_stall(block,work) ? *best_cost * WITHIN_BEST : *best_cost * (1 - NOTHING), points);
  for (int k = 0; k < count; k++) {
    real unused[FL_MOST][2];
    points[k].cost = INFEASIBLE_COST;
    if (!may_any_stall(block, work) && is_proved_dearer(block, work, &lattice, target_reduced, lambda, points + k, *best_cost)) {
      continue;
    }
    begin_at(block, work, &lattice, target_reduced, points + k, command);
    if (come_to_give(block, work, &work->box, command, 0, most_error)) {
      points[k].cost = fl_power_of_commands(block, work, command, unused);
    }
  }
  real last_cost = 0;
  for (int tried = 0; tried < FL_LATTICE_FOLLOWED && *best_cost > enough; tried++) {
    const lattice_point *next = next_point(points, count, last_cost);
    if (!next || !(next->cost < smaller(*best_cost * WITHIN_BEST, INFEASIBLE_COST))) return;
    last_cost = next->cost;
    begin_at(block, work, &lattice, target_reduced, next, command);
    improve_from(block, work, target_reduced, lambda, command, best_cost);
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
      improve_from(block, work, target_reduced, lambda, command, best_cost);
    }
  }
}

/* Improves on the best commands from the vertices of the lifts that the dual leaves between their
   ends; returns how many there are. */
static void improve_from_vertices(const real *block, fl_work *work, const real *target_reduced,
                                 unsigned char *is_spread, real *best_cost) {
  foil_vertices vertices;
  real lambda[6];
  real found[FL_MOST][2];
  fl_find_vertices(block, work, &vertices);
  memset(is_spread, 0, (size_t)COUNT(block));
  memcpy(lambda, work->state_found->lambda_reduced, sizeof lambda);
  copy_forces(block, work->state_found->force, found);
  int count = 1;
  for (int vertex = 0; vertex < count; vertex++) {
    real force[FL_MOST][2];
    real command[FL_MOST][3];
    unsigned char is_at_end[VERTEX_FOILS];
    fl_box box = work->box;
    copy_forces(block, found, force);
    count = 1 << fl_go_to_vertex(work, &vertices, vertex, is_at_end, force);
    fl_commands_for_forces(block, &work->box, force, work->command_previous, command);
    for (int f = 0; f < vertices.foils; f++) {
      const int i = vertices.foil[f];
      if (!is_at_end[f]) continue;
      box.command_min[i][0] = command[i][0];
      box.command_max[i][0] = command[i][0];
    }
    approach(block, work, &box, command, APPROACH_ROUND);
    improve_from(block, work, target_reduced, lambda, command, best_cost);
  }
  for (int f = 0; f < vertices.foils && count > 1; f++) is_spread[vertices.foil[f]] = 1;
  for (int k = 0; k < 2 * vertices.foils && count == 1; k++) {
    real force[FL_MOST][2];
    real command[FL_MOST][3];
    const int i = vertices.foil[k / 2];
    fl_box box = work->box;
    copy_forces(block, found, force);
    force[i][0] = k % 2 ? work->set[i].force_max : work->set[i].force_min;
    fl_commands_for_forces(block, &work->box, force, work->command_previous, command);
      box.command_min[i][0] = command[i][0];
      box.command_max[i][0] = command[i][0];
    approach(block, work, &box, command, APPROACH_ROUND);
    improve_from(block, work, target_reduced, lambda, command, best_cost);
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
  const int stalls = may_any_stall(block, work);
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
  const real most_error = error_allowed(block, work, &work->box);
  return come_to_give(block, work, &work->box, work->best_command, SURE_STEPS, most_error);
}

/* Commands that give the largest share of a wrench that steps come to, Eq. 14: between the
   share that commands are `found` for, 0 without any, and the `most` that the dual allows.
   `out` has forces near to it. */
void fl_largest_ray_share(const real *block, fl_work *work, const real *wrench, real found,
                          real most, fl_answer *out) {
  const real most_by_dual = most;
  /* how far below the most a share is tried, over it, until one is found */
  real below_most = NEARLY;
  real start[FL_MOST][3];
  if (may_any_stall(block, work)) most = smaller(most_by_dual * (1 + STALLED_MORE), 1);
  fl_commands_for_forces(block, &work->box, out->force, work->command_previous, start);
  for (int k = 0; k < FL_RAY_SHARES; k++) {
    if (!(below_most < 1 && most - found > NEARLY / 4 * most_by_dual)) return;
    const int has_found = found > 0;
    real ray_share = most_by_dual * (1 - below_most);
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
      is_met = meet_and_cheapen(block, work, target_reduced, EXACT, lambda, command, force) < INFEASIBLE_COST;
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
