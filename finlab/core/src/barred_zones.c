/* Barred zones of a pod: angles between the arcs that it may take. The arc of its block, from
   command_min to command_max, has all of them. Pods with such zones push one way. */
#include "internal.h"

#if FL_ZONES > 0
#define EDGE R(1e-9) /* angle [rad] that counts as the edge of a zone */

/* The zone that an angle of a command lies in, but for its edges; -1 where there is none. `off`
   becomes how far the angle is from the zone's middle [rad], `half` half of its width. */
static int zone_at(const fl_actuator *a, real angle, real *off, real *half) {
  for (int k = 0; k < (int)a->barred_count; k++) {
    const real low = a->barred[k][0];
    const real high = a->barred[k][1];
    *half = (high - low) / 2;
    *off = fl_wrap_angle(angle - (low + high) / 2);
    if (FABS(*off) < *half - EDGE) return k;
  }
  return -1;
}

/* Whether a zone lies in the arc of a set. A cut leaves none of those beside it there. */
static int is_in_set(const real *zone, const fl_set *set) {
  const real middle = (zone[0] + zone[1]) / 2;
  return FABS(fl_wrap_angle(middle - set->sector_center)) < set->sector_half_angle;
}

int fl_has_barred_zone(const fl_actuator *a, const fl_set *set) {
  for (int k = 0; k < (int)a->barred_count; k++) {
    if (is_in_set(a->barred[k], set)) return 1;
  }
  return 0;
}

/* Whether the force of a plane points into a barred zone in the arc of its set. */
int fl_is_barred(const fl_actuator *a, const fl_set *set, const real *force) {
  if (!(a->barred_count > 0)) return 0;
  if (size_of(force) <= NOTHING * a->row_force_max[0]) return 0;
  real off;
  real half;
  const int k = zone_at(a, ATAN2(force[1], force[0]), &off, &half);
  return k >= 0 && is_in_set(a->barred[k], set);
}

/* The barred zone by which a set is cut first: the one that a force points into, else the one that
   is nearest to the middle of the set. */
static int zone_to_cut(const fl_actuator *a, const fl_set *set, const real *force) {
  real off;
  real half;
  const int own = zone_at(a, ATAN2(force[1], force[0]), &off, &half);
  if (own >= 0 && is_in_set(a->barred[own], set)) return own;
  int nearest = 0;
  real least = 2 * PI;
  for (int k = 0; k < (int)a->barred_count; k++) {
    const real middle = (a->barred[k][0] + a->barred[k][1]) / 2;
    const real distance = FABS(fl_wrap_angle(middle - set->sector_center));
    if (distance < least) {
      least = distance;
      nearest = k;
    }
  }
  return nearest;
}

/* Leaves of a set the angles below (-1) or above (1) a barred zone, as zone_to_cut says. */
void fl_narrow_by_zone(const fl_actuator *a, fl_set *set, const real *force, int side) {
  real low = set->sector_center - set->sector_half_angle;
  real high = set->sector_center + set->sector_half_angle;
  const real *zone = a->barred[zone_to_cut(a, set, force)];
  const real half = (zone[1] - zone[0]) / 2;
  const real middle = set->sector_center +
                      fl_wrap_angle((zone[0] + zone[1]) / 2 - set->sector_center);
  if (side < 0)
    high = smaller(high, middle - half);
  else
    low = larger(low, middle + half);
  if (low > high) { /* nothing is left on this side but the edge */
    if (side < 0)
      low = high;
    else
      high = low;
  }
  set->sector_center = (low + high) / 2;
  set->sector_half_angle = (high - low) / 2;
}

/* Takes ends of an arc that lie in a barred zone to its edge within the arc. */
void fl_trim_arc(const fl_actuator *a, real *low, real *high) {
  real off;
  real half;
  if (zone_at(a, *low, &off, &half) >= 0) {
    const real edge = *low - off + half;
    /* both ends are in one zone: the nearer edge is all that there is */
    if (edge > *high) {
      const real below = *low - off - half;
      const real middle = (*low + *high) / 2;
      const int is_nearer_below = middle - below < edge - middle;
      *low = edge;
      if (is_nearer_below) *low = below;
      *high = *low;
      return;
    }
    *low = edge;
  }
  if (zone_at(a, *high, &off, &half) >= 0) *high = larger(*high - off - half, *low);
}

/* The angle itself, or the nearer edge of the barred zone that it lies in. */
real fl_leave_zone(const fl_actuator *a, real angle) {
  real off;
  real half;
  if (zone_at(a, angle, &off, &half) < 0) return angle;
  if (off < 0) return angle - off - half;
  return angle - off + half;
}

/* Leaves of a box (as commands are within it) of each pod the arc of its command. */
void fl_keep_arcs(const real *block, fl_box *box, real command[][3]) {
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    for (int k = 0; k < (int)a->barred_count; k++) {
      const real low = a->barred[k][0];
      const real high = a->barred[k][1];
      if (command[i][0] <= (low + high) / 2)
        box->command_max[i][0] = smaller(box->command_max[i][0], low);
      else
        box->command_min[i][0] = larger(box->command_min[i][0], high);
    }
  }
}
#endif
