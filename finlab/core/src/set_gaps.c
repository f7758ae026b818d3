/* Sets with gaps: wide arcs, forces that cannot rest, dead bands, pods that push either way.
   The dual is that of their convex hulls. Where its answer puts an actuator into a gap, the
   gap is cut in two. First every gap is left on its nearer side, which mostly gives a good
   answer. Then both sides of one cut after another are solved, depth first; a part whose
   dual value proves that it is no cheaper is left out. */
#include "internal.h"

/* Half of an arc [rad] up to which its chord is the arc, to half a millionth of the radius. */
#define FLAT R(1e-3)
/* share of the largest force from which a least force leaves a gap at rest */
#define HOLLOW R(1e-3)
#define ON_CHORD R(0.8) /* share of a half arc within which an arc is cut where the force lies */

/* Angle of a force from the middle of its arc. */
static real angle_from_middle(const fl_set *set, const real *force) {
  return fl_wrap_angle(ATAN2(force[1], force[0]) - set->middle);
}

/* Whether a force of a size and at an angle from a direction is one of the sector that a
   plane gives around it. */
static int is_in_sector(const fl_set *set, real angle, real size, real largest, real rounding) {
  return FABS(fl_wrap_angle(angle)) - set->half <= CLOSE && size <= largest + rounding;
}

/* How far a plane's force is from all that it can give forward and in reverse. */
static real gap_between_ways(const fl_actuator *a, const fl_set *set, const real *force,
                             real size) {
  const real angle = angle_from_middle(set, force);
  const real rounding = NEARLY * a->most[0];
  if (size <= rounding) return 0;
  if (is_in_sector(set, angle, size, set->high, rounding)) return 0;
  if (is_in_sector(set, angle + PI, size, set->reverse, rounding)) return 0;
  return PI;
}

/* How far into its dead band, as a share, a plane's force is that its set could take out of
   it; 0 where it is not. */
static real gap_in_band(const fl_actuator *a, const fl_set *set, const real *force) {
  const real size = size_of(force);
  if (!(a->band > 0)) return 0;
  if (size >= a->band * (1 - NOTHING) || size <= NOTHING * a->most[0]) return 0;
  const int pushes = set->high > 0 || set->reverse > 0;
  if (set->low >= a->band || !pushes) return 0;
  return 1 - size / a->band;
}

/* The same of a line, 1 or 0; of a foil how far its drag is above that of its lift. */
static real gap_of_line(const real *block, const fl_actuator *a, int i, const fl_set *set,
                        const real *force) {
  if (a->speed > 0) {
    const real above = (force[1] - fl_drag_of_lift(block, i, force[0])) / a->most[1];
    if (above > HOLLOW) return above;
    return 0;
  }
  const real size = FABS(force[0]);
  return size < a->band * (1 - NOTHING) && size > NOTHING * a->most[0] && set->low < set->high;
}

/* How far a force is in a gap of its set; 0 where it is not. One that comes from multipliers
   is in one where it is between what an actuator gives forward and in reverse. */
real fl_gap_of(const real *block, const fl_work *work, int i, const real *force, real largest,
               const real *lambda) {
  const fl_actuator *a = ACTUATOR(block, i);
  const fl_set *set = work->set + i;
  if (set->turn > 0 && lambda) {
    if (set->jumps) return PI;
    return gap_in_band(a, set, force);
  }
  if (!is_plane(a)) return gap_of_line(block, a, i, set, force);

  const real size = size_of(force);
  real amount = gap_in_band(a, set, force);
  if (set->reverse > 0 && !lambda) return fl_larger(gap_between_ways(a, set, force, size), amount);
  const int is_hollow = set->low > HOLLOW * largest;
  if (!lambda && set->half > FLAT && is_hollow && size < set->low * (1 - NEARLY))
    amount += 1 - size / set->low;
  if (set->half > NARROW) {
    const real beyond_end = FABS(angle_from_middle(set, force)) - set->half;
    if (beyond_end > CLOSE && size > NEARLY * a->most[0]) amount += beyond_end;
    if (is_hollow && size < SHORTER * set->low) amount += 1 - size / set->low;
  }
  if (set->reverse > 0) {
    real s[2];
    real between;
    own_price(work, i, lambda, s);
    const int is_ahead = fl_undecided(block, i, set, s, &between);
    if (between > CLOSE * a->most[0]) return PI;
    if (!is_ahead) return 0;
  }
  return amount;
}

real fl_largest_force(const real *block, real force[][2]) {
  real largest = 0;
  for (int i = 0; i < COUNT(block); i++) {
    real size = FABS(force[i][0]);
    if (is_plane(ACTUATOR(block, i))) size = size_of(force[i]);
    largest = fl_larger(largest, size);
  }
  return largest;
}

/* The actuator whose force is farthest in a gap; -1 where none is. */
int fl_worst_gap(const real *block, const fl_work *work, real force[][2], const real *lambda) {
  const real largest = fl_largest_force(block, force);
  real worst = 0;
  int worst_actuator = -1;
  for (int i = 0; i < COUNT(block); i++) {
    const real amount = fl_gap_of(block, work, i, force[i], largest, lambda);
    if (amount > worst) {
      worst = amount;
      worst_actuator = i;
    }
  }
  return worst_actuator;
}

int fl_may_have_gaps(const real *block, const fl_work *work, real force[][2]) {
  if (!work->quick) return 1;
  for (int i = 0; i < COUNT(block); i++) {
    const int is_short = size_of(force[i]) < SHORTER * work->set[i].low;
    if (is_plane(ACTUATOR(block, i)) && is_short) return 1;
  }
  return 0;
}

static int sign_of(int is_positive) {
  if (is_positive) return 1;
  return -1;
}

/* The side (-1, 1) of a gap on which a force is rather. */
int fl_nearer_side(const real *block, int i, const fl_set *set, const real *force) {
  const fl_actuator *a = ACTUATOR(block, i);
  if (a->speed > 0) return sign_of(!(force[0] < (set->low + set->high) / 2));
  if (!is_plane(a)) return sign_of(FABS(force[0]) > a->band / 2);
  if (gap_in_band(a, set, force) > 0) return sign_of(size_of(force) > a->band / 2);
  if (set->half >= PI && set->reverse == 0 && !set->jumps) return 1;
  const real angle = angle_from_middle(set, force);
  if (set->reverse > 0) return sign_of(!(COS(angle) < 0));
  if (set->jumps) return sign_of(!(ATAN2(force[1], force[0]) < set->cut));
  return sign_of(!(angle < 0));
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

/* Keeps of a plane with a dead band what is beyond the band on the side of a force (1), or
   all else (-1). */
static void narrow_by_band(const real *block, int i, fl_set *set, const real *force, int side) {
  const fl_actuator *a = ACTUATOR(block, i);
  const int points_back = COS(angle_from_middle(set, force)) < 0;
  const int is_back = set->reverse > 0 && (set->high == 0 || points_back);
  if (side > 0) {
    if (is_back) turn_round(set);
    set->reverse = 0;
    set->low = a->band;
    real edge = a->band;
    if (set->flipped) edge = -edge;
    set->low_cost = fl_power_of_force(block, i, edge);
    return;
  }
  if (is_back)
    set->reverse = 0;
  else {
    set->high = 0;
    set->high_cost = set->low_cost;
  }
}

/* Keeps one part of an arc: towards smaller (-1) or larger angles (1), of a full circle that
   away from or around a force. The arc is cut into halves, where its answer jumps between
   its two answers, and where a force lies on the chord of the least ones at its angle, as
   the best one is mostly there. */
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
  const real cut = fl_wrap_angle(angle - set->middle);
  const int is_on_chord =
      set->low > 0 && set->half < PI / 2 && FABS(cut) < ON_CHORD * set->half;
  if (is_on_chord) {
    real from = -set->half;
    real to = set->half;
    if (side < 0)
      to = cut;
    else
      from = cut;
    set->middle = fl_wrap_angle(set->middle + (from + to) / 2);
    set->half = (to - from) / 2;
    set->at = set->middle + fl_wrap_angle(set->at - set->middle);
    return;
  }
  if (set->half >= PI) {
    real turned = PI;
    if (side > 0) turned = 0;
    set->middle = fl_wrap_angle(angle + turned);
  } else
    set->middle = fl_wrap_angle(set->middle + (real)side * set->half / 2);
  set->half /= 2;
  set->at = set->middle + fl_wrap_angle(set->at - set->middle);
}

/* Keeps of a line what is beyond its dead band on the side of a force (1), or all else (-1);
   of a foil more or less. */
static void narrow_line(const real *block, int i, fl_set *set, const real *force, int side) {
  const fl_actuator *a = ACTUATOR(block, i);
  real edge = 0;
  int is_above = (side > 0) == (force[0] > 0);
  if (a->speed > 0) {
    edge = force[0];
    is_above = side > 0;
  } else if (side > 0) {
    edge = a->band;
    if (!(force[0] > 0)) edge = -edge;
  }
  const real cost = fl_power_of_force(block, i, edge);
  if (is_above) {
    set->low = edge;
    set->low_cost = cost;
  } else {
    set->high = edge;
    set->high_cost = cost;
  }
}

/* Cuts a set by a force and keeps one side of its gap: of a plane that pushes either way
   reverse (-1) or ahead (1), else as the functions above say. */
void fl_narrow_set(const real *block, int i, fl_set *set, const real *force, int side) {
  const fl_actuator *a = ACTUATOR(block, i);
  if (!is_plane(a))
    narrow_line(block, i, set, force, side);
  else if (gap_in_band(a, set, force) > 0)
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
  fl_node *node = work->node + *depth;
  ++*depth;
  node->before = work->set[cut];
  node->cut = cut;
  node->both = 0;
  node->force[0] = force[0];
  node->force[1] = force[1];
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
  const real angle = fl_clipped(angle_from_middle(set, force), -set->half, set->half);
  const real direction = set->middle + angle;
  const real least[2] = {set->low * COS(direction), set->low * SIN(direction)};
  fl_fix_force(block, i, set, least);
}
