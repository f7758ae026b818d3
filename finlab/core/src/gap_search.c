/* The search for least power where sets have gaps: depth first, by the bounds that the dual gives on each side of a cut. */
#include "internal.h"

/* Whether the smoothed answer of an arc has a force that is smaller than any in it. */
static int is_hollow(const real *block, int i, const fl_set *set, const real *force) {
  return is_plane(ACTUATOR(block, i)) && set->turn == 0 && set->half <= NARROW && size_of(force) < R(0.9) * set->low;
}

static int any_hollow(const real *block, const fl_work *work) {
  for (int i = 0; i < COUNT(block); i++)
    if (is_hollow(block, i, work->set + i, work->now->force[i])) return 1;
  return 0;
}

/* Remembers an answer without a gap; whether one with a gap could still be cheaper. */
static int keep(const real *block, fl_work *work, const real *target, int status, int gap, real *best) {
  real value = work->now->value;
  if (status == FL_MET && gap < 0 && !any_hollow(block, work)) {
    if (work->drags)
      fl_improve_commands(block, work, target, best);
    else if (value < *best)
      *best = value, memcpy(work->best, work->now->force, sizeof work->best);
    return 0;
  }
  return (status == FL_MET || (status == FL_STUCK && gap >= 0)) && value < *best * (1 - CLOSE);
}

/* All gaps left on their nearer sides; forces that cannot rest keep their direction. */
static void dive(const real *block, fl_work *work, const real *target, int status, real *best) {
  real price[6];
  for (int round = 0; round < ROUNDS; round++) {
    const fl_state *s = work->now;
    real largest = fl_largest_force(block, (real(*)[2])s->force);
    int gap = fl_worst_gap(block, work, (real(*)[2])s->force, s->price);
    if (!keep(block, work, target, status, gap, best)) return;
    for (int i = 0; i < COUNT(block); i++) {
      fl_set *set = work->set + i;
      const real *force = s->force[i];
      int hollow = is_hollow(block, i, set, force);
      if (!hollow && !(fl_gap_of(block, work, i, force, largest, s->price) > 0)) continue;
      if (hollow || (is_plane(ACTUATOR(block, i)) && set->turn == 0 && size_of(force) < R(0.98) * set->low)) {
        fl_fix_at_least_force(block, i, set, force);
      } else
        fl_narrow_set(block, i, set, force, fl_nearer_side(block, i, set, force));
    }
    fl_prepare_sets(block, work);
    memcpy(price, s->price, sizeof price);
    status = fl_dual_newton(block, work, target, price, STEPS_AT_KINK);
  }
}

/* Solves both sides of a cut from the prices so far and stays at the cheaper one. */
static int cheaper_side(const real *block, fl_work *work, const real *target, fl_node *node) {
  real begin[6], price[2][6], value[2];
  int status[2], side = fl_nearer_side(block, node->cut, &node->before, node->force);
  memcpy(begin, work->now->price, sizeof begin);
  for (int k = 0; k < 2; k++, side = -side) {
    fl_take_side(block, work, node, side);
    status[k] = fl_dual_newton(block, work, target, begin, STEPS_AT_KINK);
    value[k] = status[k] == FL_BEYOND ? R(1e30) : work->now->value;
    memcpy(price[k], work->now->price, sizeof price[k]);
  }
  int first = value[1] < value[0]; /* the side is the first one's again */
  node->first = first ? -side : side;
  node->score[0] = value[!first];
  memcpy(node->price, price[!first], sizeof node->price);
  if (first) return status[1];
  fl_take_side(block, work, node, side);
  return fl_dual_newton(block, work, target, price[0], STEPS_AT_KINK);
}

/* Least power for a target at whose prices some force is in a gap: forces in work->best, and the power [W] that
   no forces in the sets undercut; 0 where no part meets the target. */
int fl_search_gaps(const real *block, fl_work *work, const real *target, int status, real *value) {
  real best = R(1e30), bound = R(1e30), price[6];
  int depth = 0, parts = 0, root = status;
  const int most_parts = work->turns ? MIN(work->settings.tick_parts, work->settings.most_parts) : work->settings.most_parts;
  fl_node *node;
  memcpy(work->kept, work->set, sizeof work->kept);
  memcpy(price, work->now->price, sizeof price);
  if (work->drags) {
    fl_improve_from_starts(block, work, target, &best);
    fl_dual_start(block, work, target, price);
  }
  dive(block, work, target, status, &best);
  fl_restore_sets(block, work, work->kept);
  fl_dual_start(block, work, target, price);
  for (status = root;;) {
    fl_state *s = work->now;
    real own = s->value;
    int gap = fl_worst_gap(block, work, s->force, s->price), open = keep(block, work, target, status, gap, &best);
    if (open && gap < 0) { /* hollow: at their least forces */
      fl_set before[FL_MOST];
      memcpy(before, work->set, sizeof before);
      dive(block, work, target, status, &best);
      memcpy(work->set, before, sizeof before);
      bound = MIN(bound, own), status = FL_BEYOND, open = 0;
    }
    if (open && ACTUATOR(block, gap)->speed == 0 && parts < most_parts && (node = fl_cut_set(block, work, &depth, gap, s->force[gap]))) {
      status = cheaper_side(block, work, target, node), parts += 2;
      continue;
    }
    work->ended |= open && ACTUATOR(block, gap)->speed == 0;
    if (status != FL_BEYOND) bound = MIN(bound, own);
    while ((node = fl_last_open_cut(block, work, &depth)) && !(node->score[0] < best * (1 - CLOSE)))
      bound = MIN(bound, node->score[0]);
    if (!node) break;
    fl_take_side(block, work, node, -node->first);
    status = fl_dual_newton(block, work, target, node->price, STEPS_AT_KINK);
  }
  fl_restore_sets(block, work, work->kept);
  *value = bound;
  return best < R(1e30);
}

/* Commands that give work->aim, from what Newton's method came to; 0 where none are found. */
int fl_answer_with_drag(const real *block, fl_work *work, const real *target, int status, fl_answer *out) {
  real value = work->now->value, bound;
  memcpy(out->inner, work->now->price, sizeof out->inner);
  if (!(status == FL_MET && fl_are_forces_sure(block, work))) {
    if (!fl_search_gaps(block, work, target, status, &bound)) return 0;
    if (status != FL_MET) { /* prices at the commands may prove more */
      fl_dual_start(block, work, target, work->near);
      if (work->state->value > value) memcpy(out->inner, work->near, sizeof out->inner);
    }
  }
  memcpy(out->command, work->placed, (size_t)COUNT(block) * sizeof out->command[0]);
  return out->placed = 1;
}
