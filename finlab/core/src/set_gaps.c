/* Sets with gaps: wide arcs, forces that cannot rest, dead bands, pods that push either way. The dual is that
   of their convex hulls. Where its answer puts an actuator into a gap, the gap is cut in two. First every gap
   is left on its nearer side, which mostly gives a good answer. Then both sides of one cut after another are
   solved, depth first; a part whose dual value proves that it is no cheaper is left out. */
#include "internal.h"

#define FLAT R(1e-3) /* half of an arc [rad] up to which its chord is the arc, to half a millionth of the radius */
#define HOLLOW R(1e-3) /* share of the largest force from which on a least force leaves a gap around rest */

/* Angle of a force from the middle of its arc. */
static real off_middle(const fl_set *set, const real *force) { return fl_wrap_angle(ATAN2(force[1], force[0]) - set->middle); }

/* How far a plane's force is from all that it can give forward and in reverse. */
static real between_ways(const fl_actuator *a, const fl_set *set, const real *force, real size) {
  real angle = off_middle(set, force), ends[2] = {set->high, set->reverse};
  if (size <= NEARLY * a->most[0]) return 0;
  for (int way = 0; way < 2; way++)
    if (FABS(fl_wrap_angle(angle + (real)way * PI)) - set->half <= CLOSE && size <= ends[way] + NEARLY * a->most[0]) return 0;
  return PI;
}

/* How far into its dead band, as a share, a plane's force is that its set could take out of it; 0 where it is not. */
static real in_band(const fl_actuator *a, const fl_set *set, const real *force) {
  const real size = size_of(force);
  if (!(a->band > 0) || size >= a->band * (1 - NOTHING) || size <= NOTHING * a->most[0]) return 0;
  if (set->low >= a->band || !(set->high > 0 || set->reverse > 0)) return 0;
  return 1 - size / a->band;
}

/* How far a force is in a gap of its set; 0 where it is not. One that comes from prices is in one where it is
   between what an actuator gives forward and in reverse. */
real fl_gap_of(const real *block, const fl_work *work, int i, const real *force, real largest, const real *price) {
  const fl_actuator *a = ACTUATOR(block, i);
  const fl_set *set = work->set + i;
  if (set->turn > 0 && price) return set->jumps ? PI : in_band(a, set, force);
  if (!is_plane(a)) {
    real size = FABS(force[0]), over;
    if (a->speed > 0) {
      over = (force[1] - fl_drag_of_lift(block, i, force[0])) / a->most[1];
      return over > HOLLOW ? over : 0;
    }
    return size < a->band * (1 - NOTHING) && size > NOTHING * a->most[0] && set->low < set->high;
  }
  real size = size_of(force), amount = in_band(a, set, force);
  if (set->reverse > 0 && !price) return MAX(between_ways(a, set, force, size), amount);
  if (!price && set->half > FLAT && set->low > HOLLOW * largest && size < set->low * (1 - NEARLY)) amount += 1 - size / set->low;
  if (set->half > NARROW) {
    real off = FABS(off_middle(set, force)) - set->half;
    if (off > CLOSE && size > NEARLY * a->most[0]) amount += off;
    if (set->low > HOLLOW * largest && size < R(0.98) * set->low) amount += 1 - size / set->low;
  }
  if (set->reverse > 0) {
    real own[2], off;
    own_price(work, i, price, own);
    int ahead = fl_undecided(block, i, set, own, &off);
    return off > CLOSE * a->most[0] ? PI : ahead ? amount : 0;
  }
  return amount;
}

real fl_largest_force(const real *block, real force[][2]) {
  real largest = 0;
  for (int i = 0; i < COUNT(block); i++)
    largest = MAX(largest, is_plane(ACTUATOR(block, i)) ? size_of(force[i]) : FABS(force[i][0]));
  return largest;
}

/* The actuator whose force is farthest in a gap; -1 where none is. */
int fl_worst_gap(const real *block, const fl_work *work, real force[][2], const real *price) {
  real worst = 0, largest = fl_largest_force(block, force);
  int which = -1;
  for (int i = 0; i < COUNT(block); i++) {
    real amount = fl_gap_of(block, work, i, force[i], largest, price);
    if (amount > worst) worst = amount, which = i;
  }
  return which;
}

int fl_may_have_gaps(const real *block, const fl_work *work, real force[][2]) {
  if (!work->quick) return 1;
  for (int i = 0; i < COUNT(block); i++)
    if (is_plane(ACTUATOR(block, i)) && size_of(force[i]) < R(0.98) * work->set[i].low) return 1;
  return 0;
}

/* The side of a gap on which a force is rather. */
int fl_nearer_side(const real *block, int i, const fl_set *set, const real *force) {
  const fl_actuator *a = ACTUATOR(block, i);
  if (a->speed > 0) return force[0] < (set->low + set->high) / 2 ? -1 : 1;
  if (!is_plane(a)) return FABS(force[0]) > a->band / 2 ? 1 : -1;
  if (in_band(a, set, force) > 0) return size_of(force) > a->band / 2 ? 1 : -1;
  if (set->half >= PI && set->reverse == 0 && !set->jumps) return 1;
  real off = off_middle(set, force);
  if (set->jumps && set->reverse == 0) return ATAN2(force[1], force[0]) < set->cut ? -1 : 1;
  return (set->reverse > 0 ? COS(off) : off) < 0 ? -1 : 1;
}

/* Turns a set round: what it pushed in reverse is what it pushes now. */
static void turn_round(fl_set *set) {
  set->high = set->reverse;
  set->high_cost = set->reverse_cost;
  set->reverse = 0;
  set->middle += PI;
  set->at += PI;
  set->flipped = 1;
}

/* Keeps of a plane with a dead band what is beyond the band on the side of a force (1), or all else (-1). */
static void narrow_by_band(const real *block, int i, fl_set *set, const real *force, int side) {
  const fl_actuator *a = ACTUATOR(block, i);
  const int is_back = set->reverse > 0 && (set->high == 0 || COS(off_middle(set, force)) < 0);
  if (side > 0) {
    if (is_back) turn_round(set);
    set->reverse = 0;
    set->low = a->band;
    set->low_cost = fl_power_of_force(block, i, set->flipped ? -a->band : a->band);
    return;
  }
  if (is_back)
    set->reverse = 0;
  else {
    set->high = 0;
    set->high_cost = set->low_cost;
  }
}

/* Keeps one part of an arc: towards smaller (-1) or larger angles (1), of a full circle that away from or around a
   force. The arc is cut into halves, where its answer jumps between its two answers, and where a force lies on the chord
   of the least ones at its angle, as the best one is mostly there. */
static void narrow_by_angle(fl_set *set, const real *force, int side) {
  real low = set->middle - set->half;
  real high = set->middle + set->half;
  if (set->turn > 0 && set->half >= PI) {
    low = set->at - PI;
    high = set->at + PI;
  }
  if (set->jumps) {
    if (side < 0)
      high = set->cut;
    else
      low = set->cut;
    set->middle = (low + high) / 2;
    set->half = (high - low) / 2;
    return;
  }
  const real angle = ATAN2(force[1], force[0]);
  const real off = fl_wrap_angle(angle - set->middle);
  const int is_on_chord = set->low > 0 && set->half < PI / 2 && FABS(off) < R(0.8) * set->half;
  if (is_on_chord) {
    const real from = side < 0 ? -set->half : off;
    const real to = side < 0 ? off : set->half;
    set->middle = fl_wrap_angle(set->middle + (from + to) / 2);
    set->half = (to - from) / 2;
    set->at = set->middle + fl_wrap_angle(set->at - set->middle);
    return;
  }
  if (set->half >= PI)
    set->middle = fl_wrap_angle(angle + (side > 0 ? 0 : PI));
  else
    set->middle = fl_wrap_angle(set->middle + (real)side * set->half / 2);
  set->half /= 2;
  set->at = set->middle + fl_wrap_angle(set->at - set->middle);
}

/* Keeps of a line what is beyond its dead band on the side of a force (1), or all else (-1); of a foil more or less. */
static void narrow_line(const real *block, int i, fl_set *set, const real *force, int side) {
  const fl_actuator *a = ACTUATOR(block, i);
  real edge = 0;
  int is_above = (side > 0) == (force[0] > 0);
  if (a->speed > 0) {
    edge = force[0];
    is_above = side > 0;
  } else if (side > 0)
    edge = force[0] > 0 ? a->band : -a->band;
  const real cost = fl_power_of_force(block, i, edge);
  if (is_above) {
    set->low = edge;
    set->low_cost = cost;
  } else {
    set->high = edge;
    set->high_cost = cost;
  }
}

/* Cuts a set by a force and keeps one side of its gap: of a plane that pushes either way reverse (-1) or ahead (1), else
   as the functions above say. */
void fl_narrow_set(const real *block, int i, fl_set *set, const real *force, int side) {
  const fl_actuator *a = ACTUATOR(block, i);
  if (!is_plane(a))
    narrow_line(block, i, set, force, side);
  else if (in_band(a, set, force) > 0)
    narrow_by_band(block, i, set, force, side);
  else if (set->reverse > 0) {
    if (side < 0) turn_round(set);
    set->reverse = 0;
  } else
    narrow_by_angle(set, force, side);
  set->jumps = 0;
  fl_prepare_set(block, i, set);
}

/* Remembers a cut of the set of an actuator by its force; 0 where there are too many. */
fl_node *fl_cut_set(const real *block, fl_work *work, int *depth, int cut, const real *force) {
  if (*depth >= FL_DEPTH_OF(COUNT(block))) return 0;
  fl_node *node = work->node + (*depth)++;
  node->before = work->set[cut], node->cut = cut, node->both = 0;
  node->force[0] = force[0], node->force[1] = force[1];
  return node;
}

void fl_take_side(const real *block, fl_work *work, const fl_node *node, int side) {
  work->set[node->cut] = node->before;
  fl_narrow_set(block, node->cut, work->set + node->cut, node->force, side);
  fl_prepare_sets(block, work);
}

/* Goes back to the last cut whose other side was not taken; 0 where there is none. */
fl_node *fl_last_open_cut(const real *block, fl_work *work, int *depth) {
  for (; *depth > 0; --*depth) {
    fl_node *node = work->node + *depth - 1;
    work->set[node->cut] = node->before;
    if (!node->both) {
      node->both = 1;
      return node;
    }
  }
  fl_prepare_sets(block, work);
  return 0;
}

/* Freezes a plane at its least force, in the direction of a force or next to it in its arc. */
void fl_fix_at_least_force(const real *block, int i, fl_set *set, const real *force) {
  real off = CLIP(off_middle(set, force), -set->half, set->half);
  real least[2] = {set->low * COS(set->middle + off), set->low * SIN(set->middle + off)};
  fl_fix_force(block, i, set, least);
}
