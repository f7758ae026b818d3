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
  return fl_wrap_angle(ATAN2(force[1], force[0]) - set->sector_center);
}

/* Whether a force of a size and at an angle from a direction is one of the sector that a
   plane gives around it, but for a rounding [N]. */
static int is_in_sector(const fl_set *set, real angle, real size, real largest, real rounding) {
  const real beyond_end = FABS(fl_wrap_angle(angle)) - set->sector_half_angle;
  return beyond_end * size <= rounding && size <= largest + rounding;
}

/* How far a plane's force is from all that it can give forward and in reverse. */
static real gap_between_ways(const real *block, int i, const fl_set *set, const real *force,
                             real size) {
  const fl_actuator *a = ACTUATOR(block, i);
  const fl_set reversed = fl_reversed_set(set);
  const real rounding = NEARLY * a->row_force_max[0];
  if (size <= rounding) return 0;
  real largest = set->force_max;
  if (is_steered(a)) largest *= fl_radius(block, i, ATAN2(force[1], force[0]));
  if (is_in_sector(set, angle_from_middle(set, force), size, largest, rounding)) return 0;
  const real from_back = angle_from_middle(&reversed, force);
  if (is_in_sector(&reversed, from_back, size, reversed.force_max, rounding)) return 0;
  return PI;
}

/* How far into its dead band, as a share, a plane's force is that its set could take out of
   it; 0 where it is not. */
static real gap_in_band(const fl_actuator *a, const fl_set *set, const real *force) {
  const real size = size_of(force);
  if (!(a->dead_band > 0)) return 0;
  if (size >= a->dead_band * (1 - NOTHING) || size <= NOTHING * a->row_force_max[0]) return 0;
  const int pushes = set->force_max > 0 || set->force_max_reverse > 0;
  if (set->force_min >= a->dead_band || !pushes) return 0;
  return 1 - size / a->dead_band;
}

/* The same of a line, 1 or 0; of a foil how far its drag is above that of its lift. */
static real gap_of_line(const real *block, const fl_actuator *a, int i, const fl_set *set,
                        const real *force) {
  if (has_arc(set)) return fl_gap_of_arc(a, set, force);
  if (is_foil(a)) {
    const real above = (force[1] - fl_drag_of_lift(block, i, force[0])) / a->row_force_max[1];
    if (above > HOLLOW) return above;
    return 0;
  }
  const real size = FABS(force[0]);
  return size < a->dead_band * (1 - NOTHING) && size > NOTHING * a->row_force_max[0] &&
         set->force_min < set->force_max;
}

/* How far a force is in a gap of its set; 0 where it is not. One that comes from multipliers
   is in one where it is between what an actuator gives forward and in reverse. */
real fl_gap_of(const real *block, const fl_work *work, int i, const real *force, real largest,
               const real *lambda) {
  const fl_actuator *a = ACTUATOR(block, i);
  const fl_set *set = work->set + i;
  if (fl_is_barred(a, set, force)) return PI;
  if (set->turn_cost > 0 && lambda) {
    if (set->has_jumped) return PI;
    return gap_in_band(a, set, force);
  }
  if (!is_plane(a)) return gap_of_line(block, a, i, set, force);

  const real size = size_of(force);
  real amount = gap_in_band(a, set, force);
  if (set->force_max_reverse > 0 && !lambda)
    return larger(gap_between_ways(block, i, set, force, size), amount);
  const int is_hollow = set->force_min > HOLLOW * largest;
  real limited_size = size;
  if (is_hollow) limited_size = fl_limited_size(block, i, set, force);
  const int is_short = is_hollow && limited_size < set->force_min * (1 - NEARLY);
  if (!lambda && set->sector_half_angle > FLAT && is_short)
    amount += 1 - limited_size / set->force_min;
  if (set->sector_half_angle > NARROW) {
    const real beyond_end = FABS(angle_from_middle(set, force)) - set->sector_half_angle;
    if (beyond_end > CLOSE && size > NEARLY * a->row_force_max[0]) amount += beyond_end;
    if (is_hollow && limited_size < SHORTER * set->force_min)
      amount += 1 - limited_size / set->force_min;
  }
  if (set->force_max_reverse > 0) {
    real s[2];
    real between;
    actuator_price(work, i, lambda, s);
#if FL_KEEPS_BUDGETS
    s[0] *= work->over_cost[i];
    s[1] *= work->over_cost[i];
#endif
    const int is_ahead = fl_undecided(block, i, set, s, &between);
    if (between > CLOSE * a->row_force_max[0]) return PI;
    if (!is_ahead) return 0;
  }
  return amount;
}

real fl_largest_force(const real *block, real force[][2]) {
  real largest = 0;
  for (int i = 0; i < COUNT(block); i++) {
    real size = FABS(force[i][0]);
    if (is_plane(ACTUATOR(block, i))) size = size_of(force[i]);
    largest = larger(largest, size);
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
  if (!work->is_convex) return 1;
  for (int i = 0; i < COUNT(block); i++) {
    const fl_set *set = work->set + i;
    if (!is_plane(ACTUATOR(block, i)) || !(set->force_min > 0)) continue;
    if (fl_limited_size(block, i, set, force[i]) < SHORTER * set->force_min) return 1;
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
  if (has_arc(set)) return fl_nearer_side_of_arc(set, force);
  if (is_foil(a)) return sign_of(!(force[0] < (set->force_min + set->force_max) / 2));
  if (!is_plane(a)) return sign_of(FABS(force[0]) > a->dead_band / 2);
  if (gap_in_band(a, set, force) > 0) return sign_of(size_of(force) > a->dead_band / 2);
  if (set->sector_half_angle >= PI && set->force_max_reverse == 0 && !set->has_jumped) return 1;
  const real angle = angle_from_middle(set, force);
  if (fl_is_barred(a, set, force)) {
    const real direction = ATAN2(force[1], force[0]);
    return sign_of(fl_wrap_angle(fl_leave_zone(a, direction) - direction) > 0);
  }
  if (set->force_max_reverse > 0) return sign_of(!(COS(angle) < 0));
  if (set->has_jumped) return sign_of(!(ATAN2(force[1], force[0]) < set->jump_angle));
  return sign_of(!(angle < 0));
}

/* Turns a set round: what it pushed in reverse is what it pushes now. */
static void turn_round(fl_set *set) {
  const fl_set reversed = fl_reversed_set(set);
  *set = reversed;
}

/* Keeps of a plane with a dead band what is beyond the band on the side of a force (1), or
   all else (-1). */
static void narrow_by_band(const real *block, int i, fl_set *set, const real *force, int side) {
  const fl_actuator *a = ACTUATOR(block, i);
  const int points_back = COS(angle_from_middle(set, force)) < 0;
  const int is_back = set->force_max_reverse > 0 && (set->force_max == 0 || points_back);
  if (side > 0) {
    if (is_back) turn_round(set);
    set->force_max_reverse = 0;
    set->force_min = a->dead_band;
    real edge = a->dead_band;
    if (set->is_flipped) edge = -edge;
    set->cost_at_min = fl_power_of_force(block, i, edge);
    return;
  }
  if (is_back)
    set->force_max_reverse = 0;
  else {
    set->force_max = 0;
    set->cost_at_max = set->cost_at_min;
  }
}

/* Keeps one part of an arc: towards smaller (-1) or larger angles (1), of a full circle that
   away from or around a force. The arc is cut into halves, where its answer jumps between
   its two answers, and where a force lies on the chord of the least ones at its angle, as
   the best one is mostly there. */
static void narrow_by_angle(fl_set *set, const real *force, int side) {
  real low = set->sector_center - set->sector_half_angle;
  real high = set->sector_center + set->sector_half_angle;
  if (set->turn_cost > 0 && set->sector_half_angle >= PI) {
    low = set->turn_origin - PI;
    high = set->turn_origin + PI;
  }
  if (set->has_jumped) {
    if (side < 0)
      high = set->jump_angle;
    else
      low = set->jump_angle;
    set->sector_center = (low + high) / 2;
    set->sector_half_angle = (high - low) / 2;
    return;
  }
  const real angle = ATAN2(force[1], force[0]);
  const real cut_angle = fl_wrap_angle(angle - set->sector_center);
  const int is_on_chord = set->force_min > 0 && set->sector_half_angle < PI / 2 &&
                          FABS(cut_angle) < ON_CHORD * set->sector_half_angle;
  if (is_on_chord) {
    real from = -set->sector_half_angle;
    real to = set->sector_half_angle;
    if (side < 0)
      to = cut_angle;
    else
      from = cut_angle;
    set->sector_center = fl_wrap_angle(set->sector_center + (from + to) / 2);
    set->sector_half_angle = (to - from) / 2;
    set->turn_origin = set->sector_center + fl_wrap_angle(set->turn_origin - set->sector_center);
    return;
  }
  if (set->sector_half_angle >= PI) {
    real turned = PI;
    if (side > 0) turned = 0;
    set->sector_center = fl_wrap_angle(angle + turned);
  } else
    set->sector_center =
        fl_wrap_angle(set->sector_center + (real)side * set->sector_half_angle / 2);
  set->sector_half_angle /= 2;
  set->turn_origin = set->sector_center + fl_wrap_angle(set->turn_origin - set->sector_center);
}

/* Keeps of a line what is beyond its dead band on the side of a force (1), or all else (-1);
   of a foil more or less. */
static void narrow_line(const real *block, int i, fl_set *set, const real *force, int side) {
  const fl_actuator *a = ACTUATOR(block, i);
  real edge = 0;
  int is_above = (side > 0) == (force[0] > 0);
  if (is_foil(a)) {
    edge = force[0];
    is_above = side > 0;
  } else if (side > 0) {
    edge = a->dead_band;
    if (!(force[0] > 0)) edge = -edge;
  }
  const real cost = fl_power_of_force(block, i, edge);
  if (is_above) {
    set->force_min = edge;
    set->cost_at_min = cost;
  } else {
    set->force_max = edge;
    set->cost_at_max = cost;
  }
}

/* Takes the ends of a set's arc out of barred zones. */
static void trim_set(const fl_actuator *a, fl_set *set) {
  if (FL_ZONES == 0 || !(a->barred_count > 0)) return;
  real low = set->sector_center - set->sector_half_angle;
  real high = set->sector_center + set->sector_half_angle;
  fl_trim_arc(a, &low, &high);
  set->sector_center = (low + high) / 2;
  set->sector_half_angle = (high - low) / 2;
}

/* Cuts a set by a force and keeps one side of its gap: of a plane that pushes either way
   reverse (-1) or ahead (1), else as the functions above say. */
void fl_narrow_set(const real *block, int i, fl_set *set, const real *force, int side) {
  const fl_actuator *a = ACTUATOR(block, i);
  if (has_arc(set))
    fl_narrow_arc(set, force, side);
  else if (!is_plane(a))
    narrow_line(block, i, set, force, side);
  else if (gap_in_band(a, set, force) > 0)
    narrow_by_band(block, i, set, force, side);
  else if (!set->has_jumped && fl_has_barred_zone(a, set)) {
    fl_narrow_by_zone(a, set, force, side);
  } else if (set->force_max_reverse > 0) {
    if (side < 0) turn_round(set);
    set->force_max_reverse = 0;
  } else {
    narrow_by_angle(set, force, side);
    trim_set(a, set);
  }
  set->has_jumped = 0;
  fl_prepare_set(block, i, set);
}

/* Remembers a cut of the set of actuator i by its force; 0 where there are too many. */
fl_cut *fl_cut_set(const real *block, fl_work *work, int *depth, int i, const real *force) {
  if (*depth >= FL_DEPTH_OF(COUNT(block))) return 0;
  fl_cut *cut = work->cut + *depth;
  ++*depth;
  cut->set_before = work->set[i];
  cut->actuator = i;
  cut->has_both_sides = 0;
  cut->force[0] = force[0];
  cut->force[1] = force[1];
  return cut;
}

void fl_take_side(const real *block, fl_work *work, const fl_cut *cut, int side) {
  work->set[cut->actuator] = cut->set_before;
  fl_narrow_set(block, cut->actuator, work->set + cut->actuator, cut->force, side);
  fl_prepare_sets(block, work);
}

/* Goes back to the last cut whose other side was not taken; 0 where there is none. */
fl_cut *fl_last_open_cut(const real *block, fl_work *work, int *depth) {
  for (; *depth > 0; --*depth) {
    fl_cut *cut = work->cut + *depth - 1;
    work->set[cut->actuator] = cut->set_before;
    if (!cut->has_both_sides) {
      cut->has_both_sides = 1;
      return cut;
    }
  }
  fl_prepare_sets(block, work);
  return 0;
}

/* Freezes a plane at its least force, in the direction of a force or next to it in its arc. */
void fl_fix_at_least_force(const real *block, int i, fl_set *set, const real *force) {
  const real angle =
      clipped(angle_from_middle(set, force), -set->sector_half_angle, set->sector_half_angle);
  const real direction = set->sector_center + angle;
  const real e[2] = {COS(direction), SIN(direction)};
  const real size = set->force_min / fl_limited_size(block, i, set, e);
  const real least[2] = {size * e[0], size * e[1]};
  fl_fix_force(block, i, set, least);
}
