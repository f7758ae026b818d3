/* The search for least power where sets have gaps: depth first, by the bounds that the dual
   gives on each side of a cut. */
#include "internal.h"

/* an answer below this share of the least force is no answer of an arc */
#define HOLLOW_FORCE R(0.9)

/* Whether the smoothed response of an arc has a force that is smaller than any in it. */
static int is_hollow(const real *block, int i, const fl_set *set, const real *force) {
  const int is_narrow = is_plane(ACTUATOR(block, i)) && set->turn_cost == 0 &&
                        set->sector_half_angle <= NARROW;
  return is_narrow && fl_limited_size(block, i, set, force) < HOLLOW_FORCE * set->force_min;
}

static int any_hollow(const real *block, const fl_work *work) {
  for (int i = 0; i < COUNT(block); i++) {
    if (is_hollow(block, i, work->set + i, work->state_found->force[i])) return 1;
  }
  return 0;
}

/* Finds the optimum of a part from multipliers, or from where its own solver is; returns how that
   ended. */
static int solve_part(const real *block, fl_work *work, const fl_part_problem *problem,
                      const real *lambda) {
#if FL_KEEPS_BUDGETS
  if (problem->solve) return problem->solve(problem->data);
#endif
  return fl_dual_newton(block, work, problem->target_reduced, lambda, FL_STEPS_AT_KINK);
}

/* Remembers an answer without a gap, where it is the cheapest so far: its forces in
   work->best_force. With foils it also changes work->state_found, as fl_improve_commands does. */
static void keep_answer(const real *block, fl_work *work, const fl_part_problem *problem,
                        real *best_cost) {
  if (work->has_drag) {
    fl_improve_commands(block, work, problem->target_reduced, best_cost);
    return;
  }
  if (!(work->state_found->dual_value < *best_cost)) return;
  *best_cost = work->state_found->dual_value;
  copy_forces(block, work->state_found->force, work->best_force);
#if FL_KEEPS_BUDGETS
  if (problem->keep) problem->keep(problem->data);
#endif
}

/* Whether the forces of work->state_found are an answer: they meet the target, and none of them is
   in a gap (`gap` is the actuator of the worst one, or -1). */
static int is_without_gap(const real *block, const fl_work *work, int status, int gap) {
  return status == FL_MET && gap < 0 && !any_hollow(block, work);
}

/* Share of a cost that is worth another search. Zones leave few parts, each with an answer of its
   own that may be the best: all of them are looked at. */
static real worth_search(const fl_work *work, const fl_part_problem *problem) {
  if (FL_ZONES > 0 && work->has_zones) return NEARLY;
  if (FL_KEEPS_BUDGETS && problem->solve) return NEARLY;
  return CLOSE;
}

/* Whether forces of a part that has no answer yet could still be cheaper than the best answer. */
static int may_be_cheaper(const fl_work *work, const fl_part_problem *problem, int status, int gap,
                          real best_cost) {
  const int is_bound = status == FL_MET || (status == FL_NO_PROGRESS && gap >= 0);
  return is_bound && work->state_found->dual_value < best_cost * (1 - worth_search(work, problem));
}

/* Whether the force of a plane is below its least one, at which it is then frozen. Pods whose
   turning costs are left out: their response is that of the set itself and not of its convex hull,
   so it is below the least force only where it jumps, and there the jump is to be cut. */
static int is_below_least_force(const real *block, int i, const fl_set *set, const real *force) {
  const int has_free_turns = is_plane(ACTUATOR(block, i)) && set->turn_cost == 0;
  return has_free_turns && fl_limited_size(block, i, set, force) < SHORTER * set->force_min;
}

/* Leaves all gaps on their nearer sides, round after round, until there are none; forces
   that cannot rest keep their direction. The sets become those of the last round, and
   work->state_found the dual of these. */
static void dive(const real *block, fl_work *work, const fl_part_problem *problem, int status,
                 real *best_cost) {
  for (int round = 0; round < FL_DIVE_ROUNDS; round++) {
    fl_state *state = work->state_found;
    const real largest = fl_largest_force(block, state->force);
    const int gap = fl_worst_gap(block, work, state->force, state->lambda_reduced);
    if (is_without_gap(block, work, status, gap)) {
      keep_answer(block, work, problem, best_cost);
      return;
    }
    if (!may_be_cheaper(work, problem, status, gap, *best_cost)) return;
    for (int i = 0; i < COUNT(block); i++) {
      fl_set *set = work->set + i;
      const real *force = state->force[i];
      const int hollow = is_hollow(block, i, set, force);
      const int is_cut = hollow ||
                         fl_gap_of(block, work, i, force, largest, state->lambda_reduced) > 0;
      if (!is_cut) continue;
      if (hollow || is_below_least_force(block, i, set, force))
        fl_fix_at_least_force(block, i, set, force);
      else
        fl_narrow_set(block, i, set, force, fl_nearer_side(block, i, set, force));
    }
    fl_prepare_sets(block, work);
    real lambda[6];
    memcpy(lambda, state->lambda_reduced, sizeof lambda);
    status = solve_part(block, work, problem, lambda);
  }
}

/* Solves both sides of a cut from the multipliers so far and stays at the cheaper one: of that
   are the sets, work->state_found, and the status of Newton's method that it returns. */
static int cheaper_side(const real *block, fl_work *work, const fl_part_problem *problem,
                        fl_cut *cut) {
  const int nearer = fl_nearer_side(block, cut->actuator, &cut->set_before, cut->force);
  const int side[2] = {nearer, -nearer};
  real lambda_begin[6];
  real lambda[2][6];
  real cost[2];
  int status[2];
  memcpy(lambda_begin, work->state_found->lambda_reduced, sizeof lambda_begin);
  for (int k = 0; k < 2; k++) {
    fl_take_side(block, work, cut, side[k]);
    status[k] = solve_part(block, work, problem, lambda_begin);
    cost[k] = work->state_found->dual_value;
    if (status[k] == FL_BEYOND) cost[k] = INFEASIBLE_COST;
    memcpy(lambda[k], work->state_found->lambda_reduced, sizeof lambda[k]);
  }
  const int cheaper = cost[1] < cost[0];
  const int other = !cheaper;
  cut->first_side = side[cheaper];
  cut->score[0] = cost[other];
  memcpy(cut->lambda_reduced, lambda[other], sizeof cut->lambda_reduced);
  if (cheaper == 1) return status[1];
  fl_take_side(block, work, cut, side[0]);
  return solve_part(block, work, problem, lambda[0]);
}

/* How many parts a search may look at. */
static int most_parts_of_search(const fl_work *work) {
  const fl_settings *settings = &work->settings;
  if (work->has_turn_cost && settings->tick_parts < settings->most_parts)
    return settings->tick_parts;
  return settings->most_parts;
}

/* Dives with the sets as they are, and leaves these as they were; work->state_found is the dual
   of the last round of the dive. */
static void dive_and_return(const real *block, fl_work *work, const fl_part_problem *problem,
                            int status, real *best_cost) {
  fl_set before[FL_MOST];
  copy_sets(block, work->set, before);
  dive(block, work, problem, status, best_cost);
  copy_sets(block, before, work->set);
}

/* Goes back to the last cut whose other side may be cheaper than the best so far, and makes
   the bound no larger than those of the sides that are left out; 0 where there is none. */
static fl_cut *last_cheaper_cut(const real *block, fl_work *work, const fl_part_problem *problem,
                                int *depth, real best_cost, real *bound) {
  for (;;) {
    fl_cut *cut = fl_last_open_cut(block, work, depth);
    if (!cut) return 0;
    if (cut->score[0] < best_cost * (1 - worth_search(work, problem))) return cut;
    *bound = smaller(*bound, cut->score[0]);
  }
}

/* Goes back to the multipliers with which a search began. */
static void begin_again(const real *block, fl_work *work, const fl_part_problem *problem,
                        const real *lambda) {
#if FL_KEEPS_BUDGETS
  if (problem->solve) {
    problem->solve(problem->data);
    return;
  }
#endif
  fl_dual_start(block, work, problem->target_reduced, lambda);
}

/* Least power for a target at whose multipliers some force is in a gap, from what Newton's
   method came to (`status`, work->state_found). Forces are in work->best_force; with foils
   commands in work->best_command, and multipliers near to these in work->best_lambda, too;
   `bound` is the power [W] that no forces in the sets undercut. Returns 0 where no part meets
   the target. The sets are left as they were, work->state_found as that of the last part. */
int fl_search_gaps(const real *block, fl_work *work, const real *target_reduced, int status,
                   real *bound) {
  const fl_part_problem problem = {target_reduced, 0, 0, 0};
  return fl_search_parts(block, work, &problem, status, bound);
}

int fl_search_parts(const real *block, fl_work *work, const fl_part_problem *problem, int status,
                    real *bound) {
  const int most_parts = most_parts_of_search(work);
  const int status_begin = status;
  real best_cost = INFEASIBLE_COST;
  real least_bound = INFEASIBLE_COST;
  real lambda_begin[6];
  int depth = 0;
  int parts = 0;
  copy_sets(block, work->set, work->set_before);
  memcpy(lambda_begin, work->state_found->lambda_reduced, sizeof lambda_begin);
  if (work->has_drag) {
    fl_improve_from_starts(block, work, problem->target_reduced, &best_cost);
    fl_dual_start(block, work, problem->target_reduced, lambda_begin);
  }
  if (!fl_is_done_by_foils(block, work, best_cost)) {
    dive(block, work, problem, status, &best_cost);
  }
  fl_restore_sets(block, work, work->set_before);
  begin_again(block, work, problem, lambda_begin);
  status = status_begin;
  for (;;) {
    fl_state *state = work->state_found;
    const real dual_value = state->dual_value;
    const int gap = fl_worst_gap(block, work, state->force, state->lambda_reduced);
    int is_open = 0;
    if (is_without_gap(block, work, status, gap))
      keep_answer(block, work, problem, &best_cost);
    else
      is_open = may_be_cheaper(work, problem, status, gap, best_cost);
    if (is_open && gap < 0) { /* hollow: at their least forces */
      dive_and_return(block, work, problem, status, &best_cost);
      least_bound = smaller(least_bound, dual_value);
      status = FL_BEYOND;
      is_open = 0;
    }
    const int can_cut = is_open && !is_foil(ACTUATOR(block, gap));
    fl_cut *cut = 0;
    if (can_cut && parts < most_parts) {
      cut = fl_cut_set(block, work, &depth, gap, state->force[gap]);
    }
    if (cut) {
      status = cheaper_side(block, work, problem, cut);
      parts += 2;
      continue;
    }
    work->is_truncated |= can_cut;
    if (status != FL_BEYOND) least_bound = smaller(least_bound, dual_value);
    cut = last_cheaper_cut(block, work, problem, &depth, best_cost, &least_bound);
    if (!cut) break;
    fl_take_side(block, work, cut, -cut->first_side);
    status = solve_part(block, work, problem, cut->lambda_reduced);
  }
  fl_restore_sets(block, work, work->set_before);
  *bound = least_bound;
  return best_cost < INFEASIBLE_COST;
}

/* Power [W] that gaps are proved to need, by the bound [W] of a search: with turning costs that is
   of more than power, and proves nothing. */
real fl_gap_power_bound(const fl_work *work, real bound) {
  if (work->has_turn_cost) return 0;
  return bound * (1 - FINE);
}

/* Commands in `out` that give `wrench_wanted` [N, N m], from what Newton's method came to for the
   target of its forces; 0 where none are found. work->state_found is not that of the commands
   afterwards: their multipliers are in `out`. */
int fl_answer_with_drag(const real *block, fl_work *work, const real *wrench_wanted,
                        const real *target_reduced, int status, fl_answer *out) {
  memcpy(work->wrench_wanted, wrench_wanted, sizeof work->wrench_wanted);
  const real dual_value = work->state_found->dual_value;
  memcpy(out->lambda_reduced, work->state_found->lambda_reduced, sizeof out->lambda_reduced);
  const int is_sure = status == FL_MET && fl_take_sure_forces(block, work);
  if (!is_sure) {
    real bound;
    if (!fl_search_gaps(block, work, target_reduced, status, &bound)) return 0;
    if (status != FL_MET) { /* multipliers at the commands may prove more */
      fl_dual_start(block, work, target_reduced, work->best_lambda);
      if (work->state->dual_value > dual_value)
        memcpy(out->lambda_reduced, work->best_lambda, sizeof out->lambda_reduced);
    }
  }
  copy_commands(block, work->best_command, out->command);
  out->has_foil_commands = 1;
  return 1;
}
