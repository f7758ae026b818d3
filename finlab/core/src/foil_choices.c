/* Which choices of branches of foils' lifts, one for each foil, may hold commands that are cheaper
   than the best known ones: the dual proves of most that they do not.

   At any multipliers the cost of commands is the dual value and, for each actuator, what its force
   is worth less than its conjugate there. So a choice costs at least the dual value and the sum of
   what each foil is worth less on its branch, its regret. Where that proves nothing, the dual of
   the branches themselves does, or says that there may be such commands.

   All of this is for robots whose foils do not stall within their limits: steps from a branch end
   on it then, mostly, and sets know all that a foil gives. */
#include "internal.h"

#define WORTH_SAMPLES 12 /* parts of a branch of which no formula says what it is worth most */

/* Lifts [N] at both ends of a branch, the smaller one first. */
static void lifts_of_branch(const real *block, int i, const real *edge, real *lift) {
  fl_tangent first;
  fl_tangent last;
  fl_foil_at(block, i, edge[0], &first);
  fl_foil_at(block, i, edge[1], &last);
  lift[0] = smaller(first.force[0], last.force[0]);
  lift[1] = larger(first.force[0], last.force[0]);
}

/* What a foil is worth most at prices s on a branch of its lift, between two angles [W]: at an end,
   or where its marginal power is the price of its lift. */
static real worth_on_branch(const real *block, const fl_work *work, int i, const real *s,
                            const real *edge) {
  const fl_actuator *a = ACTUATOR(block, i);
  int parts = 1;
  if (a->uncertainty_cost > 0) parts = WORTH_SAMPLES; /* no formula knows it */
  real worth = -LARGEST_NUMBER;
  for (int k = 0; k <= parts; k++) {
    fl_tangent tangent;
    const real branch_share = (real)k / (real)parts;
    fl_foil_at(block, i, edge[0] + branch_share * (edge[1] - edge[0]), &tangent);
    worth = larger(worth, dot(s, tangent.force, 2) - tangent.cost);
  }
  const real r = 1 - s[1] / a->flow_speed; /* of Eq. 19 */
  if (!(r > 0)) return worth;              /* convex where drag is welcome: largest at an end */
  real lift[2];
  lifts_of_branch(block, i, edge, lift);
  const line_response y = fl_limited_response(block, a, work->set + i, 1, s[0] / r);
  if (!(y.force > lift[0] && y.force < lift[1])) return worth;
  fl_tangent rest;
  fl_foil_at(block, i, a->zero_lift_angle, &rest);
  return larger(worth, r * (y.conjugate + rest.cost) - rest.cost);
}

/* Sets the regrets of all branches, at the multipliers of work->state_found. All choices are left
   that may cost less than is of use [W]. */
void fl_find_choices(const real *block, const fl_work *work, const foil_lattice *lattice,
                     real cost_of_use, foil_choices *choices) {
  const fl_state *state = work->state_found;
  choices->dual_value = state->dual_value;
  choices->cost_of_use = cost_of_use;
  choices->has_known = 0;
  for (int f = 0; f < lattice->foils; f++) {
    const int i = lattice->foil[f];
    real s[2];
    actuator_price(work, i, state->lambda_reduced, s);
    const real conjugate = fl_response(block, i, work->set + i, s).conjugate;
    for (int b = 0; b < lattice->branches[f]; b++) {
      const real worth = worth_on_branch(block, work, i, s, lattice->edge[f] + b);
      choices->regret[f][b] = conjugate - worth;
    }
  }
}

/* Leaves out the choice on which commands (n, 3) are; of foils that are marked (n,) any branch. */
void fl_leave_out_choice(const foil_lattice *lattice, real command[][3],
                         const unsigned char *is_on_any, foil_choices *choices) {
  choices->has_known = 1;
  for (int f = 0; f < lattice->foils; f++) {
    const int i = lattice->foil[f];
    const int last = lattice->branches[f] - 1;
    int branch = 0;
    while (branch < last && command[i][0] > lattice->edge[f][branch + 1]) branch++;
    choices->known_branch[f] = branch;
    if (is_on_any[i]) choices->known_branch[f] = ANY_BRANCH;
  }
}

/* Whether a choice may hold commands that are cheaper, as far as regrets tell. */
int fl_is_choice_left(const foil_lattice *lattice, const foil_choices *choices, int choice) {
  int is_known = choices->has_known;
  real least_cost = choices->dual_value;
  for (int f = 0; f < lattice->foils; f++) {
    const int branch = fl_branch_of_choice(lattice, choice, f);
    const int known = choices->known_branch[f];
    least_cost += choices->regret[f][branch];
    if (choices->has_known && known != ANY_BRANCH && known != branch) is_known = 0;
  }
  return least_cost < choices->cost_of_use && !is_known;
}

/* Leaves of the sets of the foils what their branches at a point give. */
static void narrow_to_branches(const real *block, fl_work *work, const foil_lattice *lattice,
                               const lattice_point *point) {
  for (int f = 0; f < lattice->foils; f++) {
    const int i = lattice->foil[f];
    const int branch = (point->node[f] - lattice->first[f]) / lattice->each;
    real lift[2];
    lifts_of_branch(block, i, lattice->edge[f] + branch, lift);
    const real low = larger(lift[0], work->set[i].force_min);
    const real high = smaller(lift[1], work->set[i].force_max);
    fl_limit_set(block, i, work->set + i, low, high, 0, 0);
  }
}

/* Whether the dual proves that commands on the branches of a point cost more than is of use [W],
   from multipliers on. work->state_found is of these branches then. */
int fl_is_proved_dearer(const real *block, fl_work *work, const foil_lattice *lattice,
                        const real *target_reduced, const real *lambda, real cost_of_use,
                        const lattice_point *point) {
  const real power_of_use = work->power_of_use;
  fl_set before[FL_MOST];
  copy_sets(block, work->set, before);
  narrow_to_branches(block, work, lattice, point);
  fl_prepare_sets(block, work);
  work->power_of_use = smaller(power_of_use, cost_of_use);
  const int status = fl_dual_newton(block, work, target_reduced, lambda, FL_STEPS_AT_KINK);
  work->power_of_use = power_of_use;
  fl_restore_sets(block, work, before);
  return status == FL_BEYOND;
}
