/* A lattice over the angles of all foils, where searches for commands may begin: on every branch of
   a foil's lift (stalled one way, lift one way, lift the other way, stalled the other way) it has
   some nodes, and a point of the lattice is one node of each foil. What the other actuators give
   and cost there is told from quadratic costs, so that a point takes no step. */
#include "internal.h"

#define LATTICE (1 << 2 * LATTICE_FOILS) /* points at most: one on each branch of all foils */
#define EACH_MOST 6                      /* nodes on a branch */
#define MISS_WEIGHT 12 /* cost of a miss of 1, over the largest cost of all actuators */

/* Ends of the branches of a foil's lift within its limits; how many branches there are. */
static int edges_of(const real *block, const fl_work *work, int i, real *edge) {
  const fl_actuator *a = ACTUATOR(block, i);
  const real low = work->box.command_min[i][0];
  const real high = work->box.command_max[i][0];
  const real stall_angle = fl_lift_end(block, a)[1];
  const real turn[BRANCHES - 1] = {a->zero_lift_angle - stall_angle, a->zero_lift_angle,
                                   a->zero_lift_angle + stall_angle};
  int branches = 0;
  edge[0] = low;
  for (int k = 0; k < BRANCHES - 1; k++) {
    if (!(turn[k] > low && turn[k] < high)) continue;
    branches++;
    edge[branches] = turn[k];
  }
  branches++;
  edge[branches] = high;
  return branches;
}

/* How many nodes each branch has: as many as the lattice has room for. */
static int nodes_of_branch(const foil_lattice *lattice) {
  int choices = 1;
  int branches = 0;
  for (int f = 0; f < lattice->foils; f++) {
    choices *= lattice->branches[f];
    branches += lattice->branches[f];
  }
  for (int each = EACH_MOST; each > 1; each--) {
    int points = choices;
    for (int f = 0; f < lattice->foils; f++) points *= each;
    if (points <= LATTICE && branches * each <= LATTICE_NODES) return each;
  }
  return 1;
}

/* Foils, their branches, and how many nodes each branch has. */
static void find_branches(const real *block, const fl_work *work, foil_lattice *lattice) {
  lattice->foils = 0;
  for (int i = 0; i < COUNT(block) && lattice->foils < LATTICE_FOILS; i++) {
    if (!is_foil(ACTUATOR(block, i)) || work->span.is_lost[i]) continue;
    const int f = lattice->foils;
    lattice->branches[f] = edges_of(block, work, i, lattice->edge[f]);
    lattice->foil[f] = i;
    lattice->foils++;
  }
  lattice->each = nodes_of_branch(lattice);
}

/* The nodes of all foils: angles in the middle of equal parts of each branch. */
static void lay_nodes(const real *block, const fl_work *work, foil_lattice *lattice) {
  int node = 0;
  for (int f = 0; f < lattice->foils; f++) {
    const real(*B)[6] = work->span.effectiveness_reduced[lattice->foil[f]];
    lattice->first[f] = node;
    for (int k = 0; k < lattice->branches[f] * lattice->each; k++) {
      const real *edge = lattice->edge[f] + k / lattice->each;
      const real branch_share = ((real)(k % lattice->each) + R(0.5)) / (real)lattice->each;
      lattice->angle[node] = edge[0] + branch_share * (edge[1] - edge[0]);
      fl_tangent tangent;
      fl_foil_at(block, lattice->foil[f], lattice->angle[node], &tangent);
      const real *y = tangent.force;
      lattice->cost[node] = tangent.cost;
      for (int j = 0; j < 6; j++) lattice->wrench[node][j] = y[0] * B[0][j] + y[1] * B[1][j];
      node++;
    }
  }
}

/* The other actuators by H^-1 of H = sum B g B', with their gains g: y = g B' H^-1 r are the
   forces for a wrench r that are cheapest where power is quadratic and nothing has limits. */
static void lay_rows(const real *block, const fl_work *work, foil_lattice *lattice) {
  real H[6][6] = {{0}};
  memset(lattice->row, 0, sizeof lattice->row);
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    if (is_foil(a)) continue;
    for (int q = 0; q < (int)a->rows; q++)
      fl_add_square(H, work->span.effectiveness_reduced[i][q], a->secant[q]);
  }
  const real ridge = larger(NOTHING, ROUNDING) * fl_trace(H) + TINY;
  for (int j = 0; j < 6; j++) H[j][j] += ridge;
  if (!fl_factor(H)) return;
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    if (is_foil(a)) continue;
    for (int q = 0; q < (int)a->rows; q++) {
      fl_solve(H, work->span.effectiveness_reduced[i][q], lattice->row[i][q]);
      for (int j = 0; j < 6; j++) lattice->row[i][q][j] *= a->secant[q];
    }
  }
}

/* Holds a force within the limits of a set but for its direction; its size. */
static real held_force(const fl_actuator *a, const fl_set *set, real *force) {
  if (!is_plane(a)) {
    force[0] = clipped(force[0], set->force_min, set->force_max);
    return FABS(force[0]);
  }
  const real wanted = size_of(force);
  const real size = smaller(wanted, larger(set->force_max, set->force_max_reverse));
  for (int q = 0; q < 2; q++) force[q] *= size / larger(wanted, TINY);
  return size;
}

/* Forces of the other actuators at a point for a target, held within their limits, and what
   all cost there: watts as force^1.5, and MISS_WEIGHT times those of all actuators for a miss
   of one scaled wrench. */
static real cost_at_point(const real *block, const fl_work *work, const foil_lattice *lattice,
                          const real *target_reduced, const unsigned char *node, real force[][2]) {
  real cost = 0;
  real left[6]; /* of the target, by the other actuators */
  memcpy(left, target_reduced, sizeof left);
  for (int f = 0; f < lattice->foils; f++) {
    cost += lattice->cost[node[f]];
    for (int j = 0; j < 6; j++) left[j] -= lattice->wrench[node[f]][j];
  }
  real residual[6];
  memcpy(residual, left, sizeof residual);
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    const fl_set *set = work->set + i;
    real *y = force[i];
    y[0] = 0;
    y[1] = 0;
    if (is_foil(a)) continue;
    for (int q = 0; q < (int)a->rows; q++) y[q] = dot(lattice->row[i][q], left, 6);
    const real size = held_force(a, set, y);
    const real force_share = size / a->row_force_max[0];
    const real full_cost = larger(set->cost_at_max, set->cost_at_min);
    cost += full_cost * force_share * SQRT(force_share);
    for (int q = 0; q < (int)a->rows; q++) {
      for (int j = 0; j < 6; j++) residual[j] -= y[q] * work->span.effectiveness_reduced[i][q][j];
    }
  }
  return cost + MISS_WEIGHT * work->power_cost_max * SQRT(dot(residual, residual, 6));
}

/* The branch of a foil in a choice of branches, numbered in mixed radix. */
int fl_branch_of_choice(const foil_lattice *lattice, int choice, int foil) {
  for (int f = 0; f < foil; f++) choice /= lattice->branches[f];
  return choice % lattice->branches[foil];
}

/* Puts a point among the `count` cheapest ones (FL_LATTICE_STARTS,), which are in order; how many
   there are then. */
static int put_in_order(lattice_point *points, int count, const lattice_point *added) {
  int index = count;
  if (count == FL_LATTICE_STARTS) {
    index = FL_LATTICE_STARTS - 1;
    if (!(added->cost < points[index].cost)) return count;
  }
  while (index > 0 && added->cost < points[index - 1].cost) {
    points[index] = points[index - 1];
    index--;
  }
  points[index] = *added;
  if (count == FL_LATTICE_STARTS) return count;
  return count + 1;
}

/* The cheapest point of the lattice on one choice of branches, numbered in mixed radix. */
static lattice_point cheapest_of_choice(const real *block, const fl_work *work,
                                        const foil_lattice *lattice, const real *target_reduced,
                                        int choice, int points) {
  lattice_point best = {{0}, 0};
  lattice_point tried = {{0}, 0};
  for (int k = 0; k < points; k++) {
    int node_digits = k;
    for (int f = 0; f < lattice->foils; f++) {
      const int branch = fl_branch_of_choice(lattice, choice, f);
      const int node = node_digits % lattice->each;
      tried.node[f] = (unsigned char)(lattice->first[f] + branch * lattice->each + node);
      node_digits /= lattice->each;
    }
    real unused[FL_MOST][2];
    tried.cost = cost_at_point(block, work, lattice, target_reduced, tried.node, unused);
    if (k == 0 || tried.cost < best.cost) best = tried;
  }
  return best;
}

/* The cheapest point of each choice of branches that is left (`choices_left`, 0: of all), and of
   these the cheapest ones (FL_LATTICE_STARTS,); how many there are. */
int fl_cheapest_points(const real *block, const fl_work *work, const foil_lattice *lattice,
                       const real *target_reduced, const foil_choices *choices_left,
                       lattice_point *points) {
  int choices = 1;
  int points_of_choice = 1;
  for (int f = 0; f < lattice->foils; f++) {
    choices *= lattice->branches[f];
    points_of_choice *= lattice->each;
  }
  int count = 0;
  for (int choice = 0; choice < choices; choice++) {
    if (choices_left && !fl_is_choice_left(lattice, choices_left, choice)) continue;
    const lattice_point best =
        cheapest_of_choice(block, work, lattice, target_reduced, choice, points_of_choice);
    count = put_in_order(points, count, &best);
  }
  return count;
}

void fl_lay_lattice(const real *block, const fl_work *work, foil_lattice *lattice) {
  find_branches(block, work, lattice);
  lay_nodes(block, work, lattice);
  lay_rows(block, work, lattice);
}

/* Commands (n, 3) at a point for a target; the limits of the foils in `box` become the ends of the
   branches on which they lie. */
void fl_commands_of_point(const real *block, const fl_work *work, const foil_lattice *lattice,
                          const real *target_reduced, const lattice_point *point, fl_box *box,
                          real command[][3]) {
  real force[FL_MOST][2];
  cost_at_point(block, work, lattice, target_reduced, point->node, force);
  fl_commands_for_forces(block, &work->box, force, work->command_previous, command);
  for (int f = 0; f < lattice->foils; f++) {
    const int node = point->node[f];
    const int branch = (node - lattice->first[f]) / lattice->each;
    const int i = lattice->foil[f];
    command[i][0] = lattice->angle[node];
    box->command_min[i][0] = lattice->edge[f][branch];
    box->command_max[i][0] = lattice->edge[f][branch + 1];
  }
}
