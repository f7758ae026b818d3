/* Sets with gaps: wide arcs, forces that cannot rest, dead bands, pods that push either way. The dual is that
   of their convex hulls. Where its answer puts an actuator into a gap, the gap is cut in two. First every gap
   is left on its nearer side, which mostly gives a good answer. Then both sides of one cut after another are
   solved, depth first; a part whose dual value proves that it is no cheaper is left out. */
#include "inner.h"

#define TICK_PARTS 60 /* of sets with gaps that are looked at where turning costs: the next tick goes on from there */
#define FLAT R(1e-3) /* half of an arc [rad] up to which its chord is the arc, to half a millionth of the radius */
#define HOLLOW R(1e-3) /* share of the largest force from which on a least force leaves a gap around rest */

/* Angle of a force from the middle of its arc. */
static real off_middle(const fl_set *set, const real *force) { return wrapped(ATAN2(force[1], force[0]) - set->middle); }

/* How far a plane's force is from all that it can give forward and in reverse. */
static real between_ways(const fl_actuator *a, const fl_set *set, const real *force, real size) {
  real angle = off_middle(set, force), ends[2] = {set->high, set->reverse};
  if (size <= NEARLY * a->most[0]) return 0;
  for (int way = 0; way < 2; way++)
    if (FABS(wrapped(angle + way * PI)) - set->half <= CLOSE && size <= ends[way] + NEARLY * a->most[0]) return 0;
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
static real gap_of(const real *block, const fl_work *work, int i, const real *force, real largest, const real *price) {
  const fl_actuator *a = ACTUATOR(block, i);
  const fl_set *set = work->set + i;
  if (set->turn > 0 && price) return set->jumps ? PI : in_band(a, set, force);
  if (!is_plane(a)) {
    real size = FABS(force[0]), over;
    if (a->speed > 0) {
      over = (force[1] - drag_of(block, i, force[0])) / a->most[1];
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
    int ahead = undecided(block, i, set, own, &off);
    return off > CLOSE * a->most[0] ? PI : ahead ? amount : 0;
  }
  return amount;
}

static real largest_of(const real *block, real force[][2]) {
  real largest = 0;
  for (int i = 0; i < COUNT(block); i++)
    largest = MAX(largest, is_plane(ACTUATOR(block, i)) ? size_of(force[i]) : FABS(force[i][0]));
  return largest;
}

/* The actuator whose force is farthest in a gap; -1 where none is. */
int worst_gap(const real *block, const fl_work *work, real force[][2], const real *price) {
  real worst = 0, largest = largest_of(block, force);
  int which = -1;
  for (int i = 0; i < COUNT(block); i++) {
    real amount = gap_of(block, work, i, force[i], largest, price);
    if (amount > worst) worst = amount, which = i;
  }
  return which;
}

int may_have_gaps(const real *block, const fl_work *work, real force[][2]) {
  if (!work->quick) return 1;
  for (int i = 0; i < COUNT(block); i++)
    if (is_plane(ACTUATOR(block, i)) && size_of(force[i]) < R(0.98) * work->set[i].low) return 1;
  return 0;
}

/* The side of a gap on which a force is rather. */
int nearer_side(const real *block, int i, const fl_set *set, const real *force) {
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
    set->low_cost = cost_at(block, i, set->flipped ? -a->band : a->band);
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
  const real off = wrapped(angle - set->middle);
  const int is_on_chord = set->low > 0 && set->half < PI / 2 && FABS(off) < R(0.8) * set->half;
  if (is_on_chord) {
    const real from = side < 0 ? -set->half : off;
    const real to = side < 0 ? off : set->half;
    set->middle = wrapped(set->middle + (from + to) / 2);
    set->half = (to - from) / 2;
    set->at = set->middle + wrapped(set->at - set->middle);
    return;
  }
  if (set->half >= PI)
    set->middle = wrapped(angle + (side > 0 ? 0 : PI));
  else
    set->middle = wrapped(set->middle + side * set->half / 2);
  set->half /= 2;
  set->at = set->middle + wrapped(set->at - set->middle);
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
  const real cost = cost_at(block, i, edge);
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
void narrow(const real *block, int i, fl_set *set, const real *force, int side) {
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
  set_up(block, i, set);
}

/* Remembers a cut of the set of an actuator by its force; 0 where there are too many. */
fl_node *cut_at(const real *block, fl_work *work, int *depth, int cut, const real *force) {
  if (*depth >= FL_DEPTH_OF(COUNT(block))) return 0;
  fl_node *node = work->node + (*depth)++;
  node->before = work->set[cut], node->cut = cut, node->both = 0;
  node->force[0] = force[0], node->force[1] = force[1];
  return node;
}

void take_side(const real *block, fl_work *work, const fl_node *node, int side) {
  work->set[node->cut] = node->before;
  narrow(block, node->cut, work->set + node->cut, node->force, side);
  sums_of(block, work);
}

/* Goes back to the last cut whose other side was not taken; 0 where there is none. */
fl_node *last_open(const real *block, fl_work *work, int *depth) {
  for (; *depth > 0; --*depth) {
    fl_node *node = work->node + *depth - 1;
    work->set[node->cut] = node->before;
    if (!node->both) {
      node->both = 1;
      return node;
    }
  }
  sums_of(block, work);
  return 0;
}

/* Whether the smoothed answer of an arc has a force that is smaller than any in it. */
static int is_hollow(const real *block, int i, const fl_set *set, const real *force) {
  return is_plane(ACTUATOR(block, i)) && set->turn == 0 && set->half <= NARROW && size_of(force) < R(0.9) * set->low;
}

static int any_hollow(const real *block, const fl_work *work) {
  for (int i = 0; i < COUNT(block); i++)
    if (is_hollow(block, i, work->set + i, work->now->force[i])) return 1;
  return 0;
}

/* Freezes a plane at its least force, in the direction of a force or next to it in its arc. */
static void freeze_at_least(const real *block, int i, fl_set *set, const real *force) {
  real off = CLIP(off_middle(set, force), -set->half, set->half);
  real least[2] = {set->low * COS(set->middle + off), set->low * SIN(set->middle + off)};
  freeze(block, i, set, least);
}

/* Remembers an answer without a gap; whether one with a gap could still be cheaper. */
static int keep(const real *block, fl_work *work, const real *target, int status, int gap, real *best) {
  real value = work->now->value;
  if (status == FL_MET && gap < 0 && !any_hollow(block, work)) {
    if (work->drags)
      place(block, work, target, best);
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
    real largest = largest_of(block, (real(*)[2])s->force);
    int gap = worst_gap(block, work, (real(*)[2])s->force, s->price);
    if (!keep(block, work, target, status, gap, best)) return;
    for (int i = 0; i < COUNT(block); i++) {
      fl_set *set = work->set + i;
      const real *force = s->force[i];
      int hollow = is_hollow(block, i, set, force);
      if (!hollow && !(gap_of(block, work, i, force, largest, s->price) > 0)) continue;
      if (hollow || (is_plane(ACTUATOR(block, i)) && set->turn == 0 && size_of(force) < R(0.98) * set->low)) {
        freeze_at_least(block, i, set, force);
      } else
        narrow(block, i, set, force, nearer_side(block, i, set, force));
    }
    sums_of(block, work);
    memcpy(price, s->price, sizeof price);
    status = newton(block, work, target, price, STEPS_AT_KINK);
  }
}

/* Solves both sides of a cut from the prices so far and stays at the cheaper one. */
static int cheaper_side(const real *block, fl_work *work, const real *target, fl_node *node) {
  real begin[6], price[2][6], value[2];
  int status[2], side = nearer_side(block, node->cut, &node->before, node->force);
  memcpy(begin, work->now->price, sizeof begin);
  for (int k = 0; k < 2; k++, side = -side) {
    take_side(block, work, node, side);
    status[k] = newton(block, work, target, begin, STEPS_AT_KINK);
    value[k] = status[k] == FL_BEYOND ? R(1e30) : work->now->value;
    memcpy(price[k], work->now->price, sizeof price[k]);
  }
  int first = value[1] < value[0]; /* the side is the first one's again */
  node->first = first ? -side : side;
  node->score[0] = value[!first];
  memcpy(node->price, price[!first], sizeof node->price);
  if (first) return status[1];
  take_side(block, work, node, side);
  return newton(block, work, target, price[0], STEPS_AT_KINK);
}

/* Least power for a target at whose prices some force is in a gap: forces in work->best, and the power [W] that
   no forces in the sets undercut; 0 where no part meets the target. */
int least_power(const real *block, fl_work *work, const real *target, int status, real *value) {
  real best = R(1e30), bound = R(1e30), price[6];
  int depth = 0, parts = 0, root = status;
  const int most_parts = work->turns ? MIN(TICK_PARTS, work->most_parts) : work->most_parts;
  fl_node *node;
  memcpy(work->kept, work->set, sizeof work->kept);
  memcpy(price, work->now->price, sizeof price);
  if (work->drags) {
    place_starts(block, work, target, &best);
    stand_at(block, work, target, price);
  }
  dive(block, work, target, status, &best);
  take_sets(block, work, work->kept);
  stand_at(block, work, target, price);
  for (status = root;;) {
    fl_state *s = work->now;
    real own = s->value;
    int gap = worst_gap(block, work, s->force, s->price), open = keep(block, work, target, status, gap, &best);
    if (open && gap < 0) { /* hollow: at their least forces */
      fl_set before[FL_MOST];
      memcpy(before, work->set, sizeof before);
      dive(block, work, target, status, &best);
      memcpy(work->set, before, sizeof before);
      bound = MIN(bound, own), status = FL_BEYOND, open = 0;
    }
    if (open && ACTUATOR(block, gap)->speed == 0 && parts < most_parts && (node = cut_at(block, work, &depth, gap, s->force[gap]))) {
      status = cheaper_side(block, work, target, node), parts += 2;
      continue;
    }
    work->ended |= open && ACTUATOR(block, gap)->speed == 0;
    if (status != FL_BEYOND) bound = MIN(bound, own);
    while ((node = last_open(block, work, &depth)) && !(node->score[0] < best * (1 - CLOSE)))
      bound = MIN(bound, node->score[0]);
    if (!node) break;
    take_side(block, work, node, -node->first);
    status = newton(block, work, target, node->price, STEPS_AT_KINK);
  }
  take_sets(block, work, work->kept);
  *value = bound;
  return best < R(1e30);
}
