/* Foils that may stall, where a wrench beyond reach is looked for in place of another.

   The sets of the dual know a foil by its table of lift, up to the largest one. Beyond that it
   stalls: it lifts less and drags more. Beyond reach that may be what comes nearest, so there the
   whole curve of lift and drag over the angles is the set: an arc of points on it, whose convex
   hull Wolfe's algorithm (nearest_point.c) asks for its farthest point. Where what it comes to lies
   in the hull and not on the curve, the arc is cut into shorter ones, as other sets with gaps are.
   At last the points are laid anew, closer and closer, around the angles that were found. */
#include "internal.h"

#define ON_ARC R(1e-3)    /* distance from the curve, over its size, that is no gap */
#define END_SHARE R(0.25) /* of an arc, that each side of a cut has at least */
#define CLOSER_POINTS 16  /* intervals of an arc around an angle that was found */
#define CLOSER_FIRST 4    /* half width of the first such arc, in intervals of the whole one */
#define CLOSER_BY R(0.25) /* half width of the next one over that of the last one */
/* Share of a half width within which an angle has come to rest, so that the next arc is shorter. */
#define NEAR_MIDDLE R(0.75)

/* Lays the points of an arc at angles from `low` to `high` [rad], in so many intervals. */
static void lay_points(const real *block, int i, real low, real high, int intervals, fl_arc *arc) {
  for (int k = 0; k <= intervals; k++) {
    fl_tangent tangent;
    arc->angle[k] = low + (high - low) * (real)k / (real)intervals;
    fl_foil_at(block, i, arc->angle[k], &tangent);
    memcpy(arc->force[k], tangent.force, sizeof arc->force[k]);
  }
}

/* Makes the sets of foils the arcs of all their angles: of the first FL_ARCS that work. */
void fl_lay_arcs(const real *block, fl_work *work) {
  int arcs = 0;
  for (int i = 0; i < COUNT(block) && arcs < FL_ARCS; i++) {
    if (!is_foil(ACTUATOR(block, i)) || work->span.is_lost[i]) continue;
    fl_arc *arc = work->arc + arcs;
    fl_set *set = work->set + i;
    lay_points(block, i, work->box.command_min[i][0], work->box.command_max[i][0], FL_ARC_POINTS,
               arc);
    set->arc = arc;
    set->arc_first = 0;
    set->arc_last = FL_ARC_POINTS;
    arcs++;
  }
}

/* The force of an arc that is worth most at a price. */
void fl_farthest_on_arc(const fl_set *set, const real *price, wide *force) {
  int farthest = set->arc_first;
  real most = -LARGEST_NUMBER;
  for (int k = set->arc_first; k <= set->arc_last; k++) {
    const real worth = dot(price, set->arc->force[k], 2);
    if (!(worth > most)) continue;
    most = worth;
    farthest = k;
  }
  force[0] = set->arc->force[farthest][0];
  force[1] = set->arc->force[farthest][1];
}

typedef struct {
  int interval;  /* in which the nearest point lies */
  real share;    /* of it, from its first point on */
  real distance; /* [N] */
} arc_place;

/* The place on an arc, straight between its points, that is nearest to a force. */
static arc_place nearest_place(const fl_set *set, const real *force) {
  arc_place nearest = {set->arc_first, 0, LARGEST_NUMBER};
  for (int k = set->arc_first; k < set->arc_last; k++) {
    const real *from = set->arc->force[k];
    const real *to = set->arc->force[k + 1];
    const real along[2] = {to[0] - from[0], to[1] - from[1]};
    const real ahead[2] = {force[0] - from[0], force[1] - from[1]};
    const real length_squared = larger(dot(along, along, 2), TINY);
    const real share = clipped(dot(along, ahead, 2) / length_squared, 0, 1);
    const real off[2] = {ahead[0] - share * along[0], ahead[1] - share * along[1]};
    const real distance = size_of(off);
    if (!(distance < nearest.distance)) continue;
    nearest.interval = k;
    nearest.share = share;
    nearest.distance = distance;
  }
  return nearest;
}

/* How far a force is from an arc, over the largest force of the foil; 0 where it is on it. */
real fl_gap_of_arc(const fl_actuator *a, const fl_set *set, const real *force) {
  if (set->arc_last - set->arc_first < 2) return 0;
  const real gap = nearest_place(set, force).distance / size_of(a->row_force_max);
  if (gap > ON_ARC) return gap;
  return 0;
}

/* Which point of an arc cuts it by a force. */
static int point_of_cut(const fl_set *set, const real *force) {
  const arc_place nearest = nearest_place(set, force);
  const real points = (real)(set->arc_last - set->arc_first);
  const int least = (int)larger(1, END_SHARE * points);
  int point = nearest.interval;
  if (nearest.share > R(0.5)) point++;
  if (point < set->arc_first + least) point = set->arc_first + least;
  if (point > set->arc_last - least) point = set->arc_last - least;
  return point;
}

/* Which side (-1, 1) of a cut by a force that force is rather on. */
int fl_nearer_side_of_arc(const fl_set *set, const real *force) {
  const arc_place nearest = nearest_place(set, force);
  if (nearest.interval < point_of_cut(set, force)) return -1;
  return 1;
}

/* Keeps of an arc the angles below (-1) or above (1) a cut by a force. */
void fl_narrow_arc(fl_set *set, const real *force, int side) {
  const int point = point_of_cut(set, force);
  if (side < 0)
    set->arc_last = (unsigned char)point;
  else
    set->arc_first = (unsigned char)point;
}

/* The angle [rad] of the place on an arc that is nearest to a force. */
static real angle_on_arc(const fl_set *set, const real *force) {
  const arc_place nearest = nearest_place(set, force);
  const real *angle = set->arc->angle + nearest.interval;
  return angle[0] + nearest.share * (angle[1] - angle[0]);
}

/* Lays the arcs anew around the angles of forces, closer than before but where an angle is at an
   end. Returns the largest half width, over the range of the foil. */
real fl_lay_closer_arcs(const real *block, fl_work *work, int is_first, real force[][2]) {
  real widest = 0;
  for (int i = 0; i < COUNT(block); i++) {
    fl_set *set = work->set + i;
    if (!set->arc) continue;
    fl_arc *arc = work->arc + (set->arc - work->arc);
    const real low = work->box.command_min[i][0];
    const real high = work->box.command_max[i][0];
    const real angle = angle_on_arc(set, force[i]);
    const real from_middle = FABS(angle - arc->middle);
    const int is_at_limit = !(angle > low && angle < high);
    if (is_first)
      arc->half_width = CLOSER_FIRST * (high - low) / FL_ARC_POINTS;
    else if (from_middle < NEAR_MIDDLE * arc->half_width || is_at_limit)
      arc->half_width *= CLOSER_BY;
    arc->middle = angle;
    lay_points(block, i, larger(low, angle - arc->half_width),
               smaller(high, angle + arc->half_width), CLOSER_POINTS, arc);
    set->arc_first = 0;
    set->arc_last = CLOSER_POINTS;
    widest = larger(widest, arc->half_width / larger(high - low, TINY));
  }
  return widest;
}

/* Commands for forces, those of foils with an arc at their angles on it. */
void fl_commands_on_arcs(const real *block, const fl_work *work, real force[][2],
                         real command[][3]) {
  fl_commands_for_forces(block, &work->box, force, work->command_previous, command);
  for (int i = 0; i < COUNT(block); i++) {
    if (work->set[i].arc) command[i][0] = angle_on_arc(work->set + i, force[i]);
  }
}
